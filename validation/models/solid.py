"""Adapter of the two solid models: mesh, translation, timed solve."""

import time
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Literal, NamedTuple

from validation.errors import UserError
from validation.harness.interrupts import unless_interrupted
from validation.harness.run_files import Fields
from validation.models.adapter import Adapter, Checkpoint, Outcome, Progress, to_record
from validation.models.sudden_torques import sudden_torques
from validation.scenes.load import NamedScene, load_scene

WARM_UP = (  # run once for each law that a preset uses
    "solver.fem.estimate=false",
    "surface.height=0.06",
    "solver.fem.section_size=5e-3",
    "solver.fem.axial_size=1e-2",
    "solver.fem.tip_size=5e-3",
)
RETURNS = (
    "tip.restitution = {:g} is for the reduced model alone: elements lose energy only by"
    " material.relaxation_time"
)


class _Solve(NamedTuple):
    """One of a run's solves: its mesh, result, and edge at the contact, m, if that is known."""

    mesh: Any
    result: Any
    edge: float | None


@dataclass(frozen=True)
class Solid(Adapter):
    """The adapter of ``fem3d`` or of ``fem2d`` (plane stress).

    What else than the law it can't take is refused when the scene is translated.
    """

    name: str
    dimension: Literal[2, 3]
    kind, settings, resumable = "reference", "fem", True
    sources, independent_of = (__name__,), ("hcm",)

    def refusal(self, scene: NamedScene) -> str:
        """Why its elements can't take the scene's `material.law`."""
        # all elements have the law of a scene that states none: don't load the package for that
        if "law" not in scene.tables.material.model_fields_set:
            return ""
        from reference_fem.model import formulation

        try:
            formulation(self.dimension, None, scene.tables.material.law)
        except ValueError as error:
            return str(error)
        return ""

    def warm_up(self) -> None:
        """Tap twice with a coarse mesh, so that every kernel is loaded."""
        for law, relaxation in (("penalty", 0.0), ("impulse", 1e-8)):
            keys = f"solver.fem.contact={law}", f"material.relaxation_time={relaxation}"
            scene = load_scene("soft", (*WARM_UP, *keys))
            unless_interrupted(self.run(scene).record)

    def run(
        self,
        scene: NamedScene,
        progress: Progress | None = None,
        checkpoint: Checkpoint | None = None,
    ) -> Outcome:
        """Mesh, translate and solve, again if an accuracy asks for it; only solves are timed."""
        from reference_fem import RestartError
        from validation.models.solid_accuracy import solved_within

        solves: list[_Solve] = []

        def solve(asked: NamedScene) -> Outcome:
            return self._solved(asked, progress, checkpoint, solves)

        try:
            return solved_within(solve, scene, self.dimension)
        except RestartError as error:  # of any solve: no mesh is at fault
            raise UserError(f"scene {scene.name}: {error}") from error

    def _solved(
        self,
        scene: NamedScene,
        progress: Progress | None,
        checkpoint: Checkpoint | None,
        solves: list[_Solve],
        warm: bool = False,
    ) -> Outcome:
        """Solve once; compare with the last of `solves` and append to them.

        A scene may state its edges at the contact: then a mesh that is finer elsewhere is judged
        by a companion of its own, as one of the same edges there tells next to nothing.

        warm : whether the kernels of an element that is not the default are loaded.
        """
        import reference_fem
        from validation.models import solid_accuracy, solid_inputs, solid_mesh, solid_relaxing

        tables = scene.tables
        try:  # bad sizes, geometry or settings are ValueErrors that name the key
            start = time.perf_counter()
            sizing, touch = solid_mesh.sizing_of(tables, self.dimension)
            mesh = solid_mesh.build_mesh(tables, self.dimension, sizing)
            coarse = solid_mesh.flight_mesh(tables, self.dimension)
            mesh_time = time.perf_counter() - start
            materials, surface, drive, settings = solid_inputs.solid_parts(tables)
            settings = solid_relaxing.law_for(tables, sizing, materials[-1], settings)
            elastic = materials
            materials = solid_relaxing.materials_within(tables, touch, elastic)
            damped = any(m.relaxation_time for m in materials)
            sizes, edge = solid_mesh.sizes_of(tables), sizing and sizing.tip_size
            if sizes is not None and self.dimension == 3 and settings.element is None:
                eight = damped or tables.material.law == reference_fem.NEO_HOOKE
                settings = replace(settings, element=None if eight else sizes.element)
            beside, compared = None, None
            if solves and _may_judge(solves[-1], settings, edge):
                beside, compared = solves[-1].mesh, solves[-1].result
            elif settings.estimate:
                beside = solid_mesh.companion(tables, self.dimension, sizing)
            if materials != elastic:
                mesh, beside = (
                    body and solid_relaxing.relaxing_near(tables, touch, sizing, body)
                    for body in (mesh, beside)
                )
                coarse = coarse and solid_relaxing.relaxing_nowhere(coarse)
            if self.dimension == 3 and not warm:
                _warm_up_kernel(self, settings.element, tables.material.law, damped)
            start = time.perf_counter()
            restart = None
            if checkpoint is not None:
                own = checkpoint.of_solve(len(solves) + 1)
                restart = reference_fem.Restart(own, checkpoint.resume)
            result = reference_fem.simulate(
                mesh, materials, surface, drive, settings, progress,
                solid_inputs.start_of(tables), restart,
                companion=beside, compared=compared, flight_mesh=coarse,
            )  # fmt: skip
            solves.append(_Solve(mesh, result, edge))
            estimate_time = time.perf_counter() - start - result.summary.wall_time_s
        except reference_fem.RestartError:
            raise
        except ValueError as error:
            raise UserError(f"scene {scene.name}: {error}") from error
        record = to_record(result, scene, self.name, solid_inputs.variant(tables))
        returns = RETURNS.format(tables.tip.restitution) if tables.tip.restitution < 1.0 else ""
        sudden = sudden_torques(tables, record.summary)
        times = dict(zip(solid_accuracy.SPENT, (mesh_time, max(estimate_time, 0.0)), strict=True))
        record = replace(
            record,
            message="; ".join(filter(None, (record.message, returns, sudden))),
            statistics={**record.statistics, **times},
            accuracy=solid_accuracy.accuracy_record(tables, sizing, (settings, materials), record),
        )
        fields = Fields(mesh.points, mesh.cells, tuple(result.snapshots))
        left = solid_accuracy.largest_share(result.mesh_errors, record)
        return Outcome(record, fields, left)


def _may_judge(coarser: _Solve, settings: Any, edge: float | None) -> bool:
    """Whether a solve with these settings and this edge may be judged by the one before."""
    from reference_fem.estimates.mesh_error import LEAST_RATIO

    if edge is None or coarser.edge is None or not coarser.result.errors:
        return False
    alike = coarser.result.given["settings"] == settings
    return bool(alike and coarser.edge >= LEAST_RATIO * edge)


@cache
def _warm_up_kernel(model: Solid, element: str | None, law: str, damped: bool) -> None:
    """Tap once per process with an element or law that is not the default, if there is such: it
    has its own kernels.
    """
    import reference_fem

    one_point, neo_hookean = element == reference_fem.ONE_POINT, law == reference_fem.NEO_HOOKE
    refused = one_point and (damped or neo_hookean)
    if refused or not (one_point or neo_hookean):
        return
    keys = [f"material.law={law}", f"material.relaxation_time={1e-8 * damped:g}"]
    if one_point:
        keys.append(f"solver.fem.element={element}")
    warmed = model._solved(load_scene("soft", (*WARM_UP, *keys)), None, None, [], warm=True)
    unless_interrupted(warmed.record)


FEM3D, FEM2D = Solid("fem3d", 3), Solid("fem2d", 2)
