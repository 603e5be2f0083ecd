"""Other ends of a first tap, if the rule that separates taps (`hcm.taps.tap`) decided narrowly.

An end is open if the value that the rule compared differs from its threshold by at most
`THRESHOLD_SHARE` times the threshold plus `ERROR_FACTOR` times the estimated error of the tap's
duration, as several times of touches and separations enter the comparison. The scene is then solved
again with the touches of that end (`Settings.tap_until`), and the differences count as errors.
"""

import math
from collections.abc import Callable
from dataclasses import replace

from hcm.estimates.companion import repetition_settings
from hcm.estimates.estimate import FROM_SPEED, USABLE_STATUSES
from hcm.model import Scene
from hcm.results.result import OtherEnd, TapResult
from hcm.results.status import Status
from hcm.workload import most_steps

THRESHOLD_SHARE, ERROR_FACTOR = 1e-4, 4.0
# Largest number of open ends that are solved, the nearest first.
MOST_ENDS = 2
NUMBERS = (*FROM_SPEED, "peak_stress_R_Pa")
OPEN = (
    "the first tap may end after {:.4g} us or after {:.4g} us: the rule that separates touches"
    " nearly decided otherwise; fix its end with solver.hcm.tap_until, or compare forces"
)
GOES_ON = (
    "the first tap may end after {:.4g} us or last beyond {:.4g} us: the rule that separates"
    " touches nearly decided otherwise; fix its end with solver.hcm.tap_until"
)
UNKNOWN = (
    "the first tap may end after {:.4g} us or include the touches up to {:.4g} us, but a run"
    " with those ended as {}: fix its end with solver.hcm.tap_until"
)


def open_ends(result: TapResult) -> tuple[OtherEnd, ...]:
    """Open ends of a completed run, nearest first; none if its duration errs by over a tenth."""
    lasts, error = result.summary.contact_duration_s, result.errors.get("contact_duration_s")
    if lasts is None or not isinstance(error, float) or error > 0.1 * lasts:
        return ()
    if result.given["settings"].tap_until > 0.0:
        return ()
    within = ERROR_FACTOR * error
    near = [e for e in result.other_ends if e.apart_s <= THRESHOLD_SHARE * e.threshold_s + within]
    return tuple(sorted(near, key=lambda end: end.apart_s)[:MOST_ENDS])


def with_other_ends(result: TapResult, again: Callable[[Scene], TapResult]) -> TapResult:
    """Extend the errors to the tap's open ends, and add a caution for each end.

    An error is inf if that end's run has no whole tap or its tap goes on. If a run is interrupted,
    so is the result. again : solves a scene.
    """
    found, doubts = dict(result.errors), list[str]()
    for end in open_ends(result):
        other = again(held_touches(result, end.until_s))
        if other.status is Status.INTERRUPTED:
            return result.as_ended()
        # after touches that it nearly counted in, the rule itself may go on
        further = end.until_s > (result.summary.contact_duration_s or 0.0) and other.other_ends
        known = other.status in USABLE_STATUSES and not further
        for name in NUMBERS:
            own, its = getattr(result.summary, name), getattr(other.summary, name)
            apart = abs(own - its) if known and its is not None else math.inf
            error = found[name]
            assert isinstance(error, float)
            found[name] = max(error, apart)
        ends = [1e6 * (s.contact_duration_s or 0.0) for s in (result.summary, other.summary)]
        text = (OPEN if known else GOES_ON).format(*ends)
        if other.status not in USABLE_STATUSES:
            text = UNKNOWN.format(ends[0], 1e6 * end.until_s, other.status.value)
        doubts.append(text)
    return replace(result, errors=found, cautions=(*result.cautions, *doubts))


def held_touches(result: TapResult, until_s: float) -> Scene:
    """The scene of a run, for its first tap alone, of these touches."""
    scene = Scene(**result.given)
    most = scene.settings.max_steps
    settings = repetition_settings(
        scene.settings,
        result,
        tap_until=until_s,
        # another end may take more than the run had
        max_steps=max(most, min(4 * most, most_steps(scene.finger))),
    )
    return replace(scene, settings=settings)
