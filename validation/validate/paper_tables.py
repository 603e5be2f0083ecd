"""The paper's Tables 2 and 3: what it prints of both its models, beside ours.

Its reference, LS-DYNA on a 4-core laptop of 2016, has the preset ls-dyna-like in its place here.
"""

from collections.abc import Mapping
from typing import Any

from validation.compare.claims import Claim, find
from validation.compare.differences import error_percent
from validation.harness.quantities import quantity
from validation.validate.plan import REDUCED, REFERENCE, Runs

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
    """What the paper prints of a quantity: of ``hcm``, of the ``reference``, of the ``error``."""
    table, name = ("Table 2", TABLE_2.get(key)) if key in TABLE_2 else ("Table 3", TABLE_3.get(key))
    prefixes = {"hcm": "HCM", "reference": "reference", "error": "error of"}
    found = {who: find(table, scene, f"{text} {name}") for who, text in prefixes.items()}
    return {who: claim for who, claim in found.items() if claim is not None}


def paper_rows(runs: Runs, names: Mapping[str, str]) -> list[dict[str, Any]]:
    """Rows of Table 2 or 3, by its quantities; the paper's error is a magnitude, ours is signed."""
    rows = []
    for scene in runs.scenes:
        ran = {"hcm": runs.find(scene, REDUCED), "reference": runs.find(scene, REFERENCE)}
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
