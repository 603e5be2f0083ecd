"""The converged solutions of the soft scene that errors are taken against, and their own errors.

hcm's are solved by `hcm.reference_solution` (the same semi-discrete equations by an explicit
Runge-Kutta pair of order 8 in minimal coordinates: other unknowns, another integrator, another
event search), from rest in minutes.

The reference's are its own converged limits, from runs of 2026-11-21 (2D: 11-22) from rest with
contact by impulses. `truths_anew` makes all of them anew.
Peak, impulse, duration and time of the peak: the tip's edge refined alone from 0.28 mm down to
that of the source, on shafts of 1.5 mm (0.4 mm in 2D); in 3D plus what shafts of half the edge
change with a tip of 0.1 mm, the finest that both were run with.
Contact time: the rigid flight on even meshes of 1.5 to 0.375 mm (0.125 mm in 2D), extrapolated;
event times are known to 2e-6 s.
Their own error is the spread of peak, impulse and duration over the last three tips (two in 2D),
relative, the largest of them: the peak does not approach its limit from one side, so that no grid
convergence index applies: the edges of these tips grow under the patch.

====  =====  =========  ==========  ==========
 dim  tip    peak (N)   impulse     duration
      (mm)              (mN s)      (us)
====  =====  =========  ==========  ==========
   3  0.200  92.948      9.8569     200.456
   3  0.141  94.428      9.8809     200.815
   3  0.100  95.644      9.8887     200.718
   3  0.071  95.374      9.8966     200.599
   3  0.050  95.357      9.9015     200.596
   2  0.050  184.704     9.7767     93.423
   2  0.025  184.184     9.7787     93.472
====  =====  =========  ==========  ==========
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from validation.compare.tap_errors import TapQuantities

TAP_ELEMENTS, CONTACT_ELEMENTS = 5, 20  # a phalanx, of hcm's two truths


@dataclass(frozen=True)
class Truth:
    """A truth, and a bound on its own relative error."""

    values: TapQuantities
    own_error: float
    source: str


# rtol = 1e-10 and 1e-9 agree to 3e-9 in the peak, 1e-11 in the impulse, 2e-11 s in the turn.
TAP = Truth(
    TapQuantities(
        contact_time_s=0.13610709065870444,
        turn_s=0.13620965574850422 - 0.13610709065870444,
        duration_s=0.13633946570634775 - 0.13610709065870444,
        peak_normal_force_N=64.47781232119031,
        normal_impulse_N_s=0.010191670695534453,
    ),
    own_error=1e-7,
    source="hcm.reference_solution, DOP853, rtol 1e-10, 5 elements a phalanx, from rest",
)
# From 5 to 10 to 20 elements a phalanx the duration moves by 9.7e-5, then 1.6e-5; peak and impulse
# by 1e-4 and 2e-5, then 4e-6 and 2e-9. The turn, where short waves make v_n cross zero, moves by
# 5e-8 s and is not bounded by the same figure.
CONTACT = Truth(
    TapQuantities(
        contact_time_s=6.270295197498454e-10,
        turn_s=1.1019164357025234e-4,
        duration_s=2.341679491918153e-4,
        peak_normal_force_N=64.74376422352934,
        normal_impulse_N_s=0.010341848826123318,
    ),
    own_error=6e-6,
    source="hcm.reference_solution, DOP853, rtol 1e-10, 20 elements a phalanx,"
    " from a rigid impact state",
)
SOLID = Truth(
    TapQuantities(
        contact_time_s=0.133886,
        turn_s=8.2749e-5,
        duration_s=2.00470e-4,
        peak_normal_force_N=95.357,
        normal_impulse_N_s=9.8946e-3,
    ),
    own_error=3e-3,
    source="stored (2026-11-21): tip of 0.05 mm (331,000 elements), contact by impulses, from rest",
)
PLANE = Truth(
    TapQuantities(
        contact_time_s=0.134296,
        turn_s=4.1889e-5,
        duration_s=9.3472e-5,
        peak_normal_force_N=184.184,
        normal_impulse_N_s=9.7787e-3,
    ),
    own_error=3e-3,
    source="stored (2026-11-22): tip of 0.025 mm (32,000 elements), contact by impulses, from rest",
)
HCM_TRUTHS: Mapping[str, Truth] = {"tap": TAP, "contact": CONTACT}  # by study
REFERENCE_TRUTHS: Mapping[str, Truth] = {"fem3d": SOLID, "fem2d": PLANE}  # by model
TRUTHS = {**HCM_TRUTHS, **REFERENCE_TRUTHS}


def truths_table(truths: Mapping[str, Truth]) -> list[dict[str, Any]]:
    """One row a quantity: every model's truth, and the gap between hcm's and the solid's."""
    names = {"turn_s": "time_of_peak_after_contact_s"}
    rows: list[dict[str, Any]] = []
    for name in TapQuantities.__dataclass_fields__:
        row = {model: float(getattr(truth.values, name)) for model, truth in truths.items()}
        off = row["hcm"] / row["fem3d"] - 1.0
        rows.append({"quantity": names.get(name, name), **row, "hcm_off_fem3d": off})
    own = {model: truth.own_error for model, truth in truths.items()}
    return [*rows, {"quantity": "the truth's own relative error", **own}]
