"""Solve a run to a relative error: judge it by a coarser run, and solve it again if need be."""

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from hcm.accuracy.chosen import Chosen, choose, settings_for
from hcm.accuracy.coarser_run import (
    ACCURACY_QUANTITIES,
    COMPANION_ERROR_RATIO,
    coarser_scene,
    compared,
    stated_keys,
)
from hcm.bounds import ParameterError
from hcm.estimates.companion import GRAZE, folded, grazes
from hcm.estimates.error_cautions import relative_errors
from hcm.estimates.other_ends import open_ends, with_other_ends
from hcm.estimates.resolution import CAUTION_ERROR
from hcm.model import Scene
from hcm.results.result import Accuracy, Choice, TapResult
from hcm.results.status import Status
from hcm.simulate import solve_once
from hcm.stepping import Progress

# A tap may end otherwise if it grazes (`hcm.estimates.companion`) by less than GRAZE_OVER times the
# run's own accuracy, at most MOST_GRAZED or that accuracy: at 1e-2 one left at 0.037 of its
# approach speed in both runs though it lasts twice as long, at 1e-3 one pushed on with 0.0013 of
# its peak though it leaves.
# MOST_AGAIN : how often such a tap is solved again.
GRAZE_OVER, MOST_GRAZED, MOST_AGAIN = 10.0, 0.05, 2


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
            result = _short(result, expected, accuracy, stated_keys(kept.chosen))
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
    coarse = solve(coarser_scene(chosen, result))
    if coarse.status is Status.INTERRUPTED:
        return _Attempt(chosen, result.as_ended())
    result, expected = compared(result, coarse, chosen, accuracy)
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
