"""The runs of a convergence study, each stored as soon as it is finished."""

from collections.abc import Sequence
from dataclasses import replace

from validation.converge.refinements import LevelKeys
from validation.errors import RunFailedError, UserError
from validation.harness.interrupts import unless_interrupted
from validation.harness.quantities import OF_A_TAP
from validation.harness.record import plain
from validation.harness.store import Store
from validation.models import solid_inputs, solid_mesh, solid_relaxing
from validation.models.inputs import run_inputs, scene_inputs
from validation.scenes.load import NamedScene, load_scene
from validation.scenes.messages import show
from validation.scenes.scene import Scene

KEPT = (
    *(entry.key for entry in OF_A_TAP),
    *("peak_normal_force_time_s", "peak_tangential_force_N", "peak_stress_R_Pa"),
    *("energy_residual", "elements", "time_step_s", "steps", "wall_time_s"),
)
OF_MESH = ("elements", "time_step_s")
PEAKS = ("peak_normal_force_N", "peak_normal_force_time_s", "peak_tangential_force_N")
CAUTIONS = "cautions"
Values = dict[str, int | float | str | None]
"""Numbers of a run by their keys, and its cautions as one text."""


class LevelRuns:
    """Runs of one scene with one model, all from the same impact state.

    source, overrides : as `load_scene` takes them
    model : fem3d or fem2d
    """

    def __init__(self, source: str, overrides: Sequence[str], model: str, store: Store) -> None:
        self._source, self._given, self._store = source, tuple(overrides), store
        self._model, self._dimension = model, solid_inputs.DIMENSIONS[model]
        self.scene: NamedScene = load_scene(source, overrides)
        if (read := self.scene.tables.solver.fem.mesh) is not None:
            raise UserError(
                f"scene {self.scene.name}: solver.fem.mesh = {show(read)}: a mesh from a file"
                " cannot be refined; leave it out"
            )
        for key, (chosen, _) in solid_inputs.NEEDED.items():
            value = getattr(self.scene.tables.solver.fem, key)
            if chosen == "contact" and value is not None:
                raise UserError(
                    f"scene {self.scene.name}: solver.fem.{key} = {value:g}: a convergence study"
                    " sets contact laws and their numbers itself; leave it out"
                )
        try:
            self._start = solid_mesh.impact_state(self.scene.tables, self._dimension)
        except ValueError as error:
            raise UserError(f"scene {self.scene.name}: {error}") from error
        if self._start is None:
            raise RunFailedError(
                f"scene {self.scene.name}: the surface is not reached: lower surface.height, or let"
                " gravity and torques move the tip to it"
            )
        self.patch: float = solid_mesh.predicted_touch(
            self.scene.tables, self._dimension
        ).patch_radius

    def run(self, level: LevelKeys) -> Values:
        """Numbers and cautions of one level, from an earlier run of the same inputs and program
        if there is one.
        """
        texts = [f"{key}={value!r}" for key, value in level.items()]
        tables = load_scene(self._source, (*self._given, *texts)).tables
        start = scene_inputs(self.scene.tables, self._model)
        inputs = run_inputs(tables, self._model, __name__, impact_state_of=start)
        return self._store.obtain(inputs, Values, lambda: self._simulate(tables))

    def _simulate(self, tables: Scene) -> Values:
        import reference_fem
        from reference_fem.cautions import SPIKED

        try:
            sizing, _ = solid_mesh.sizing_of(tables, self._dimension)
            mesh = solid_mesh.build_mesh(tables, self._dimension, sizing)
            light = solid_mesh.flight_mesh(tables, self._dimension)
            materials, surface, drive, settings = solid_inputs.solid_parts(tables)
            settings = solid_relaxing.law_for(tables, sizing, materials[-1], settings)
            given = mesh, materials, surface, drive, replace(settings, estimate=False)
            result = unless_interrupted(
                reference_fem.simulate(*given, start=self._start, flight_mesh=light)
            )
        except ValueError as error:
            raise UserError(f"scene {self.scene.name}: {error}") from error
        if result.status is not reference_fem.Status.COMPLETED:
            raise RunFailedError(f"scene {self.scene.name}: {result.message}")
        values: Values = {key: plain(getattr(result.summary, key)) for key in KEPT}
        if any(text.startswith(SPIKED) for text in result.cautions):
            values |= dict.fromkeys(PEAKS)  # of a step or an element: it has no limit
        return values | {CAUTIONS: "; ".join(result.cautions)}
