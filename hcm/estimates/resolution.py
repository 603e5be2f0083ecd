"""Judge from a completed run itself whether its first tap is whole and resolved.

A tip that swings at omega is integrated with a time scale that is wrong by (omega h)^2/12 (the
trapezoidal rule; 1.04 times that at the default xi), by (s!)^2/((2s)! (2s + 1)!) (omega h)^(2s) in
collocation by s stages. Two estimates of omega h:

- the second difference of F_n over three rows, over the peak, is (omega h)^2 for a half sine.
  Collocation has rows at its stages, at least h/(s + 1) apart where they are furthest;
- a phase of n steps between two reversals of v_n, or two changes between stick and slip, is half a
  swing: omega h = pi/n. A phase of too few steps may be spurious, or hide others. Collocation takes
  a phase in one step, with an error of 0.0095 with 3 stages, of 1e-5 with 5.
"""

import math
from itertools import pairwise

import numpy as np

from hcm.arrays import Floats
from hcm.compiled import entry_with
from hcm.parameters import GAUSS, Settings
from hcm.results.result import Event, History, Summary
from hcm.results.status import Status

# A step counts as at most this many times the one beside it. F_n may jump within a step that an
# event cuts short, as another law begins (refined, with restitution: by 0.2 to 2 %), and h^2 |F''|
# would contain the jump times twice the ratio of the steps, which has no bound.
LONGER = 2.0
# Errors beyond which a run carries a caution (of the time scale here, of any number in
# `hcm.estimates.estimate`), and beyond which its time scale has it rejected.
CAUTION_ERROR, LARGEST_TIME_ERROR = 0.01, 0.1
# Steps of a phase whose error is `CAUTION_ERROR`.
LEAST_PHASE_STEPS = math.pi / math.sqrt(12 * CAUTION_ERROR)
# Least stages with which a phase of a single step has a smaller error.
LEAST_STAGES = 3
REVERSALS = ("compression_to_restitution", "restitution_to_compression")
CHANGES = ("stick_to_slip", "slip_to_stick")


@entry_with()
def second_difference(time: Floats, force: Floats, first: int, end: int) -> float:
    """Largest h h_l |F''| in rows [first, end), over the peak; h_l is the longer of two steps, h
    the same but at most `LONGER` times the other.

    Infinite for fewer than three different times, or if F_n is nowhere positive.
    """
    largest, peak, before, middle = math.inf, 0.0, -1, -1
    for i in range(first, end):
        peak = max(peak, force[i])
        if middle >= 0 and time[i] <= time[middle]:
            middle = i
            continue
        if before >= 0:
            left, right = time[middle] - time[before], time[i] - time[middle]
            bend = (force[i] - force[middle]) / right - (force[middle] - force[before]) / left
            longer = min(max(left, right), LONGER * min(left, right))
            difference = 2.0 * longer * max(left, right) / (left + right) * abs(bend)
            largest = difference if largest == math.inf else max(largest, difference)
        before, middle = middle, i
    return largest / peak if peak > 0.0 else math.inf


def collocation_error(stages: int, swing: float) -> float:
    """Bound on the time scale's error; swing : (omega d)^2 of rows d apart, with h <= (s + 1) d."""
    return ((stages + 1) ** 2 * swing) ** stages / over_phase(stages)


def over_phase(stages: int) -> int:
    """(omega h)^(2s) over the relative error of the phase."""
    return math.comb(2 * stages, stages) * math.factorial(2 * stages + 1)


def short_phases(history: History, events: tuple[Event, ...], kinds: tuple[str, ...]) -> int:
    """Phases between two events of `kinds` that take fewer than `LEAST_PHASE_STEPS` steps."""
    times = [e.time_s for e in events if e.kind in kinds]
    if len(times) < 2:
        return 0
    rows = history.time_s.searchsorted(times)
    return sum(int(b) - int(a) < LEAST_PHASE_STEPS for a, b in pairwise(rows))


def smooth_difference(history: History, events: tuple[Event, ...], first: int, end: int) -> float:
    """`second_difference` without the rows next to an event, where the force of a tip that relaxes
    has a kink, or rises with the root of the time; of the whole tap if events leave no others.
    """
    time, force = history.time_s, history.normal_force_N
    rows = [first, *(int(time.searchsorted(e.time_s)) for e in events), end]
    largest, peak = -math.inf, float(force[first:end].max(initial=0.0))
    for begin, stop in pairwise(sorted(rows)):
        part = slice(begin + 2, stop - 1)
        if np.unique(time[part]).size >= 3:
            swing = second_difference(time, force, part.start, part.stop)
            largest = max(largest, swing * float(force[part].max()) / peak)
    return largest if largest >= 0.0 else second_difference(time, force, first, end)


def judge_steps(
    history: History, events: tuple[Event, ...], summary: Summary, settings: Settings,
    relaxes: bool = False,
) -> tuple[Status, str, tuple[str, ...]]:  # fmt: skip
    """Return COMPLETED or why the first tap is not a result, the details of that, and cautions.

    Only an end time leaves a completed run without a tap, or its first tap without a separation.

    relaxes : whether the tip's material does.
    """
    contact, duration = summary.contact_time_s, summary.contact_duration_s
    if contact is None:
        return Status.COMPLETED, "", ("nothing touches before solver.hcm.end_time: raise it",)
    if duration is None:
        return Status.STILL_IN_CONTACT, "; end_time cuts the first tap", ()
    time, over = history.time_s, contact + duration
    first, end = int(time.searchsorted(contact)), int(time.searchsorted(over, side="right"))
    tap = tuple([e for e in events if contact <= e.time_s <= over])
    if relaxes:
        swing = smooth_difference(history, tap, first, end)
    else:
        swing = second_difference(time, history.normal_force_N, first, end)
    in_one = settings.contact_integrator == GAUSS and settings.stages >= LEAST_STAGES
    error = collocation_error(settings.stages, swing) if in_one else swing / 12
    controlled = settings.contact_tolerance > 0.0
    remedy = f"reduce solver.hcm.contact_{'tolerance' if controlled else 'step'}"
    cautions = []
    if error > CAUTION_ERROR:
        long = (
            f"the first tap takes {end - 1 - first} steps, which leaves an error of about"
            f" {100 * error:.2g} % in its forces and times"
        )
        if error > LARGEST_TIME_ERROR:
            return Status.UNRESOLVED, f"; {long}", ()
        cautions.append(f"{long}; {remedy}")
    for kinds in () if in_one else (REVERSALS, CHANGES):
        if short := short_phases(history, tap, kinds):
            counts = ", ".join(f"{kind} {sum(e.kind == kind for e in tap)}" for kind in kinds)
            cautions.append(
                f"transitions are not resolved ({counts}): {short} of them are fewer than"
                f" {math.ceil(LEAST_PHASE_STEPS)} steps after the one before; {remedy}"
            )
    return Status.COMPLETED, "", tuple(cautions)
