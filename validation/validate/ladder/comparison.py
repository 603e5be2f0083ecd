"""The compared numbers of a rung, the rows of ``ladder.csv``."""

from collections.abc import Mapping
from dataclasses import dataclass

from validation.compare.force_curves import FORCES
from validation.compare.iso18571 import rate_forces
from validation.compare.sprague_geers import compare_forces
from validation.compare.verdict import error_percent
from validation.harness.quantities import COMPARED, OF_THE_FLIGHT, Quantity
from validation.harness.record import RunRecord

SAME, OWN = "same impact", "own flight"  # where the two models start


@dataclass(frozen=True)
class Comparison:
    """A compared number.

    rung : 2, 3 or 4.
    quantity : name, unit and start.
    reduced, reference, reference_uncertainty : in the quantity's unit; None where there is none.
    error_percent : of the reduced model against the reference.
    """

    rung: int
    scene: str
    quantity: str
    reduced: float | None
    reference: float | None
    reference_uncertainty: float | None
    error_percent: float | None


def name_of(entry: Quantity, start: str) -> str:
    """A quantity's name in the column ``quantity``."""
    return f"{entry.title} ({entry.unit}), {start}"


def compare_runs(
    rung: int,
    reduced: RunRecord,
    reference: RunRecord,
    uncertainty: Mapping[str, float],
    start: str,
) -> list[Comparison]:
    """All compared scalars and the curves' metrics.

    uncertainty : relative uncertainties of the reference, by key.
    start : SAME or OWN.
    """
    scene = reduced.scene
    found = []
    for entry in COMPARED:
        value, target = entry.read(reduced), entry.read(reference)
        # what a common impact state fixes for both models says nothing about them
        if (start == SAME and entry in OF_THE_FLIGHT) or (value is None and target is None):
            continue
        share = uncertainty.get(entry.key)
        known_to = None if share is None or target is None else share * abs(target)
        error = error_percent(value, target)
        found.append(Comparison(rung, scene, name_of(entry, start), value, target, known_to, error))
    for name, title in FORCES.items():
        metrics = compare_forces(reduced, reference, name)
        for part, share in zip("MPC", metrics or (), strict=metrics is not None):
            text = f"Sprague-Geers {part} of {title} (%), {start}"
            found.append(Comparison(rung, scene, text, None, None, None, 100 * share))
        rating = rate_forces(reduced, reference, name)
        if rating is not None:
            text = f"ISO/TS 18571 rating of {title} ({rating.grade}), {start}"
            lost = 100 * (rating.overall - 1)
            found.append(Comparison(rung, scene, text, rating.overall, 1.0, None, lost))
    return found
