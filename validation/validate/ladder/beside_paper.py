"""Rung 4 as the paper prints it: its Tables 2 and 3, our numbers beside its own."""

from typing import Any

from validation.compare.claims import Claim, find, read_claims
from validation.compare.differences import error_percent
from validation.harness.quantities import COMPARED
from validation.harness.record import RunRecord
from validation.validate.plan import REDUCED, REFERENCE, SCENES, Runs

TABLE_2 = {
    "peak Fn": "peak normal force",
    "peak Ft": "peak tangential force",
}
TABLE_3 = {
    "wall_time_s": ("time", "s", "run time"),
    "peak_memory_MB": ("memory", "MB", "memory"),
}
COLUMNS_2 = (
    "scene",
    "quantity",
    "unit",
    "hcm",
    "hcm_paper",
    "reference",
    "reference_paper",
    "error_percent",
    "error_percent_paper",
)
COLUMNS_3 = (*COLUMNS_2[:-2], "reference_over_hcm", "reference_over_hcm_paper")


def _printed(claims: tuple[Claim, ...], where: str, scene: str, quantity: str) -> float | None:
    claim = find(claims, where, scene, quantity)
    return None if claim is None else claim.number


def _ratio(reference: float | None, reduced: float | None) -> float | None:
    return reference / reduced if reference and reduced else None


def _value(run: RunRecord | None, key: str) -> float | None:
    return None if run is None else run.value(key)


def table_2(runs: Runs) -> list[dict[str, Any]]:
    """Peak forces of both models; the reference is the preset ls-dyna-like.

    ``error_percent_paper`` is what the paper prints (a magnitude), ours is signed.
    """
    claims = read_claims()
    rows = []
    for scene in SCENES:
        reduced, reference = runs.find(scene, REDUCED), runs.find(scene, REFERENCE)
        for entry in COMPARED:
            if (name := TABLE_2.get(entry.title)) is None:
                continue
            value = None if reduced is None else entry.read(reduced)
            target = None if reference is None else entry.read(reference)
            rows.append(
                {
                    "scene": scene,
                    "quantity": entry.title,
                    "unit": entry.unit,
                    "hcm": value,
                    "hcm_paper": _printed(claims, "Table 2", scene, f"HCM {name}"),
                    "reference": target,
                    "reference_paper": _printed(claims, "Table 2", scene, f"reference {name}"),
                    "error_percent": error_percent(value, target),
                    "error_percent_paper": _printed(claims, "Table 2", scene, f"error of {name}"),
                }
            )
    return rows


def table_3(runs: Runs) -> list[dict[str, Any]]:
    """Time and memory of both models, ours here and the paper's on its own laptop of 2016."""
    claims = read_claims()
    rows = []
    for scene in SCENES:
        reduced, reference = runs.find(scene, REDUCED), runs.find(scene, REFERENCE)
        for key, (title, unit, name) in TABLE_3.items():
            ours = (_value(reduced, key), _value(reference, key))
            printed = [
                _printed(claims, "Table 3", scene, f"{model} {name}")
                for model in ("HCM", "reference")
            ]
            rows.append(
                {
                    "scene": scene,
                    "quantity": title,
                    "unit": unit,
                    "hcm": ours[0],
                    "hcm_paper": printed[0],
                    "reference": ours[1],
                    "reference_paper": printed[1],
                    "reference_over_hcm": _ratio(ours[1], ours[0]),
                    "reference_over_hcm_paper": _ratio(printed[1], printed[0]),
                }
            )
    return rows
