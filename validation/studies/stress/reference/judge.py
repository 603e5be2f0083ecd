"""Judging a cell of the reference's maps: a run, checked independently of the solver."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

import reference_fem as rf
from reference_fem.model import Model
from reference_fem.stable_step import stable_step
from validation.studies.stated_errors import true_errors
from validation.studies.stress.judging import SMALLER_STEP, judged_scalars, largest_difference
from validation.studies.stress.reference.checks import violations
from validation.studies.stress.reference.scene import ReferenceScene
from validation.studies.stress.stability_map import RIGHT_WITHIN, Answer, CellVerdict

# Change of the speed, too small to measure, and the change of the tap beyond which it is chaotic.
NUDGE, CHAOTIC = 1e-6, 0.01
# Against another law, element or mesh of four to six elements an edge: not the same equations. A
# choice, not a measurement: it finds gross errors only.
OTHER_SCHEME_WITHIN = 0.3
# Against the limit of an elastic bar: what its vibration keeps of the impulse on four elements.
OF_BAR = 0.05
# Below this speed over the bar's wave speed a contact is linear.
SLOW = 0.02
HALF, BAR = "half the step", "elastic bar"


def judge(scene: ReferenceScene) -> CellVerdict:
    """Run a scene and beside it one at half the step, one of another law or element, one nudged.

    A completed run must keep the invariants of `checks` and repeat at half the step to
    `RIGHT_WITHIN`; where it doesn't, the solver's own caution or a chaotic contact (a speed
    changed by a millionth changes it) makes it flagged, else it is wrong. A finger's run states
    errors, from its edges alone: it must differ by no more from any of the others. A block's has
    none.
    """
    try:
        result, model = scene.simulate()
    except ValueError as refusal:
        return CellVerdict(Answer.REFUSED, str(refusal))
    summary = result.summary
    found = CellVerdict(
        Answer.RIGHT, "", "momentum, energy of its fields, cone", None,
        float(summary.energy_residual or 0.0), summary.steps, summary.wall_time_s,
    )  # fmt: skip
    broken = violations(result, model)
    if broken:
        return found.judged(Answer.WRONG, "; ".join(broken))
    if result.status is not rf.Status.COMPLETED:
        last = result.history.time_s[-1] if len(result.history.time_s) else 0.0
        reason = f"{result.status.value} at t = {last:.4g} s: {result.message}"
        return found.judged(Answer.STOPPED, reason)
    for name, other, bound in _witnesses(scene):
        truth = other.simulate()[0]
        error = largest_difference(scalars(result), scalars(truth))
        if name == HALF:
            found = replace(found, error=error)
        if error is None or not error <= bound:  # NaN agrees with nothing
            return _doubtful(scene, result, found, name, error)
        numbers = true_errors(vars(summary), result.errors, vars(truth.summary))
        found = found.within_stated(name, numbers, bool(result.cautions))
        if found.answer is not Answer.RIGHT:
            return found
    limit = bar_impulse(scene, model)
    if limit is not None:
        found = replace(found, checked_by=f"{found.checked_by}, {BAR}")
        error = abs((summary.normal_impulse_N_s or 0.0) / limit - 1.0)
        if not error <= OF_BAR:
            return _doubtful(scene, result, found, BAR, error)
    none = np.empty(0, dtype=np.int64), np.empty(0)
    alone = scene.step_factor * stable_step(model.kernel, *none, model.symmetry)  # without contact
    ratio = alone / model.step_s
    if ratio > 1.0 / SMALLER_STEP:
        return found.judged(Answer.SMALLER, f"contact asks for steps {ratio:.3g} times shorter")
    return found


def _witnesses(scene: ReferenceScene) -> Iterator[tuple[str, ReferenceScene, float]]:
    """Name, scene and largest difference of every run that must agree."""
    yield HALF, replace(scene, step_factor=scene.step_factor / 2.0), RIGHT_WITHIN
    calm = replace(scene, step_factor=min(scene.step_factor, 0.9) / 2.0)
    if scene.contact != "impulse":
        yield "contact without a penalty", replace(calm, contact="impulse"), OTHER_SCHEME_WITHIN
    if scene.element == "hex8-one-point":
        yield "8-point element", replace(calm, element="hex8-sri"), OTHER_SCHEME_WITHIN
    if scene.distortion:
        yield "even mesh", replace(calm, distortion=0.0), OTHER_SCHEME_WITHIN


def _doubtful(
    scene: ReferenceScene, result: rf.TapResult, found: CellVerdict, name: str, error: float | None
) -> CellVerdict:
    """The verdict on a run that differs: flagged if cautioned or chaotic, else wrong."""
    differs = f"{name}: " + ("the tap is lost" if error is None else f"differs by {error:.2g}")
    if result.cautions:
        return found.judged(Answer.FLAGGED, f"cautioned, {result.cautions[0]} ({differs})")
    nudged = replace(scene, speed=scene.speed * (1.0 + NUDGE)).simulate()[0]
    spread = largest_difference(scalars(result), scalars(nudged))
    if spread is None or spread > CHAOTIC:
        change = "the tap is lost" if spread is None else f"it changes by {spread:.2g}"
        return found.judged(Answer.FLAGGED, f"speed changed by {NUDGE:g}, {change}")
    return found.judged(Answer.WRONG, differs)


def scalars(result: rf.TapResult) -> tuple[float, ...] | None:
    """Scalars of a completed tap; None if the run did not complete."""
    completed = result.status is rf.Status.COMPLETED
    return judged_scalars(result.summary, result.forces) if completed else None


def bar_impulse(scene: ReferenceScene, model: Model) -> float | None:
    """2 m v of a block that falls flat and slowly and cannot bulge, N s.

    None for another scene; a plate is as thick as a round section, and not a bar.
    """
    uneven = scene.tilt or scene.poisson or scene.slide or scene.distortion
    bar = scene.body == "block" and not uneven
    if scene.dim == 2 or not bar or scene.speed > SLOW * scene.material.bar_speed:
        return None
    return 2.0 * float(model.mass.sum()) * model.symmetry_factor * scene.speed
