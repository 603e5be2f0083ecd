"""Adapter of the two solid models: mesh, translation, timed solve."""

import time
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from validation.errors import UserError
from validation.harness.interrupts import unless_interrupted
from validation.harness.run_files import Fields
from validation.models.adapter import Checkpoint, Kind, Outcome, Progress, to_record
from validation.models.solid_accuracy import accuracy_record, largest_share, solved_within
from validation.models.solid_inputs import DIMENSIONS, Dimension, solid_parts, start_of
from validation.models.solid_mesh import (
    build_mesh,
    companion,
    flight_mesh,
    materials_within,
    sizes_of,
    sizing_of,
)
from validation.scenes.load import NamedScene, load_scene
from validation.scenes.scene import Scene

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


def variant(tables: Scene) -> str:
    """Preset or mesh file, holes for shafts, and the penalty factor where the scene changes it."""
    import reference_fem

    fem = tables.solver.fem
    name = fem.preset if fem.mesh is None else Path(fem.mesh).stem
    if fem.shaft_radius is not None:
        name += " shaft holes"
    if fem.penalty_factor in (None, reference_fem.Settings().penalty_factor):
        return name
    return f"{name} penalty {fem.penalty_factor:g}"


@dataclass(frozen=True)
class Solid:
    """The adapter of ``fem3d`` or of ``fem2d`` (plane stress)."""

    name: str
    kind: Kind = "reference"
    settings: str = "fem"
    resumable: bool = True
    sources: tuple[str, ...] = (__name__,)
    independent_of: tuple[str, ...] = ("hcm",)

    @property
    def dimension(self) -> Dimension:
        """3 or 2."""
        return DIMENSIONS[self.name]

    def refusal(self, scene: NamedScene) -> str:
        """Always empty: a scene that it can't take is refused when it is translated."""
        del scene
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
        taps: list[tuple[Any, Any]] = []

        def solve(asked: NamedScene) -> Outcome:
            return self._solved(asked, progress, None if taps else checkpoint, taps)

        return solved_within(solve, scene, self.dimension)

    def _solved(
        self,
        scene: NamedScene,
        progress: Progress | None,
        checkpoint: Checkpoint | None,
        taps: list[tuple[Any, Any]],
        warm: bool = False,
    ) -> Outcome:
        """Solve once; compare with the last of `taps` (meshes and results) and append to them.

        warm : whether the kernels of the one-point element are loaded.
        """
        import reference_fem

        tables = scene.tables
        try:  # bad sizes, geometry or settings are ValueErrors that name the key
            start = time.perf_counter()
            sizing, touch = sizing_of(tables, self.dimension)
            mesh = build_mesh(tables, self.dimension, sizing)
            coarse = flight_mesh(tables, self.dimension)
            mesh_time = time.perf_counter() - start
            materials, surface, drive, settings = solid_parts(tables)
            materials = materials_within(tables, touch, materials)
            damped = any(m.relaxation_time for m in materials)
            sizes = sizes_of(tables)
            if sizes is not None and self.dimension == 3 and settings.element is None:
                settings = replace(settings, element=None if damped else sizes.element)
            beside, compared = None, None
            if taps and taps[-1][1].errors and taps[-1][1].given["settings"] == settings:
                beside, compared = taps[-1]
            elif settings.estimate:
                beside = companion(tables, self.dimension, sizing)
            if settings.element == reference_fem.ONE_POINT and self.dimension == 3 and not warm:
                _warm_up_element(self, settings.element, damped)
            start = time.perf_counter()
            restart = None
            if checkpoint is not None:
                restart = reference_fem.Restart(checkpoint.path, checkpoint.resume)
            result = reference_fem.simulate(
                mesh, materials, surface, drive, settings, progress, start_of(tables), restart,
                companion=beside, compared=compared, flight_mesh=coarse,
            )  # fmt: skip
            taps.append((mesh, result))
            estimate_time = time.perf_counter() - start - result.summary.wall_time_s
        except ValueError as error:
            raise UserError(f"scene {scene.name}: {error}") from error
        record = to_record(result, scene, self.name, variant(tables), result.summary.wall_time_s)
        returns = RETURNS.format(tables.tip.restitution) if tables.tip.restitution < 1.0 else ""
        times = {"mesh_time_s": mesh_time, "estimate_time_s": max(estimate_time, 0.0)}
        record = replace(
            record,
            message="; ".join(filter(None, (record.message, returns))),
            statistics={**record.statistics, **times},
            accuracy=accuracy_record(tables, sizing, (settings, materials), record),
        )
        fields = Fields(mesh.points, mesh.cells, tuple(result.snapshots))
        left = largest_share(result.mesh_errors, record)
        return Outcome(record, fields, left)


@cache
def _warm_up_element(model: Solid, element: str, damped: bool) -> None:
    """Tap with an element that is not the default, once per process: it has its own kernels."""
    keys = f"solver.fem.element={element}", f"material.relaxation_time={1e-8 * damped}"
    warmed = model._solved(load_scene("soft", (*WARM_UP, *keys)), None, None, [], warm=True)
    unless_interrupted(warmed.record)


FEM3D, FEM2D = Solid("fem3d"), Solid("fem2d")
