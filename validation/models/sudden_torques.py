"""A caution about torques that change during a tap sooner than its last phalanx bends."""

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from validation.scenes.scene import Scene
from validation.scenes.tables import TorqueTable

# Change of a torque over the peak force's moment about the last hinge, below which nothing is said:
# at 0.017 only the refined model's stress at R was off (by 7 %), not its peak.
LEAST_SHARE = 0.02
SUDDEN = (
    "a joint torque changes by {change:.2g} N m within {lasts:.0f} us of the tap, sooner than the"
    " last phalanx bends ({period:.0f} us): of five such taps hcm-refined's peak was 5 to 8 % low"
    " and its stress at R up to 40 % off, and two of fem3d's peaks were off by 4 times what they"
    " state; compare with fem3d at a smaller accuracy"
)


def bending_period(tables: Scene) -> float:
    """Period of the last phalanx's first bending, a hinge and a free end, s.

    w = 15.418/L^2 sqrt(EI/(rho A)), I/A = d^2/16 (Blevins 1979, table 8-1): written out here, as a
    solid's run may not depend on hcm (`Adapter.independent_of`), whose frequency it is.
    """
    finger, material = tables.finger, tables.material
    length, diameter, modulus, density = tables.rows(
        finger.length, finger.diameter, material.youngs_modulus, material.density
    )[-1]
    return float(
        2.0 * math.pi * length**2 / (15.418 * 0.25 * diameter * math.sqrt(modulus / density))
    )


def sudden_torques(tables: Scene, summary: Mapping[str, Any]) -> str:
    """The caution on a run's first tap, from its summary; empty if there is no reason for one."""
    torques = tables.drive.torques
    begins, lasts = summary.get("contact_time_s"), summary.get("contact_duration_s")
    if not isinstance(torques, TorqueTable) or begins is None or lasts is None:
        return ""
    period = bending_period(tables)
    length = tables.per_phalanx(tables.finger.length)[-1]
    least = LEAST_SHARE * summary["peak_normal_force_N"] * length
    rows = zip(pairwise(torques.time), pairwise(torques.values), strict=True)
    sudden = [
        (max(abs(b - a) for a, b in zip(*pair, strict=True)), 1e6 * (end - start))
        for (start, end), pair in rows
        if start <= begins + lasts and end >= begins and end - start < period
    ]
    change, took = max(sudden, default=(0.0, 0.0))
    if change <= least:
        return ""
    return SUDDEN.format(change=change, lasts=took, period=1e6 * period)
