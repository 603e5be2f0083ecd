"""Converged solutions of the soft scene that errors are taken against: ``data/truths.toml``.

hcm's are solved by `hcm.reference_solution` (the same semi-discrete equations by an explicit
Runge-Kutta pair of order 8 in minimal coordinates: other unknowns, another integrator, another
event search), from rest in minutes.

The reference's are its own converged limits, from runs of 2026-11-29 from rest with contact by
impulses. `tests.validation.studies.bench.truths_anew` computes all of them again.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from validation import DATA
from validation.compare.tap_errors import TapQuantities

TAP_ELEMENTS, CONTACT_ELEMENTS = 5, 20  # per phalanx, in hcm's two truths


@dataclass(frozen=True)
class Truth:
    """A truth, and a bound on its own relative error."""

    values: TapQuantities
    own_error: float
    source: str


TRUTHS = {
    name: Truth(TapQuantities(**one["values"]), one["own_error"], one["source"])
    for name, one in tomllib.loads((DATA / "truths.toml").read_text("utf-8")).items()
}
REFERENCE_TRUTHS = {model: TRUTHS[model] for model in ("fem3d", "fem2d")}
TAP = TRUTHS["tap"]


def truths_table(truths: Mapping[str, Truth]) -> list[dict[str, Any]]:
    """One row per quantity: every model's truth, and the gap between hcm's and the solid's."""
    names = {"turn_s": "time_of_peak_after_contact_s"}
    rows: list[dict[str, Any]] = []
    for name in TapQuantities.__dataclass_fields__:
        row = {model: float(getattr(truth.values, name)) for model, truth in truths.items()}
        off = row["hcm"] / row["fem3d"] - 1.0
        rows.append({"quantity": names.get(name, name), **row, "hcm_off_fem3d": off})
    own = {model: truth.own_error for model, truth in truths.items()}
    return [*rows, {"quantity": "the truth's own relative error", **own}]
