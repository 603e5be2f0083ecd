"""The accuracy table (the paper's Table 2): reduced model against each reference, with sources."""

from typing import Any

from validation.compare.differences import error_percent, spread
from validation.compare.force_curves import FORCES
from validation.compare.sprague_geers import compare_forces
from validation.harness.quantities import COMPARED, Quantity
from validation.harness.record import RunRecord
from validation.validate.paper_tables import TABLE_2, printed
from validation.validate.plan import REFERENCE

SELF = "self"  # computed by the model under validation
OTHER = "other model"  # computed by the independent model
PAPER = "paper"  # printed in the article
COLUMNS = (
    "scene",
    "quantity",
    "unit",
    "reduced_model",
    "reduced",
    "reduced_source",
    "reference_model",
    "reference",
    "reference_source",
    "error_percent",
    "reference_low",
    "reference_high",
    "reference_runs",
    "paper_reduced",
    "paper_reference",
    "paper_error_percent",
    "paper_source",
)


def _paper_columns(scene: str, entry: Quantity, reference: RunRecord) -> dict[str, Any]:
    """Table 2's own columns, beside the reference that stands in for LS-DYNA."""
    claims = printed(scene, entry.key) if reference.variant == REFERENCE[1] else {}
    if entry.key not in TABLE_2 or not claims:
        return {}
    columns = {"hcm": "reduced", "reference": "reference", "error": "error_percent"}
    values = {f"paper_{columns[who]}": claim.number for who, claim in claims.items()}
    ids = " ".join(claim.id for claim in claims.values())
    return {**values, "paper_source": f"{PAPER}: Table 2 ({ids})"}


def accuracy_rows(
    reduced: RunRecord, references: list[RunRecord], spread_over: list[RunRecord]
) -> list[dict[str, Any]]:
    """Rows of one scene: every compared quantity against every completed reference.

    Parameters
    ----------
    reduced : the run of ``hcm``.
    references : runs of the reference, each compared with the reduced run.
    spread_over : three-dimensional runs over meshes and penalty factors, whose spread is quoted
        beside every three-dimensional number.
    """
    rows = []
    for reference in references:
        common = {
            "scene": reduced.scene,
            "reduced_model": reduced.label,
            "reduced_source": SELF,
            "reference_model": reference.label,
            "reference_source": OTHER,
        }
        for entry in COMPARED:
            value, target = entry.read(reduced), entry.read(reference)
            band = spread(spread_over, entry) if reference.model == "fem3d" else None
            rows.append(
                {
                    **common,
                    "quantity": entry.title,
                    "unit": entry.unit,
                    "reduced": value,
                    "reference": target,
                    "error_percent": error_percent(value, target),
                    "reference_low": band and band.low,
                    "reference_high": band and band.high,
                    "reference_runs": band and band.count,
                    **_paper_columns(reduced.scene, entry, reference),
                }
            )
        for name, title in FORCES.items():
            metrics = compare_forces(reduced, reference, name)
            for part in ("magnitude", "phase", "combined"):
                share = None if metrics is None else 100 * getattr(metrics, part)
                rows.append(
                    {
                        **common,
                        "quantity": f"Sprague-Geers {part} of {title}(t - t_c)",
                        "unit": "%",
                        "error_percent": share,
                    }
                )
    return rows
