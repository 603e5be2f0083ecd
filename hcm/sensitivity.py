"""Whether a tap would come out the same again: folded fingers and taps that barely end.

A chain that swings through itself multiplies every error by e^(Lambda t), those of its own steps
included: a run may complete, keep its energy and be nothing like the motion. What a map of torques
shows is that such a chain's tip has first come close to the fixed hinge; a finger on its way to the
surface stays stretched. So only a run whose tip has come closer than `FOLDED` of the finger's
length is repeated at `COARSER` tolerances, and says so when its first tap depends on them. In a
motion that converges the coarser run is COARSER^(2/3) times as wrong as the run itself; in one that
doesn't, two runs may agree by chance, so a `TIGHTER` one must agree as well.

A tap that *grazes* ends, or nearly ended before it went on, with a tip that hardly moves away: an
error of the size of `GRAZE` decides whether it is over or whether half of its impulse is to come. A
coarser run may well agree with it in error, so it is repeated with tighter tolerances.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from hcm.arrays import Floats
from hcm.compiled import kernel
from hcm.parameters import Finger, Settings
from hcm.result import Event, History, Status, Summary, TapResult
from hcm.workload import most_steps

FOLDED = 0.5
COARSER, TIGHTER = 10.0, 0.1
# Share of the peak F_n at which the tip turned back, and of the speed of approach at which it left.
GRAZE = 0.01
# Largest relative change of the first tap's numbers that a repetition may show.
LARGEST_CHANGE = 0.01


@kernel
def smallest_square(time: Floats, tip: Floats, end: float) -> float:
    """Smallest |x|^2 of the tip's positions (m, 2) up to time `end`."""
    smallest = np.inf
    for i in range(time.size):
        if time[i] > end:
            break
        smallest = min(smallest, tip[i, 0] * tip[i, 0] + tip[i, 1] * tip[i, 1])
    return smallest


def folded(history: History, summary: Summary, length: float) -> bool:
    """Whether the tip came close to the fixed hinge before the first contact."""
    if summary.contact_time_s is None:
        return False
    near = smallest_square(history.time_s, history.tip_position_m, summary.contact_time_s)
    return bool(near < (FOLDED * length) ** 2)


def grazes(history: History, events: tuple[Event, ...], summary: Summary) -> bool:
    """Whether the first tap barely ended, or barely did not."""
    if summary.contact_time_s is None or summary.tip_velocity_at_contact_m_per_s is None:
        return False
    slow = GRAZE * abs(summary.tip_velocity_at_contact_m_per_s[1])
    weak = GRAZE * (summary.peak_normal_force_N or 0.0)
    for event in events:
        left, turned_back = event.kind == "separation", event.kind == "restitution_to_compression"
        if event.time_s < summary.contact_time_s or not (left or turned_back):
            continue
        row = int(history.time_s.searchsorted(event.time_s, side="right")) - 1
        if left:
            return float(history.tip_velocity_m_per_s[row, 1]) < slow
        if float(history.normal_force_N[row]) < weak:
            return True
    return False


def tolerance_factors(
    history: History, events: tuple[Event, ...], summary: Summary, length: float
) -> tuple[float, ...]:
    """Factors of the tolerances at which a run is to be repeated; none if it need not be."""
    if folded(history, summary, length):
        return (COARSER, TIGHTER)
    return (TIGHTER,) if grazes(history, events, summary) else ()


def repetition_settings(settings: Settings, factor: float, own: Summary, most: int) -> Settings:
    """Settings of the repetition: one tap, tolerances times `factor`, not repeated itself.

    Steps that no tolerance bounds are changed as its third root would: the error's order is 2.
    A first tap that an end time cut short is repeated as far as that and a little further, for it
    may come later; any other gets at least the flight that it took in the run itself (`own`), where
    an end time lifts the limit. At most `most` steps are asked for, so that a completed run is
    never refused for its repetition's sake.
    """
    end_time = None
    if settings.end_time is not None and own.contact_duration_s is None:
        end_time = settings.end_time * (1.0 + LARGEST_CHANGE)
    steps = factor ** (1 / 3)
    more_steps = max(settings.max_steps, min(4 * settings.max_steps, most))
    return replace(
        settings,
        flight_step=settings.flight_step * (1.0 if settings.flight_tolerance else steps),
        contact_step=settings.contact_step * (1.0 if settings.contact_tolerance else steps),
        flight_tolerance=factor * settings.flight_tolerance,
        contact_tolerance=factor * settings.contact_tolerance,
        max_steps=settings.max_steps if factor > 1 else more_steps,
        max_flight_time=max(settings.max_flight_time, 2.0 * (own.contact_time_s or 0.0)),
        taps=1,
        end_time=end_time,
        frame_times=(),
        repeat=False,
    )


def largest_change(own: Summary, other: TapResult) -> tuple[str, float]:
    """The number of the first tap that changes most, and by which share; inf without a tap.

    Of a tap that an end time cut short only the arrival counts: what of its force falls before a
    given time changes with any delay.
    """
    if (
        other.status is not Status.COMPLETED
        or other.summary.tip_velocity_at_contact_m_per_s is None
    ):
        ending = other.status if other.status is not Status.COMPLETED else Status.NOT_REACHED
        return f"the tap ({ending.value} then)", float("inf")
    assert own.tip_velocity_at_contact_m_per_s is not None
    velocity = np.array(own.tip_velocity_at_contact_m_per_s)
    apart = float(np.abs(velocity - other.summary.tip_velocity_at_contact_m_per_s).max())
    changes = {"the velocity at contact": apart / max(abs(float(velocity[1])), 1e-300)}
    compared = [("contact_time_s", "the time of contact")]
    if own.contact_duration_s is not None:
        compared += [
            ("peak_normal_force_N", "the peak normal force"),
            ("normal_impulse_N_s", "the normal impulse"),
        ]
    for name, words in compared:
        a, b = getattr(own, name), getattr(other.summary, name)
        changes[words] = abs(b - a) / max(abs(a), 1e-300)
    largest = max(changes, key=lambda words: changes[words])
    return largest, changes[largest]


def compare_repetitions(
    simulate: Callable[[Settings], TapResult], finger: Finger, settings: Settings,
    history: History, events: tuple[Event, ...], summary: Summary,
) -> tuple[Status, str]:  # fmt: skip
    """COMPLETED, or why a completed run can't be relied on, with what changes.

    simulate : runs the same scene with other settings.
    """
    for factor in tolerance_factors(history, events, summary, finger.length):
        other = simulate(repetition_settings(settings, factor, summary, most_steps(finger)))
        if other.status is Status.INTERRUPTED:
            return Status.INTERRUPTED, " while it was repeated"
        what, share = largest_change(summary, other)
        if share > LARGEST_CHANGE:
            by = f" by {100 * share:.2g} %" if share < math.inf else ""
            return Status.UNREPEATABLE, f"; {factor:g} times the tolerances change {what}{by}"
    return Status.COMPLETED, ""
