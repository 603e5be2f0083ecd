"""Solve a run to a relative error: judge it by a coarser run, and solve it again if need be.

The coarser run's errors are `COMPANION_ERROR_RATIO` times as large, or more: those of steps in
contact go with h^2, of a followed vibration with h^(3/2) and at least l^4
(`hcm.accuracy.chosen_flight`), of elements in contact with l^4, of refined ones with l^2. The two
runs then differ by at least (ratio - 1) times the finer one's error; `SAFETY` covers errors that
fall more slowly with h and l.
A phalanx of one element, or of no more than the other run's flight needs, has twice as many in it,
whose error is at most a quarter of the run's: they differ by at least three quarters of that.
"""

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from hcm.accuracy.chosen import SMALLEST, STATED, Chosen, choose, settings_for
from hcm.bounds import ParameterError
from hcm.estimates.companion import GRAZE, folded, grazes, lost_energy, repetition_settings
from hcm.estimates.error_cautions import caution, later_taps, relative_errors, tap_peaks
from hcm.estimates.estimate import USABLE_STATUSES, companion_errors
from hcm.estimates.other_ends import open_ends, with_other_ends
from hcm.estimates.resolution import CAUTION_ERROR
from hcm.flight.fall import bending_wave_stress, magnified, omitted_time
from hcm.model import Scene
from hcm.parameters import GAUSS, Finger
from hcm.results.result import Accuracy, Choice, Errors, TapResult
from hcm.results.status import Status
from hcm.simulate import solve_once
from hcm.stepping import Progress

COMPANION_ERROR_RATIO, SAFETY = 3.0, 1.5
# Factor on the step of a flight that does not follow its vibration: with equal steps both runs have
# it in the same wrong phase, and a tap that fades out, 1 % too short, would seem known to 0.03 %.
OTHER_PHASE = 0.8
# A tap may end otherwise if it grazes (`hcm.estimates.companion`) by less than GRAZE_OVER times the
# run's own accuracy, at most MOST_GRAZED or that accuracy: at 1e-2 one left at 0.037 of its
# approach speed in both runs though it lasts twice as long, at 1e-3 one pushed on with 0.0013 of
# its peak though it leaves.
# MOST_AGAIN : how often such a tap is solved again.
GRAZE_OVER, MOST_GRAZED, MOST_AGAIN = 10.0, 0.05, 2
ACCURACY_QUANTITIES = (
    "peak_normal_force_N", "normal_impulse_N_s", "contact_duration_s", "contact_time_s",
)  # fmt: skip
"""Fields of the summary whose relative errors an accuracy bounds."""
RESOLVING = (
    "elements", "flight_elements", "flight_step", "flight_tolerance", "contact_step",
    "contact_tolerance",
)  # fmt: skip
"""Settings that bound a run's errors."""
TRANSITION_COUNTS = ("compression_to_restitution", "stick_to_slip", "slip_to_stick")


@dataclass(frozen=True)
class _Attempt:
    """A run and what its coarser run says of it.

    expected : largest expected relative error; None if none is estimated
    folds : whether the finger folds up. several : whether the rule that ends taps left other ends
    open: a change due to these is not a lack of repeatability
    """

    chosen: Chosen
    result: TapResult
    expected: float | None = None
    folds: bool = False
    several: bool = False

    def grazes(self, share: float = GRAZE) -> bool:
        """Whether the tap may end otherwise by chance, as it grazes by less than `share`."""
        return not self.several and grazes(self.result, share)

    @property
    def unknown(self) -> float:
        """Share of the tip's speed of approach that a modal flight does not know."""
        return self.chosen.flight_error if self.chosen.scene.settings.flight == "modal" else 0.0

    @property
    def chance(self) -> bool:
        """Whether two runs may agree on the tap by chance."""
        return self.grazes() or (self.folds and not self.several)


def simulate_within(
    accuracy: float,
    scene: Scene,
    stated: Mapping[str, object] = MappingProxyType({}),
    progress: Progress | None = None,
) -> TapResult:
    """`hcm.simulate_scene` with the settings of `settings_for`.

    A run that touches but whose energy audit does not close is solved again, for an accuracy 9
    times smaller. If errors are estimated, so is a run whose expected error exceeds the accuracy or
    whose tap may end by chance, for an accuracy 3 to 9 times smaller; a tap that may still end
    otherwise, once more. wall_time_s is that of all runs. If one of these needs more steps or
    memory than is allowed, the one before it is kept.
    """
    began, choices = time.perf_counter(), tuple[Choice, ...]()
    chosen = settings_for(accuracy, scene, stated)
    spent = time.perf_counter() - began
    kept, target, modal = _attempt(chosen, accuracy, progress), accuracy, True
    spent += kept.result.statistics.wall_time_s
    for _ in range(MOST_AGAIN):
        target, reason = _finer(kept, accuracy, target)
        if not reason:
            break
        began, modal = time.perf_counter(), modal and kept.unknown <= accuracy
        chosen = choose(target, scene, stated, modal)
        spent += time.perf_counter() - began
        if chosen.scene == kept.chosen.scene:  # all that matters is stated
            break
        beyond = f"a finer run takes more than max_steps = {scene.settings.max_steps} steps"
        try:
            finer = _attempt(chosen, accuracy, progress)
            spent += finer.result.statistics.wall_time_s
        except ParameterError as refusal:  # the run is too large
            finer, beyond = None, f"no finer run: {refusal}"
        if finer is None or finer.result.status is Status.WORK_LIMIT:
            cautions = (*kept.result.cautions, beyond)
            kept = replace(kept, result=replace(kept.result, cautions=cautions))
            break
        kept, choices = finer, (Choice("accuracy", target, f"solved again: {reason}"),)
    result, expected = kept.result, kept.expected
    if expected is not None and expected > accuracy:
        if kept.chance and expected > CAUTION_ERROR:
            result = _unrepeatable(result, expected)
        else:
            if choices:  # smaller steps did not bring it there: their order can't be relied on
                expected = max(expected, _bound(result))
            result = _short(result, expected, accuracy, _stated(kept.chosen))
    return replace(
        result,
        statistics=replace(result.statistics, wall_time_s=spent),
        accuracy=Accuracy(accuracy, expected, (*kept.chosen.choices, *choices)),
    )


def _attempt(chosen: Chosen, accuracy: float, progress: Progress | None) -> _Attempt:
    """Solve, and judge the run if it completed and errors are wanted."""

    def solve(scene: Scene) -> TapResult:
        return solve_once(scene, progress)[0]

    result, left_out = solve_once(chosen.scene, progress, chosen.fall)
    if chosen.scene.settings.flight == "modal":
        chosen = replace(chosen, flight_error=left_out)
    if not (
        chosen.scene.settings.estimate and _touched(result) and result.status is Status.COMPLETED
    ):
        return _Attempt(chosen, result)
    coarse = solve(_coarser(chosen, result))
    if coarse.status is Status.INTERRUPTED:
        return _Attempt(chosen, result.as_ended())
    result, expected = _compared(result, coarse, chosen, accuracy)
    several = bool(open_ends(result))
    result = with_other_ends(result, solve)
    if result.status is Status.INTERRUPTED:
        return _Attempt(chosen, result)
    if several:
        expected = max(expected, _bound(result))
    return _Attempt(chosen, result, expected, folded(result, chosen.scene.finger.length), several)


def _finer(run: _Attempt, accuracy: float, target: float) -> tuple[float, str]:
    """The accuracy for which a run is solved again, and why; no reason if it is not.

    accuracy : wanted. target : for which the run was made, smaller if it was one again.
    """
    most, expected = COMPANION_ERROR_RATIO**2, run.expected
    first, barely = target == accuracy, "the finger folds up, or its tap barely ends"
    if first and _touched(run.result) and run.result.status is Status.UNBALANCED:
        return target / most, "the energy audit of the first run did not close"
    if run.unknown > accuracy and run.result.status in (Status.COMPLETED, Status.TOO_FLEXIBLE):
        return target, f"modes leave {run.unknown:.1g} of the speed of approach unknown"
    if expected is None:
        return target, ""
    if run.grazes(min(GRAZE_OVER * target, max(MOST_GRAZED, target))):
        return target / most, barely
    if not first:  # a coarser run with another tap: whose it is a third run says
        apart = expected > max(accuracy, CAUTION_ERROR) and run.grazes(MOST_GRAZED)
        return target / most, barely * (apart and not run.folds)
    if expected <= accuracy and not run.chance:
        return target, ""
    reason = barely if run.chance else f"the first run's estimate was {expected:.2g}"
    return target / min(max(expected / accuracy, COMPANION_ERROR_RATIO), most), reason


def _bound(result: TapResult) -> float:
    """The largest of the relative errors that the run states of what an accuracy bounds."""
    shares = relative_errors(result.summary, result.errors)
    return max(shares[name] for name in ACCURACY_QUANTITIES)


def _touched(result: TapResult) -> bool:
    return result.summary.contact_time_s is not None


def _coarser(chosen: Chosen, own: TapResult) -> Scene:
    """Scene of the coarser run that judges `own`, over as many taps.

    In contact, and in a vibration that is followed, its error is `COMPANION_ERROR_RATIO` times as
    large. As many elements would tell nothing of their errors: twice as many do. Gauss's few steps
    in flight leave hardly any error but the phase of a vibration that they do not follow: it
    differs here (`OTHER_PHASE`).
    """
    scene, settings = chosen.scene, chosen.scene.settings
    longer, flown, kept, ratio = 1.0, settings.flight_elements, 1, COMPANION_ERROR_RATIO
    if chosen.followed:
        longer = OTHER_PHASE if settings.flight == "modal" else ratio ** (2 / 3)
        most = max(p.elements for p in scene.finger.phalanges)
        flown = _fewer(min(flown, most), ratio**0.25)
        kept = flown  # no phalanx has more elements in flight than in contact
    elif settings.flight == "elastic":
        longer = OTHER_PHASE if settings.flight_integrator == GAUSS else math.sqrt(ratio)
    others = []
    for p in scene.finger.phalanges:
        fewer = max(_fewer(p.elements, math.sqrt(ratio)), min(p.elements, kept))
        others.append(replace(p, elements=2 * fewer if fewer == p.elements else fewer))
    coarse = repetition_settings(
        settings,
        own,
        flight_elements=flown,
        flight_step=min(longer * settings.flight_step, 1.0),
        flight_tolerance=min(ratio * settings.flight_tolerance, 1.0),
        contact_step=min(math.sqrt(ratio) * settings.contact_step, 1.0),
        taps=max(tap_peaks(own).size, 1),
    )
    return replace(scene, finger=Finger(tuple(others)), settings=coarse)


def _fewer(elements: int, factor: float) -> int:
    """Elements over `factor`, rounded, and at least one fewer; 1 becomes 2, 0 stays 0."""
    return 2 if elements == 1 else max(min(round(elements / factor), elements - 1), 0)


def _compared(
    result: TapResult, coarse: TapResult, chosen: Chosen, accuracy: float
) -> tuple[TapResult, float]:
    """Return the run with its estimated errors, and its largest expected relative error."""
    left_out = chosen.flight_error if chosen.flight_error < math.inf else 0.0
    settings = chosen.scene.settings
    single = any(phalanx.elements == 1 for phalanx in chosen.scene.finger.phalanges)
    single |= chosen.followed and settings.flight_elements == 1
    over = 1.0 if single else COMPANION_ERROR_RATIO - 1
    last, its = (run.given["finger"].phalanges[-1].elements for run in (result, coarse))
    of_stress = 2.0 if single or its > last else 1.0
    bent = late = 0.0
    if settings.flight == "rigid" and (fall := chosen.fall):
        finger = chosen.scene.finger
        bent = bending_wave_stress(fall.ringing + fall.bending, finger.phalanges[-1])
        late = omitted_time(fall.largest / fall.speed, finger, fall.time)
    stated = _stated(chosen)
    if accuracy > SMALLEST:
        remedy = "ask for a smaller accuracy" + f" without stating {stated}" * bool(stated)
    else:
        remedy = f"leave out {stated}" if stated else f"{accuracy:g} is the smallest accuracy"
    # not estimated from two runs: `SAFETY`, which multiplies all errors below, does not apply
    omitted = bent / SAFETY, late / SAFETY
    apart_by = companion_errors(result, coarse, of_stress, left_out, *omitted)
    errors: Errors = {
        name: (SAFETY * e[0], SAFETY * e[1]) if isinstance(e, tuple) else SAFETY * e
        for name, e in apart_by.items()
    }
    cautions = (
        *result.cautions,
        *caution(relative_errors(result.summary, errors), settings, remedy),
        *later_taps(tap_peaks(result), tap_peaks(coarse)),
        *other_transitions(result, coarse, remedy),
        *(magnified(chosen.scene, chosen.fall) if chosen.fall else ()),
    )
    both = result.summary, coarse.summary
    pairs = [[getattr(of, name) for of in both] for name in ACCURACY_QUANTITIES]
    known = coarse.status in USABLE_STATUSES
    apart = [abs(its / own - 1.0) if known and its is not None else math.inf for own, its in pairs]
    late_share = late / max(result.summary.contact_time_s or 0.0, 1e-300)
    expected = max(SAFETY * max(apart) / over, 0.5 * lost_energy(result), left_out, late_share)
    return replace(result, errors=errors, cautions=cautions), expected


def _stated(chosen: Chosen) -> str:
    """The scene's keys that keep a run's errors as they are, whatever accuracy is asked for."""
    keys = [c.setting for c in chosen.choices if c.reason == STATED and c.setting in RESOLVING]
    return ", ".join(
        "finger.elements" if key == "elements" else f"solver.hcm.{key}" for key in keys
    )


def other_transitions(result: TapResult, coarse: TapResult, remedy: str) -> tuple[str, ...]:
    """Caution about the first tap's transitions if the coarser run has more or fewer of them."""
    both = result.summary, coarse.summary
    counts = [(name, *(getattr(of, name) for of in both)) for name in TRANSITION_COUNTS]
    apart = ", ".join(f"{name} {own} against {its}" for name, own, its in counts if own != its)
    caution = f"transitions are not resolved ({apart} in coarser steps); {remedy}"
    return (caution,) if apart else ()


def _unrepeatable(result: TapResult, expected: float) -> TapResult:
    """The run of a tap that comes out otherwise in other steps."""
    ratio = COMPANION_ERROR_RATIO
    doubt = f"; a run at {ratio:g} times the accuracy changes the first tap by {expected:.1g}"
    return result.as_ended(Status.UNREPEATABLE, doubt)


def _short(result: TapResult, expected: float, accuracy: float, stated: str) -> TapResult:
    """The run with a caution that it did not get to its accuracy."""
    error = f"a relative error of {expected:.3g}" if expected < math.inf else "an unknown error"
    short = f"expects {error}; {accuracy:g} was wanted"
    short += ", which settings that the scene states do not allow" * bool(stated)
    return replace(result, cautions=(*result.cautions, short))
