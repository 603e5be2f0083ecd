"""What a run says about a claim, and readings that several claims share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from validation.paper.stored_cases import CaseRun
from validation.record import RunRecord

Runs = Mapping[str, CaseRun]
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Finding:
    """Our value for a claim.

    value : in the claim's unit; True or False for a state; None where there is no run to read.
    reason : where it comes from, and what experiments say where it differs.
    contradiction : the arithmetic that shows the paper against itself, empty if it does not.
    """

    value: float | bool | None
    reason: str = ""
    contradiction: str = ""


def scalar(runs: Runs, case: str, key: str) -> float:
    """One of a run's scalars.

    Raises
    ------
    KeyError
        The case has not run or has no such value.
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
    """T - t_c (s) and one history over the first tap."""
    start, end = window(run.record)
    time = run.record.history["time_s"]
    inside = (time >= start) & (time <= end)
    return time[inside] - start, run.record.history[name][inside]


def largest_stress(run: CaseRun) -> float:
    """Maximum of sigma_R over the first tap, Pa: tension is positive, as in the paper's figures."""
    return float(curve(run, "stress_R_Pa")[1].max())


def peaks_above(run: CaseRun, share: float) -> int:
    """Number of peaks of Fn that stand out by at least ``share`` of the largest force."""
    from scipy.signal import find_peaks

    _, force = curve(run, "normal_force_N")
    return len(find_peaks(force, prominence=share * float(force.max()))[0])


def slips(run: CaseRun) -> list[int]:
    """Directions of the slip phases in order: +1 to the right, -1 to the left."""
    _, mode = curve(run, "mode")
    _, velocity = curve(run, "particle_velocity_m_per_s")
    slipping = (mode % 3 == 2) & (velocity != 0)
    directions: list[int] = []
    previous = False
    for here, v in zip(slipping, np.sign(velocity), strict=True):
        if here and (not previous or directions[-1] != int(v)):
            directions.append(int(v))
        previous = bool(here)
    return directions


def sticks(run: CaseRun) -> bool:
    """Whether the tip sticks at any moment of the first tap."""
    return bool(np.any(curve(run, "mode")[1] % 3 == 1))


def transitions(run: CaseRun) -> int:
    """Number of transitions from compression to restitution in the first tap."""
    return int(run.record.summary["compression_to_restitution"])
