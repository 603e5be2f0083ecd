"""Section 4.3, figs. 13 to 16: the driven cases, with the identified t_3 factor.

The torques act at once on a finger without damping: what follows rings at every frequency that the
mesh holds. Readings that depend on that ringing are given with their band over the factor's
uncertainty (low, high), a coarser mesh, a flight tolerance ten times larger, more numerical
damping, and the paper's own steps (1 ms, from zero acceleration).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from validation.paper.finding import (
    Finding,
    Runs,
    curve,
    event_times,
    largest_stress,
    peaks_above,
    scalar,
    slips,
    sticks,
    transitions,
    window,
)
from validation.paper.stored_cases import CaseRun

if TYPE_CHECKING:
    from hcm import Posture

FIRST = "first_peak_normal_force_N"
VARIED = ("low", "high", "N=15", "tolerance 1 um", "xi=0.5", "paper's steps")
ONE, TWO, THREE = "driven-1", "driven-2", "driven-3"


def first_tap(run: CaseRun) -> list[Posture]:
    """Postures at the events of the first tap."""
    end = window(run.record)[1]
    return [p for p in run.event_postures if p.time_s <= end]


def tip_deflection(run: CaseRun) -> float:
    """Largest deflection of the last phalanx's tip over the first tap's events, m (fig. 15)."""
    return max(abs(float(p.deflection(2)[1][-1])) for p in first_tap(run))


def deflection_peaks_after_first_restitution(run: CaseRun) -> bool:
    """Whether the deflection is largest at the end of the first restitution that matters.

    Reversals that last less than 5 % of the contact are ripples on it.
    """
    ends = [e.time_s for e in run.record.events
            if e.kind in ("restitution_to_compression", "separation")]  # fmt: skip
    largest = max(first_tap(run), key=lambda p: abs(float(p.deflection(2)[1][-1]))).time_s
    turn = event_times(run, "compression_to_restitution")[0]
    start, duration = (run.record.value(k) or 0.0 for k in ("contact_time_s", "contact_duration_s"))
    later = [end for end in ends if end - start - turn > 0.05 * duration]
    return bool(later) and abs(largest - later[0]) < 0.05 * duration


def _varied(runs: Runs, read: Callable[[str], object]) -> str:
    """A reading under each variation, as text; ``read`` takes the case's suffix."""
    parts = []
    for label in VARIED:
        value = read(f" {label}")
        parts.append(f"{label} {value:.4g}" if isinstance(value, float) else f"{label} {value}")
    return "; ".join(parts)


def _ratio(runs: Runs, over: str, key: Callable[[CaseRun], float]) -> Callable[[str], float]:
    return lambda suffix: key(runs[over + suffix]) / key(runs[ONE + suffix])


def _stress(runs: Runs, case: str) -> Callable[[str], float]:
    return lambda suffix: 1e-6 * largest_stress(runs[case + suffix])


def _first_peak(run: CaseRun) -> float:
    return run.record.value(FIRST) or float("nan")


def _first_tangential_peak(run: CaseRun) -> float:
    time, force = curve(run, "tangential_force_N")
    turn = event_times(run, "compression_to_restitution")[0]
    return float(np.abs(force[time <= turn]).max())


def measure(runs: Runs) -> dict[str, Finding]:
    """Findings by claim."""
    rows = {}
    for id_, case in (("F13.1", ONE), ("F13.2", TWO), ("F13.3", THREE)):
        rows[id_] = Finding(
            scalar(runs, case, "contact_time_s"), "the t_3 factor was identified from these times"
        )
    for id_, case, concave in (("F13.4", ONE, True), ("F13.5", TWO, True), ("F13.6", THREE, False)):
        posture = runs[case].event_postures[0]
        rows[id_] = Finding(
            posture.is_concave == concave,
            f"at contact the hinges lie {'below' if posture.is_concave else 'above'}"
            " the line from the fixed hinge to the tip",
        )
    ratios = (
        ("F14.1", TWO, _first_peak), ("F14.2", TWO, _first_tangential_peak),
        ("F15.1", TWO, tip_deflection), ("F15.2", THREE, tip_deflection),
    )  # fmt: skip
    for id_, case, key in ratios:
        read = _ratio(runs, case, key)
        rows[id_] = Finding(read(""), _varied(runs, read))
    rows["F14.3"] = Finding(
        transitions(runs[THREE]),
        f"{peaks_above(runs[THREE], 0.05)} peaks of Fn stand out by more than 5 % of the largest;"
        f" transitions under variations: {_varied(runs, lambda s: transitions(runs[THREE + s]))}",
    )
    for id_, case in (("F14.5", ONE), ("F14.6", TWO), ("F14.7", THREE)):
        rows[id_] = Finding(
            1e-6 * largest_stress(runs[case]),
            _varied(runs, _stress(runs, case)),
        )
    _, tangential = curve(runs[THREE], "tangential_force_N")
    rows["F14.4"] = Finding(
        bool(tangential.min() < 0 < tangential.max()),
        f"Ft between {tangential.min():.0f} and {tangential.max():.0f} N",
    )
    late = {c: deflection_peaks_after_first_restitution(runs[c]) for c in (ONE, TWO, THREE)}
    rows["F15.3"] = Finding(
        all(late.values()), "; ".join(f"{c}: {'yes' if ok else 'no'}" for c, ok in late.items())
    )
    for id_, case in (("F16.1", ONE), ("F16.2", TWO)):
        _, velocity = curve(runs[case], "particle_velocity_m_per_s")
        rows[id_] = Finding(
            not sticks(runs[case]), f"V_P between {velocity.min():.2f} and {velocity.max():.2f} m/s"
        )
    count = int(runs[THREE].record.summary["slip_to_stick"])
    rows["F16.3"] = Finding(
        count,
        _varied(runs, lambda s: int(runs[THREE + s].record.summary["slip_to_stick"])),
    )
    signs = slips(runs[THREE])
    rows["F16.4"] = Finding(
        signs[:4] == [1, -1, 1, -1],
        "directions of slip in order: " + " ".join("right" if s > 0 else "left" for s in signs),
    )
    return rows
