"""The accuracy table (the paper's Table 2): reduced model against each reference, with sources."""

from typing import TYPE_CHECKING, Any

from validation.compare.claims import find, read_claims
from validation.compare.differences import error_percent, spread
from validation.compare.sprague_geers import compare_forces
from validation.harness.quantities import COMPARED
from validation.harness.record import RunRecord

if TYPE_CHECKING:
    import pandas as pd

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
PAPER_TITLES = {"peak Fn": "peak normal force", "peak Ft": "peak tangential force"}


def _paper_columns(scene: str, title: str, reference: RunRecord) -> dict[str, Any]:
    """Table 2's own columns, beside the reference that stands in for LS-DYNA."""
    if title not in PAPER_TITLES or reference.variant != "ls-dyna-like":
        return {}
    claims = read_claims()
    name = PAPER_TITLES[title]
    found = [
        find(claims, "Table 2", scene, f"{prefix} {name}")
        for prefix in ("HCM", "reference", "error of")
    ]
    columns = ("paper_reduced", "paper_reference", "paper_error_percent")
    values = {c: claim.number for c, claim in zip(columns, found, strict=True) if claim}
    if not values:
        return {}
    ids = " ".join(claim.id for claim in found if claim)
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
                    **_paper_columns(reduced.scene, entry.title, reference),
                }
            )
        for name, title in (("normal_force_N", "Fn"), ("tangential_force_N", "Ft")):
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


def accuracy_table(rows: list[dict[str, Any]]) -> "pd.DataFrame":
    """The rows as a table with all columns, in order."""
    import pandas as pd

    return pd.DataFrame(rows, columns=list(COLUMNS))
