"""Which touches are one tap, and when it ends.

A tip that has just left may come down again on the same swing of its finger. With `whole_tap` the
tap is over once the tip has stayed away for

    max(0.1 (t_s - t_0), 0.25 L/c),  c = sqrt(E/rho),

and the last phalanx, as a rigid body, will not touch within 2 max(t_s - t_0, L/c): t_0 the first
touch, t_s the last separation, L/c the time of an axial wave along the phalanx. The finite elements
end their taps likewise. With `Settings.tap_until` the touches that begin within that time of t_0
are the tap, whatever the rule says. Without `whole_tap` each separation ends one, as in the paper.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from hcm.arrays import Floats
from hcm.assumptions import Assumptions
from hcm.parameters import Finger
from hcm.results.result import Event, OtherEnd

SEPARATION_SHARE, SEPARATION_TRANSITS, SAME_TAP = 0.1, 0.25, 2.0
# A tap fades out if F_n stays below the first share of its peak for longer than the second share of
# the tap: such durations differ by more than 2 % in the study.
SLIGHT, LONG = 0.01, 0.03
# The models' durations agree to the first share in all but four of the study's scenes; a stress
# that changes within it by more than the second share is no better known than that.
SURE, STEEP = 0.02, 0.05
# time over L/c between two checks of a tip that is about to come back
CHECK_INTERVAL = 0.1

Tap = tuple[float, float]
"""First touch and last separation, s; inf if it has not ended."""


@dataclass(frozen=True)
class TapEndRule:
    """The rule that ends taps. transit : L/c, s. until : `Settings.tap_until`, s."""

    transit: float
    until: float = 0.0

    def first_check_s(self, tap: Tap) -> float:
        """When a tap is first checked, s: until then the tip must have stayed away."""
        if self.until > 0.0:
            return max(tap[1], tap[0] + self.until)
        lasted = tap[1] - tap[0]
        return tap[1] + max(SEPARATION_SHARE * lasted, SEPARATION_TRANSITS * self.transit)

    def retouch_window_s(self, tap: Tap) -> float:
        """How soon after a check the next touch must come to belong to the same tap, s."""
        return SAME_TAP * max(tap[1] - tap[0], self.transit)

    def next_check_s(self, tap: Tap, now_s: float, touch_in_s: float) -> float:
        """When to check again, s; inf if the tap is over. touch_in_s : from `next_touch_s`."""
        over = self.until > 0.0 or touch_in_s > self.retouch_window_s(tap)
        return math.inf if over else now_s + CHECK_INTERVAL * self.transit

    def near_ends_when_checked(
        self, tap: Tap, now_s: float, touch_in_s: float, tip_in_s: float
    ) -> list[OtherEnd]:
        """Other ends that the tap nearly had when it was checked.

        tip_in_s : time until the tip itself touches at its present speed, vibration included, s. A
        touch just after the check that ended the tap would have belonged to it a little earlier.
        """
        if self.until > 0.0:
            return []
        window, since = self.retouch_window_s(tap), now_s - tap[0]
        wait = self.first_check_s(tap) - tap[1]
        if touch_in_s <= window:
            ends = [OtherEnd(tap[1] - tap[0], window - touch_in_s, window)]
        else:  # the tip may slow down on its way: assume a touch within twice that time
            times = (touch_in_s, touch_in_s - window, window), (tip_in_s, tip_in_s, wait)
            ends = [OtherEnd(since + 2.0 * t + wait, apart, of) for t, apart, of in times]
        return [end for end in ends if end.apart_s < math.inf]


def tap_ends(finger: Finger, assumptions: Assumptions, until: float) -> TapEndRule | None:
    """The rule that ends a finger's taps; None if every separation ends one."""
    if not assumptions.has("whole_tap"):
        return None
    last = finger.phalanges[-1]
    return TapEndRule(last.length * math.sqrt(last.density / last.youngs_modulus), until)


def taps_of(events: Iterable[Event], over_s: Sequence[float] | None) -> tuple[Tap, ...]:
    """The taps of a run.

    over_s : times at which taps were found to be over, s; None: each separation ends one.
    """
    taps: list[Tap] = []
    for event in events:
        if event.kind == "contact":
            now = event.time_s
            ended = not taps or over_s is None or any(taps[-1][1] <= at <= now for at in over_s)
            taps.append((now if ended else taps.pop()[0], math.inf))
        elif event.kind == "separation":
            taps[-1] = (taps[-1][0], event.time_s)
    return tuple(taps)


def near_ends_when_touched_again(
    rule: TapEndRule, events: Sequence[Event], tap: Tap, touch_in_s: Callable[[int], float]
) -> list[OtherEnd]:
    """Other ends that a tap nearly had when its tip touched again before it was checked; one at
    infinity if the touches are given (`until`) and the rule would go on after them.

    touch_in_s : `next_touch_s` at the event of that number
    """
    ends = []
    for number, event in enumerate(events):
        if event.kind != "separation" or event.time_s > tap[1]:
            continue
        so_far = tap[0], event.time_s
        window = rule.retouch_window_s(so_far)
        if event.time_s < tap[1]:
            wait = rule.first_check_s(so_far) - event.time_s
            early = wait - (events[number + 1].time_s - event.time_s)
            if rule.until == 0.0 and early >= 0.0 and touch_in_s(number + 1) > window:
                ends.append(OtherEnd(event.time_s - tap[0], early, wait))
        elif rule.until > 0.0 and touch_in_s(number) <= window:
            ends.append(OtherEnd(math.inf, 0.0, window))
    return ends


def nearest(ends: Iterable[OtherEnd]) -> tuple[OtherEnd, ...]:
    """Keep the nearest of several ends with the same touches; sort by nearness."""
    kept: dict[float, OtherEnd] = {}
    for end in sorted(ends, key=lambda end: end.apart_s):
        kept.setdefault(end.until_s, end)
    return tuple(kept.values())


def ends_undecided(tap: Tap, over_s: Iterable[float]) -> tuple[str, ...]:
    """Caution about a tap that ended, if its run did before the rule found it over.

    over_s : times at which taps were found to be over, s.
    """
    if tap[1] == math.inf or any(at >= tap[1] for at in over_s):
        return ()
    return (
        "solver.hcm.end_time comes before the first tap is known to be over: a touch that soon"
        " follows would belong to it, and its numbers would be others; raise end_time",
    )


def bends_back(
    rule: TapEndRule, taps: Sequence[Tap], over_s: Iterable[float], now_s: float,
    bent_touches: Callable[[float], bool],
) -> tuple[str, ...]:  # fmt: skip
    """Caution about a tip whose bending brings it back as soon as a touch of the same tap.

    over_s : times at which taps were found to be over, s. now_s : end of the run, s. bent_touches :
    whether it touches within a time from then, s.
    """
    tap, until = taps[0], rule.first_check_s(taps[0]) + rule.retouch_window_s(taps[0])
    if rule.until > 0.0 or not any(at >= tap[1] for at in over_s):
        return ()
    if len(taps) > 1:
        soon, wait = taps[1][0] <= until, taps[1][0] - tap[1]
        what = f"touches again {1e3 * wait:.2g} ms after"
    else:
        soon = now_s < until and bent_touches(until - now_s)
        what = f"bends, and may touch again within {1e3 * (until - tap[1]):.2g} ms of"
    if not soon:
        return ()
    unit = 10.0 ** (math.floor(math.log10(until - tap[0])) - 1)
    return (
        f"the last phalanx {what} the tap; that counts as another tap, as a rigid one would stay"
        f" away: solver.hcm.tap_until = {math.ceil((until - tap[0]) / unit) * unit:.2g} adds it to"
        " the first",
    )


def slow_end(time: Floats, force: Floats, tap: Tap) -> tuple[str, ...]:
    """Caution about a tap that fades out, so that a small force decides its duration. s, N."""
    during = (time >= tap[0]) & (time <= tap[1])
    felt = time[during & (force > SLIGHT * force[during].max(initial=0.0))]
    ended = felt.size > 0 and tap[1] < math.inf
    share = (tap[1] - felt[-1]) / (tap[1] - tap[0]) if ended else 0.0
    if not share > LONG:
        return ()
    return (
        f"the tap fades out: for the last {100 * share:.2g} % of contact_duration_s it pushes with"
        f" less than {100 * SLIGHT:g} % of its peak, and another model may end it that much sooner"
        " or later; compare forces or impulses",
    )


def rising_stress(time: Floats, stress: Floats, tap: Tap) -> tuple[str, ...]:
    """Caution about a stress that is largest as the tap ends and still rises. s, Pa."""
    during = (time >= tap[0]) & (time <= tap[1])
    if not during.any() or tap[1] == math.inf:
        return ()
    size = np.abs(stress[during])
    before = float(np.interp(tap[1] - SURE * (tap[1] - tap[0]), time[during], size))
    if size[-1] < size.max() or not size[-1] - before > STEEP * size[-1]:
        return ()
    return (
        f"the stress at R is largest as the tap ends, where it rises by"
        f" {100 * (1 - before / size[-1]):.2g} % in the last {100 * SURE:g} % of"
        " contact_duration_s, and another model may end the tap that much sooner or later:"
        " compare curves",
    )
