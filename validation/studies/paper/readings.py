"""Readings of a run over its first tap, and how figs. 13 to 16 are read from the driven cases."""

from collections.abc import Callable, Mapping
from functools import partial
from itertools import groupby
from typing import Any

import numpy as np

from hcm import Posture
from hcm.arrays import Floats
from validation.studies.paper.case_runs import CaseRun
from validation.studies.paper.cases import PRINTED_TORQUES

CaseRuns = Mapping[str, CaseRun]
Reading = Callable[[CaseRuns, str], Any]  # of cases whose names end in the text
ONE, TWO, THREE = PRINTED_TORQUES

# The paper counts transitions in its figures. A swing of Fn below this share of its peak, or a
# phase shorter than this share of the contact, is thinner than a printed line: it is located, but
# not counted.
VISIBLE = 0.005
PEAK_SHARE = 0.05  # of the largest force, by which a peak of fig. 15 stands out


def scalar(run: CaseRun, key: str) -> float:
    """One of a run's scalars.

    Raises KeyError: the run has no such value.
    """
    value = run.record.value(key)
    if value is None:
        raise KeyError(f"{run.case.name}: {key}")
    return value


def event_times(run: CaseRun, kind: str) -> list[float]:
    """Times of the first tap's events of one kind after first contact, s."""
    start, end = window(run)
    return [e.time_s - start for e in run.record.events
            if e.kind == kind and start <= e.time_s <= end]  # fmt: skip


def window(run: CaseRun) -> tuple[float, float]:
    """First contact and the separation that ends the first tap, s; infinite if it does not end."""
    start, duration = scalar(run, "contact_time_s"), run.record.value("contact_duration_s")
    return start, float("inf") if duration is None else start + duration


def duration_ms(run: CaseRun) -> float:
    """Duration of the first tap, ms; nan if it does not end."""
    return 1e3 * (run.record.value("contact_duration_s") or float("nan"))


def curve(run: CaseRun, name: str) -> tuple[Floats, Floats]:
    """Time t - t_c (s) and one history over the first tap."""
    start, end = window(run)
    time = run.record.history["time_s"]
    inside = (time >= start) & (time <= end)
    return time[inside] - start, run.record.history[name][inside]


def particle_velocity(run: CaseRun) -> tuple[Floats, Floats]:
    """Time t - t_c (s) and V_P (m/s) in contact, without separation, where the row is in flight."""
    time, velocity = curve(run, "particle_velocity_m_per_s")
    touching = curve(run, "mode")[1] >= 3
    return time[touching], velocity[touching]


def largest_stress_MPa(run: CaseRun) -> float:
    """Maximum of sigma_R over the first tap: tension is positive, as in the paper's figures."""
    return 1e-6 * float(curve(run, "stress_R_Pa")[1].max())


def transitions(run: CaseRun, share: float = VISIBLE) -> int:
    """Transitions from compression to restitution in the first tap that a figure can show.

    They are peaks of Fn that stand out by at least ``share`` of the largest force.
    """
    from scipy.signal import find_peaks

    _, force = curve(run, "normal_force_N")
    ended = np.concatenate([[0.0], force, [0.0]])
    return len(find_peaks(ended, prominence=share * float(force.max()))[0])


def located(run: CaseRun) -> int:
    """All transitions from compression to restitution in the first tap."""
    return int(run.record.summary["compression_to_restitution"])


def counting(run: CaseRun) -> str:
    """The numbers of transitions at other thresholds than VISIBLE, as text."""
    counts = ", ".join(f"{transitions(run, share)}" for share in (0.001, 0.01, 0.02, 0.05))
    return (
        f"counted are those after which Fn falls by more than {100 * VISIBLE:g} % of its peak;"
        f" beyond 0.1, 1, 2, 5 %: {counts}; located in all: {located(run)}"
    )


def phases(run: CaseRun, share: float = VISIBLE) -> list[int]:
    """Tangential phases in order: +1 slip to the right, -1 to the left, 0 stick.

    Those shorter than ``share`` of the contact are left out, and equal ones beside them joined.
    """
    time, mode = curve(run, "mode")
    _, velocity = curve(run, "particle_velocity_m_per_s")
    state = np.where(mode % 3 == 2, np.sign(velocity), 0).astype(int)
    starts = np.flatnonzero(np.diff(state, prepend=state[0] + 9))
    lengths = np.diff(np.append(time[starts], time[-1]))
    kept = [int(state[i]) for i, lasts in zip(starts, lengths, strict=True)
            if lasts > share * time[-1]]  # fmt: skip
    return [phase for phase, _ in groupby(kept)]


def slips(run: CaseRun) -> list[int]:
    """Directions of the slip phases in order: +1 to the right, -1 to the left."""
    return [s for s in phases(run) if s != 0]


def slip_to_stick(run: CaseRun, share: float = VISIBLE) -> int:
    """Number of stick phases that follow a slip."""
    found = phases(run, share)
    return sum(here == 0 for here in found[1:])


def slides(run: CaseRun) -> bool:
    """Whether the tip never sticks in the first tap."""
    return not np.any(curve(run, "mode")[1] % 3 == 1)


def deflection(posture: Posture) -> float:
    """Size of the tip's deflection (fig. 15), m, from the first node's tangent."""
    return abs(float(posture.deflection(2)[1][-1]))


def drawn_postures(run: CaseRun) -> list[Posture]:
    """Postures that fig. 15 draws: at contact, separation, and the reversals between peaks of Fn.

    A peak stands out by at least `PEAK_SHARE` of the largest force; smaller ones are ripples.
    """
    from scipy.signal import find_peaks

    time, force = curve(run, "normal_force_N")
    least = PEAK_SHARE * float(force.max())
    turns = [time[find_peaks(side, prominence=least)[0]] for side in (force, -force)]
    wanted = window(run)[0] + np.sort(np.concatenate([[0.0, time[-1]], *turns]))
    instants = np.array([posture.time_s for posture in run.event_postures])
    return [run.event_postures[int(np.abs(instants - t).argmin())] for t in wanted]


def most_bent(run: CaseRun, at_events: bool) -> Posture:
    """Posture of the first tap with the largest deflection of the tip.

    at_events : search only postures at the tap's events; else all that are kept.
    """
    start, end = window(run)
    several = run.event_postures if at_events else (*run.event_postures, *run.frames)
    return max((p for p in several if start <= p.time_s <= end), key=deflection)


def largest_deflection(run: CaseRun) -> float:
    """Largest deflection of the tip during the contact, m."""
    return deflection(most_bent(run, at_events=False))


def drawn_deflection(run: CaseRun) -> float:
    """Largest deflection of the tip that fig. 15 draws, m."""
    return max(map(deflection, drawn_postures(run)))


def share_of_largest_deflection(run: CaseRun) -> float:
    """Time of the tip's largest deflection, as a share of the contact."""
    start, end = window(run)
    return (most_bent(run, at_events=False).time_s - start) / (end - start)


def deflection_peaks_after_first_restitution(run: CaseRun) -> bool:
    """Whether the deflection at an event is largest at the end of the first restitution.

    Restitutions that last less than 5 % of the contact are ignored as ripples.
    """
    start, end = window(run)
    turn = event_times(run, "compression_to_restitution")[0]
    ripple = 0.05 * (end - start)
    ends = [
        e.time_s
        for e in run.record.events
        if e.kind in ("restitution_to_compression", "separation")
        and e.time_s - start - turn > ripple
    ]
    return bool(ends) and abs(most_bent(run, at_events=True).time_s - ends[0]) < ripple


def first_peak(run: CaseRun) -> float:
    """First peak of F_n, N."""
    return run.record.value("first_peak_normal_force_N") or float("nan")


def first_tangential_peak(run: CaseRun) -> float:
    """Largest |F_t| up to the first restitution, N."""
    time, force = curve(run, "tangential_force_N")
    turn = event_times(run, "compression_to_restitution")[0]
    return float(np.abs(force[time <= turn]).max())


def changes_sign(run: CaseRun) -> bool:
    """Whether F_t is on both sides of zero."""
    _, force = curve(run, "tangential_force_N")
    return bool(force.min() < 0 < force.max())


def concave(run: CaseRun) -> bool:
    """Whether the hinges lie below the line from the fixed hinge to the tip at contact."""
    return run.event_postures[0].is_concave


def reading_of(case: str, read: Callable[[CaseRun], Any]) -> Reading:
    """A case's reading."""
    return lambda runs, suffix: read(runs[case + suffix])


def over_case_1(case: str, read: Callable[[CaseRun], Any]) -> Reading:
    """A case's reading over that of case 1."""
    return lambda runs, suffix: read(runs[case + suffix]) / read(runs[ONE + suffix])


_ARRIVAL = partial(scalar, key="contact_time_s")
READINGS: dict[str, Reading] = {  # in the order in which ramp_experiment.json lists them
    "F13.1": reading_of(ONE, _ARRIVAL),
    "F13.2": reading_of(TWO, _ARRIVAL),
    "F13.3": reading_of(THREE, _ARRIVAL),
    "F13.4": reading_of(ONE, concave),
    "F13.5": reading_of(TWO, concave),
    "F13.6": reading_of(THREE, lambda run: not concave(run)),
    "F14.1": over_case_1(TWO, first_peak),
    "F14.2": over_case_1(TWO, first_tangential_peak),
    "F15.1": over_case_1(TWO, largest_deflection),
    "F15.2": over_case_1(THREE, largest_deflection),
    "F14.3": reading_of(THREE, transitions),
    "F14.4": reading_of(THREE, changes_sign),
    "F14.5": reading_of(ONE, largest_stress_MPa),
    "F14.6": reading_of(TWO, largest_stress_MPa),
    "F14.7": reading_of(THREE, largest_stress_MPa),
    "F15.3": lambda runs, suffix: all(
        deflection_peaks_after_first_restitution(runs[case + suffix]) for case in PRINTED_TORQUES
    ),
    "F16.1": reading_of(ONE, slides),
    "F16.2": reading_of(TWO, slides),
    "F16.3": reading_of(THREE, slip_to_stick),
    "F16.4": reading_of(THREE, lambda run: slips(run)[:4] == [1, -1, 1, -1]),
}


def driven_values(runs: CaseRuns) -> dict[str, float | bool]:
    """Values by claim, from the cases that `runs` holds under the scenes' names."""
    return {id_: read(runs, "") for id_, read in READINGS.items()}
