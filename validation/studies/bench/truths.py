"""Converged solutions of the soft scene that errors are taken against: ``data/truths.toml``.

hcm's are solved by `hcm.reference_solution` (the same semi-discrete equations by an explicit
Runge-Kutta pair of order 8 in minimal coordinates: other unknowns, another integrator, another
event search), from rest in minutes.

The reference's are its own converged limits, from runs of 2026-11-29 from rest with contact by
impulses. `truths_anew` computes all of them again.
Peak, impulse, duration and time of the peak: the tip's edge refined alone from 0.2 mm down to
that of the source, on shafts of 1.5 mm (0.4 mm in 2D); in 3D plus what shafts of half the edge
change with a tip of 0.1 mm, the finest that both were run with.
Contact time: the rigid flight on even meshes of 1.5 to 0.375 mm (0.125 mm in 2D), extrapolated;
event times are known to 2e-6 s.
Their own error is the largest relative spread of peak, impulse and duration over the last three
tips (two in 2D): no grid convergence index applies, as the peak does not approach its limit from
one side, because the edges of these tips grow under the patch.

====  =====  =========  ==========  ==========
 dim  tip    peak (N)   impulse     duration
      (mm)              (mN s)      (us)
====  =====  =========  ==========  ==========
   3  0.200  93.055      9.9442     201.286
   3  0.141  94.888      9.9050     200.660
   3  0.100  95.032      9.9048     200.864
   3  0.071  95.532      9.9009     200.534
   3  0.050  95.283      9.9023     200.546
   2  0.050  184.517     9.7768     93.413
   2  0.025  184.166     9.7788     93.460
====  =====  =========  ==========  ==========
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
