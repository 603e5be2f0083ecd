"""Deflection of the last phalanx's tip (fig. 15), in the frame of its first node and tangent."""

from __future__ import annotations

from typing import TYPE_CHECKING

from validation.studies.paper.finding import event_times, window
from validation.studies.paper.solve import CaseRun

if TYPE_CHECKING:
    from hcm import Posture


def first_tap(run: CaseRun, drawn: bool) -> list[Posture]:
    """Postures of the first tap: those at its events, which fig. 15 draws, or all that are kept."""
    start, end = window(run.record)
    kept = run.event_postures if drawn else (*run.event_postures, *run.frames)
    return [p for p in kept if start <= p.time_s <= end]


def bend(posture: Posture) -> float:
    """Size of the tip's deflection, m."""
    return abs(float(posture.deflection(2)[1][-1]))


def largest(run: CaseRun) -> float:
    """Largest deflection of the tip during the contact, m."""
    return max(map(bend, first_tap(run, drawn=False)))


def largest_drawn(run: CaseRun) -> float:
    """Largest deflection of the tip at an instant that fig. 15 draws, m."""
    return max(map(bend, first_tap(run, drawn=True)))


def time_of_largest(run: CaseRun) -> float:
    """When it is, as a share of the contact."""
    start, end = window(run.record)
    return (max(first_tap(run, drawn=False), key=bend).time_s - start) / (end - start)


def peaks_after_first_restitution(run: CaseRun) -> bool:
    """Whether the deflection that fig. 15 draws is largest at the end of the first restitution.

    Reversals that last less than 5 % of the contact are ripples on it.
    """
    ends = [e.time_s for e in run.record.events
            if e.kind in ("restitution_to_compression", "separation")]  # fmt: skip
    largest = max(first_tap(run, drawn=True), key=bend).time_s
    turn = event_times(run, "compression_to_restitution")[0]
    start, end = window(run.record)
    later = [e for e in ends if e - start - turn > 0.05 * (end - start)]
    return bool(later) and abs(largest - later[0]) < 0.05 * (end - start)
