"""The page's tables of accuracy and efficiency, with sources, and the paper's Tables 2 and 3.

The preset ls-dyna-like stands in for the paper's reference, LS-DYNA on a 4-core laptop of 2016.
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

from validation.compare.claims import Claim, find
from validation.compare.differences import difference, error_percent, spread
from validation.compare.force_curves import FORCES
from validation.compare.sprague_geers import compare_forces
from validation.harness.quantities import COMPARED, quantities, quantity
from validation.harness.record import RunRecord
from validation.validate.plan import PAPER_REDUCED, PAPER_REFERENCE, RunName, Runs

SELF = "self"  # computed by the model under validation
OTHER_MODEL = "other model"  # computed by the independent model
PAPER = "paper"  # printed in the article
DATA = "data"  # of a file of curves
COST_QUANTITIES = quantities(
    "wall_time_s", "peak_memory_MB", "steps", "elements", "time_step_s", "energy_residual"
)
ACCURACY_COLUMNS = (
    *("scene", "quantity", "unit"),
    *("reduced_model", "reduced", "reduced_error", "reduced_source"),
    *("reference_model", "reference", "reference_error", "reference_source"),
    *("error_percent", "uncertainty_percent", "verdict", "tolerance_percent", "check"),
    *("reference_low", "reference_high", "reference_runs"),
    *("paper_reduced", "paper_reference", "paper_error_percent", "paper_source"),
)
EFFICIENCY_COLUMNS = (
    *("scene", "model", "source", "status"),
    *(entry.key for entry in COST_QUANTITIES),
    *("processor", "measured", "paper_time_s", "paper_memory_MB", "paper_source"),
)

# The quantities of each table, as its claims call them.
TABLE_2 = {
    "peak_normal_force_N": "peak normal force",
    "peak_tangential_force_N": "peak tangential force",
}
TABLE_3 = {"wall_time_s": "run time", "peak_memory_MB": "memory"}
_COMMON = ("scene", "quantity", "unit", "hcm", "hcm_paper", "reference", "reference_paper")
COLUMNS_2 = (*_COMMON, "error_percent", "error_percent_paper")
COLUMNS_3 = (*_COMMON, "reference_over_hcm", "reference_over_hcm_paper")


def printed(scene: str, key: str) -> dict[str, Claim]:
    """The paper's claims on a quantity: of ``hcm``, of the ``reference``, and of the ``error``."""
    table, name = ("Table 2", TABLE_2.get(key)) if key in TABLE_2 else ("Table 3", TABLE_3.get(key))
    prefixes = {"hcm": "HCM", "reference": "reference", "error": "error of"}
    found = {who: find(table, scene, f"{text} {name}") for who, text in prefixes.items()}
    return {who: claim for who, claim in found.items() if claim is not None}


def accuracy_rows(
    reduced: RunRecord,
    references: list[RunRecord],
    spread_over: list[RunRecord],
    tolerances: Mapping[str, float] = MappingProxyType({}),
) -> list[dict[str, Any]]:
    """Rows of one scene: every compared quantity against every completed reference.

    spread_over : three-dimensional runs over meshes and penalty factors, whose spread is quoted
        beside every three-dimensional number
    tolerances : largest difference by a quantity's key, percent.
    """
    rows: list[dict[str, Any]] = []
    for reference in references:
        common = {
            "scene": reduced.scene,
            "reduced_model": reduced.label,
            "reduced_source": SELF,
            "reference_model": reference.label,
            "reference_source": DATA if "data" in reference.provenance else OTHER_MODEL,
        }
        for entry in COMPARED:
            asked = tolerances.get(entry.key)
            found = difference(reduced.scene, reduced.model, entry, reduced, reference, asked)
            row = common | {"quantity": entry.title, "unit": entry.unit} | found.numbers
            band = spread(spread_over, entry) if reference.model == "fem3d" else None
            if band is not None:  # its low, high and runs
                row |= {f"reference_{name}": value for name, value in vars(band).items()}
            rows.append(row | _of_table_2(entry.key, reduced, reference))
        for name, title in FORCES.items():
            metrics = compare_forces(reduced, reference, name)
            for part in ("magnitude", "phase", "combined"):
                text = f"Sprague-Geers {part} of {title}(t - t_c)"
                share = None if metrics is None else 100 * getattr(metrics, part)
                rows.append(common | {"quantity": text, "unit": "%", "error_percent": share})
    return rows


def all_accuracy_rows(runs: Runs) -> list[dict[str, Any]]:
    """Rows of all comparisons of all scenes."""
    return [
        row
        for scene in runs.scenes
        for run, references in runs.comparisons(scene)
        for row in accuracy_rows(run, references, runs.spread_over(scene), runs.plan.tolerances)
    ]


def _of_table_2(key: str, reduced: RunRecord, reference: RunRecord) -> dict[str, Any]:
    """Table 2's numbers for the two runs that stand in for the paper's; empty for others."""
    pair = (reduced.model, reduced.variant, reference.model, reference.variant)
    if key not in TABLE_2 or pair != (*PAPER_REDUCED, *PAPER_REFERENCE):
        return {}
    claims = printed(reference.scene, key)
    if not claims:
        return {}
    columns = {"hcm": "reduced", "reference": "reference", "error": "error_percent"}
    values = {f"paper_{columns[who]}": claim.number for who, claim in claims.items()}
    ids = " ".join(claim.id for claim in claims.values())
    return {**values, "paper_source": f"{PAPER}: Table 2 ({ids})"}


def efficiency_rows(
    runs: Sequence[RunRecord], models: Sequence[str] = (PAPER_REDUCED.model,)
) -> list[dict[str, Any]]:
    """One row per run, each measured alone in a fresh process with its compiled code warm.

    models : the compared ones; all others are references.
    """
    return [
        {
            "scene": run.scene,
            "model": run.label,
            "source": SELF if run.model in models else OTHER_MODEL,
            "status": run.status,
            **{entry.key: run.summary.get(entry.key) for entry in COST_QUANTITIES},
            "processor": run.provenance.get("processor"),
            "measured": run.measured,
            **_of_table_3(run),
        }
        for run in runs
    ]


def _of_table_3(run: RunRecord) -> dict[str, Any]:
    """Table 3's numbers for a run that stands in for one of the paper's; empty for others."""
    who = {PAPER_REDUCED: "hcm", PAPER_REFERENCE: "reference"}.get(RunName(run.model, run.variant))
    if who is None:
        return {}
    time, memory = (printed(run.scene, key).get(who) for key in TABLE_3)
    if time is None or memory is None:
        return {}
    return {
        "paper_time_s": time.number,
        "paper_memory_MB": memory.number,
        "paper_source": f"{PAPER}: Table 3 ({time.id} {memory.id}), 4-core laptop of 2016",
    }


def paper_rows(runs: Runs, names: Mapping[str, str]) -> list[dict[str, Any]]:
    """Rows of Table 2 or 3, for `names`; the paper's error is a magnitude, ours is signed."""
    rows = []
    for scene in runs.scenes:
        ran = {
            "hcm": runs.find(scene, PAPER_REDUCED),
            "reference": runs.find(scene, PAPER_REFERENCE),
        }
        for key in names:
            entry = quantity(key)
            ours = {who: None if run is None else entry.read(run) for who, run in ran.items()}
            paper = {who: claim.number for who, claim in printed(scene, key).items()}
            rows.append(
                {
                    "scene": scene,
                    "quantity": entry.title,
                    "unit": entry.unit,
                    **ours,
                    "hcm_paper": paper.get("hcm"),
                    "reference_paper": paper.get("reference"),
                    "error_percent": error_percent(ours["hcm"], ours["reference"]),
                    "error_percent_paper": paper.get("error"),
                    "reference_over_hcm": _ratio(ours),
                    "reference_over_hcm_paper": _ratio(paper),
                }
            )
    return rows


def _ratio(values: Mapping[str, float | None]) -> float | None:
    reference, reduced = values.get("reference"), values.get("hcm")
    return reference / reduced if reference and reduced else None
