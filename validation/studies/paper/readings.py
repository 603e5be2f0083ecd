"""Readings of a run over its first tap: forces, phases, stresses, the tip's deflection."""

from collections.abc import Mapping

import numpy as np

from hcm import Posture
from hcm.arrays import Floats
from validation.harness.record import RunRecord
from validation.studies.paper.case_runs import CaseRun

CaseRuns = Mapping[str, CaseRun]

# The paper counts transitions in its figures. A swing of Fn below this share of its peak, or a
# phase shorter than this share of the contact, is thinner than a printed line: it is located, but
# not counted.
VISIBLE = 0.005


def scalar(runs: CaseRuns, case: str, key: str) -> float:
    """One of a run's scalars.

    Raises KeyError: the case has not run or has no such value.
    """
    value = runs[case].record.value(key)
    if value is None:
        raise KeyError(f"{case}: {key}")
    return value


def event_times(run: CaseRun, kind: str) -> list[float]:
    """Times of the first tap's events of one kind after first contact, s."""
    start, end = window(run.record)
    return [e.time_s - start for e in run.record.events
            if e.kind == kind and start <= e.time_s <= end]  # fmt: skip


def window(record: RunRecord) -> tuple[float, float]:
    """First contact and the separation that ends the first tap, s."""
    start = record.value("contact_time_s")
    if start is None:
        raise KeyError(f"{record.variant}: no contact")
    duration = record.value("contact_duration_s")
    return start, start + duration if duration is not None else float("inf")


def curve(run: CaseRun, name: str) -> tuple[Floats, Floats]:
    """Time t - t_c (s) and one history over the first tap."""
    start, end = window(run.record)
    time = run.record.history["time_s"]
    inside = (time >= start) & (time <= end)
    return time[inside] - start, run.record.history[name][inside]


def particle_velocity(run: CaseRun) -> tuple[Floats, Floats]:
    """Time t - t_c (s) and V_P (m/s) in contact, without separation, where the row is in flight."""
    time, velocity = curve(run, "particle_velocity_m_per_s")
    touching = curve(run, "mode")[1] >= 3
    return time[touching], velocity[touching]


def largest_stress(run: CaseRun) -> float:
    """Maximum of sigma_R over the first tap, Pa: tension is positive, as in the paper's figures."""
    return float(curve(run, "stress_R_Pa")[1].max())


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
    return [s for i, s in enumerate(kept) if i == 0 or s != kept[i - 1]]


def slips(run: CaseRun) -> list[int]:
    """Directions of the slip phases in order: +1 to the right, -1 to the left."""
    return [s for s in phases(run) if s != 0]


def slip_to_stick(run: CaseRun, share: float = VISIBLE) -> int:
    """Number of stick phases that follow a slip."""
    found = phases(run, share)
    return sum(here == 0 for here in found[1:])


def sticks(run: CaseRun) -> bool:
    """Whether the tip sticks at any moment of the first tap."""
    return bool(np.any(curve(run, "mode")[1] % 3 == 1))


def deflection(posture: Posture) -> float:
    """Size of the tip's deflection (fig. 15), m, from the first node's tangent."""
    return abs(float(posture.deflection(2)[1][-1]))


def most_bent(run: CaseRun, drawn: bool) -> Posture:
    """Posture of the first tap with the largest deflection of the tip.

    drawn : search only postures at the tap's events, which fig. 15 draws; else all that are kept.
    """
    start, end = window(run.record)
    several = run.event_postures if drawn else (*run.event_postures, *run.frames)
    return max((p for p in several if start <= p.time_s <= end), key=deflection)


def largest_deflection(run: CaseRun, drawn: bool = False) -> float:
    """Largest deflection of the tip during the contact, m."""
    return deflection(most_bent(run, drawn))


def share_of_largest_deflection(run: CaseRun) -> float:
    """Time of the tip's largest deflection, as a share of the contact."""
    start, end = window(run.record)
    return (most_bent(run, drawn=False).time_s - start) / (end - start)


def deflection_peaks_after_first_restitution(run: CaseRun) -> bool:
    """Whether the deflection that fig. 15 draws is largest at the end of the first restitution.

    Restitutions that last less than 5 % of the contact are ignored as ripples.
    """
    ends = [e.time_s for e in run.record.events
            if e.kind in ("restitution_to_compression", "separation")]  # fmt: skip
    largest = most_bent(run, drawn=True).time_s
    turn = event_times(run, "compression_to_restitution")[0]
    start, end = window(run.record)
    later = [e for e in ends if e - start - turn > 0.05 * (end - start)]
    return bool(later) and abs(largest - later[0]) < 0.05 * (end - start)
