"""One line of ``ladder.csv``, and how two runs become several."""

from collections.abc import Mapping
from dataclasses import dataclass

from validation.compare.differences import error_percent
from validation.compare.iso18571 import rate_forces
from validation.compare.sprague_geers import compare_forces
from validation.harness.quantities import COMPARED, OF_THE_FLIGHT
from validation.harness.record import RunRecord

COLUMNS = (
    "rung",
    "scene",
    "quantity",
    "reduced",
    "reference",
    "reference_uncertainty",
    "error_percent",
)
SAME, OWN = "same impact", "own flight"


@dataclass(frozen=True)
class Row:
    """A compared number.

    Attributes
    ----------
    rung : 2, 3 or 4.
    quantity : name, unit and start.
    reduced, reference, reference_uncertainty : in that unit; None where a row has none.
    error_percent : of the reduced model against the reference.
    """

    rung: int
    scene: str
    quantity: str
    reduced: float | None
    reference: float | None
    reference_uncertainty: float | None
    error_percent: float | None


def compare(
    rung: int,
    reduced: RunRecord,
    reference: RunRecord,
    uncertainty: Mapping[str, float],
    start: str,
) -> list[Row]:
    """All compared scalars and the curves' metrics.

    Parameters
    ----------
    uncertainty : by key, the reference's own, relative.
    start : SAME or OWN.
    """
    rows = []
    for entry in COMPARED:
        value, target = entry.read(reduced), entry.read(reference)
        # what a common impact state fixes for both models says nothing about them
        if (start == SAME and entry in OF_THE_FLIGHT) or (value is None and target is None):
            continue
        share = uncertainty.get(entry.key)
        rows.append(
            Row(
                rung,
                reduced.scene,
                f"{entry.title} ({entry.unit}), {start}",
                value,
                target,
                None if share is None or target is None else share * abs(target),
                error_percent(value, target),
            )
        )
    for name, title in (("normal_force_N", "Fn"), ("tangential_force_N", "Ft")):
        metrics = compare_forces(reduced, reference, name)
        rating = rate_forces(reduced, reference, name)
        parts = () if metrics is None else zip(("M", "P", "C"), metrics, strict=True)
        rows += [
            Row(rung, reduced.scene, f"Sprague-Geers {part} of {title} (%), {start}", None, None,
                None, 100 * share)
            for part, share in parts
        ]  # fmt: skip
        if rating is not None:
            text = f"ISO/TS 18571 rating of {title} ({rating.grade}), {start}"
            lost = 100 * (rating.overall - 1)
            rows.append(Row(rung, reduced.scene, text, rating.overall, 1.0, None, lost))
    return rows
