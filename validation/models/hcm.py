"""Adapter of the reduced model, with the paper's and with the refined assumptions."""

import time
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple

from validation.errors import UserError
from validation.harness.interrupts import unless_interrupted
from validation.models.adapter import Adapter, Checkpoint, Outcome, Progress, drive_of, to_record
from validation.models.sudden_torques import sudden_torques
from validation.scenes.load import NamedScene, changed_scene, load_scene
from validation.scenes.scene import Scene
from validation.scenes.solver_tables import DEFAULT_ACCURACY

if TYPE_CHECKING:
    import hcm

WARM_UP = (
    "solver.hcm.estimate=false",
    "finger.phalanges=1",
    "finger.elements=2",
    "surface.height=0.01",
)
REFINED = "solver.hcm.assumptions='refined'"
NO_STIFFNESS = (
    "tip.normal_stiffness is missing: the paper's reduced model, hcm, has a spring of that k"
    " (fingertap identify contact finds one); hcm-refined, whose patch slips in parts, has none"
)
OVERRIDDEN = "solver.hcm.assumptions = 'paper' has no effect on {}: use --model hcm"


def hcm_scene(scene: NamedScene, *, estimate: bool) -> "hcm.Scene":
    """The scene as the solver takes it.

    estimate : whether errors are estimated, where the scene does not switch that off.

    Raises UserError: the reduced model cannot take this scene.
    """
    import hcm

    tables = scene.tables
    finger, material, start = tables.finger, tables.material, tables.start_state
    stated = tables.solver.hcm.stated(hcm.Settings)
    stated["estimate"] = estimate and stated.get("estimate", True)
    sizes, elastic = (finger.length, finger.diameter), (material.youngs_modulus, material.density)
    further = (
        tables.elements, material.relaxation_time or 0.0, material.poisson_ratio, material.law,
    )  # fmt: skip
    try:
        phalanges = tuple(hcm.Phalanx(*row) for row in tables.rows(*sizes, *elastic, *further))
        return hcm.Scene(
            finger=hcm.Finger(phalanges=phalanges),
            surface=hcm.Surface(height=tables.surface.height, friction=tables.surface.friction),
            tip=hcm.Tip(**{**dict(tables.tip), "tangential_ratio": tables.tangential_ratio}),
            start=None if start is None else hcm.RigidStart(*start),
            drive=drive_of(tables, hcm),
            settings=hcm.Settings(**stated),
            assumptions=assumptions_of(tables),
        )
    except hcm.ParameterError as error:
        raise UserError(f"scene {scene.name}: {error}") from error


def assumptions_of(tables: Scene) -> "hcm.Assumptions":
    """The assumptions that a scene states; refusals (`hcm.ParameterError`) name its keys."""
    import hcm

    try:
        return hcm.Assumptions(**tables.solver.hcm.stated(hcm.Assumptions))
    except hcm.ParameterError as error:
        raise hcm.ParameterError(f"solver.hcm.{error}") from error


class Kernels(NamedTuple):
    """The choices of a run that need their own compiled kernels.

    within : whether the run is made by `hcm.simulate_within`, which passes its rods' fall on.
    """

    flight: str = "elastic"
    flight_integrator: str = "generalized-alpha"
    contact_integrator: str = "generalized-alpha"
    refined: bool = False
    within: bool = False


COMPILED = Kernels._fields[:3]


@cache
def warm_up_kernels(of: Kernels) -> None:
    """Compile these kernels with a tiny tap, once per process."""
    import hcm

    keys = {key: getattr(of, key) for key in COMPILED}
    chosen = [f"solver.hcm.{key}={value!r}" for key, value in keys.items()]
    scene = load_scene("soft", (*WARM_UP, *chosen, *([REFINED] if of.refined else [])))
    given = hcm_scene(scene, estimate=False)
    simulate = partial(hcm.simulate_scene, given)
    if of.within:
        simulate = partial(hcm.simulate_within, 1e-2, given, keys)
    unless_interrupted(simulate())


def warm_up_choices() -> None:
    """Compile what an accuracy may choose with the paper's assumptions, and choosing itself."""
    import hcm

    warm_up_kernels(Kernels(flight="rigid"))
    warm_up_kernels(Kernels("modal", flight_integrator="gauss"))
    warm_up_kernels(Kernels(contact_integrator="gauss"))
    hcm.simulate_within(1e-2, hcm_scene(load_scene("soft", WARM_UP), estimate=False))


@dataclass(frozen=True)
class Reduced(Adapter):
    """The adapter of ``hcm`` or of ``hcm-refined``.

    overrides : changes of the scene that it runs on.
    """

    name: str
    overrides: tuple[str, ...] = ()
    kind, settings, resumable = "reduced", "hcm", False
    sources, independent_of = (__name__,), ("reference_fem", "meshes")

    def refusal(self, scene: NamedScene) -> str:
        """`NO_STIFFNESS` if its assumptions have a spring and the scene has none.

        What else it can't compute is refused when the scene is translated.
        """
        import hcm

        if scene.tables.tip.normal_stiffness is not None:
            return ""
        try:
            assumed = assumptions_of(self._own(scene).tables)
        except hcm.ParameterError:
            return ""
        return NO_STIFFNESS if assumed.needs_stiffness else ""

    def _own(self, scene: NamedScene) -> NamedScene:
        """The scene with the model's overrides."""
        if not self.overrides:
            return scene
        return changed_scene(scene.name, scene.document, self.overrides, scene.name)

    def warm_up(self) -> None:
        """Tap once with one phalanx of two elements, with the kernels of the default accuracy."""
        accuracy = f"solver.hcm.accuracy={DEFAULT_ACCURACY[self.settings]}"
        unless_interrupted(self.run(load_scene("soft", (*WARM_UP, accuracy))).record)

    def run(
        self,
        scene: NamedScene,
        progress: Progress | None = None,
        checkpoint: Checkpoint | None = None,
    ) -> Outcome:
        """Run the reduced model; it takes seconds, so there is nothing to resume."""
        import hcm
        from hcm.accuracy.chosen import choose

        del checkpoint
        own = scene.tables.solver.hcm.assumptions
        scene = self._own(scene)
        given = hcm_scene(scene, estimate=True)
        simulate, settings = partial(hcm.simulate_scene, given), given.settings
        accuracy = scene.tables.solver.accuracy_of(self.settings)
        refined = given.assumptions.any

        def compiled(settings: Any) -> bool:
            """Compile the kernels of these settings; return whether that was necessary."""
            known = warm_up_kernels.cache_info().misses
            chosen = {key: getattr(settings, key) for key in COMPILED}
            warm_up_kernels(Kernels(**chosen, refined=refined, within=accuracy is not None))
            return warm_up_kernels.cache_info().misses > known

        try:
            if accuracy is not None:
                stated = scene.tables.solver.hcm.stated(hcm.Settings)
                if (elements := scene.tables.finger.elements) is not None:
                    stated["elements"] = elements
                simulate = partial(hcm.simulate_within, accuracy, given, stated)
                settings = choose(accuracy, given, stated).scene.settings
            compiled(settings)
            start = time.perf_counter()
            result = simulate(progress=progress)
            # solving again for a smaller error may have compiled another flight meanwhile
            took: dict[str, Any] = {}
            if result.accuracy:
                took = {c.setting: c.value for c in result.accuracy.choices}
            if took and compiled(replace(settings, **{k: took[k] for k in COMPILED if k in took})):
                start = time.perf_counter()
                result = simulate(progress=progress)
        except hcm.ParameterError as error:
            raise UserError(f"scene {scene.name}: {error}") from error
        estimate_time = time.perf_counter() - start - result.statistics.wall_time_s
        record = to_record(result, scene, self.name)
        message = record.message
        if self.overrides and record.ok:
            overridden = OVERRIDDEN.format(self.name) if own == "paper" else ""
            sudden = sudden_torques(scene.tables, record.summary)
            message = "; ".join(filter(None, (message, overridden, sudden)))
        statistics = {**record.statistics, "estimate_time_s": estimate_time}
        return Outcome(replace(record, message=message, statistics=statistics))


HCM, HCM_REFINED = Reduced("hcm"), Reduced("hcm-refined", (REFINED,))
