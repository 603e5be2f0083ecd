"""The converged limits that the reference's errors are taken against, on the soft scene.

Stored, from runs of 2026-11-21; `truth_runs` makes them anew, in a quarter of an hour.
From rest, with contact by impulses (`reference_fem.contact.impulse`). Peak, impulse, duration and
time of the peak: the tip's edge refined alone from 0.28 mm down to `tip_mm`, on shafts of 1.5 mm
(0.4 mm in 2D); in 3D plus what shafts of half the edge change with a tip of 0.1 mm, the finest
that both were run with.
Contact time: the rigid flight on even meshes of 1.5 to 0.375 mm (0.125 mm in 2D), extrapolated.

`own_error` is the spread of peak, impulse and duration over the last three tips (two in 2D),
relative, the largest of them: the peak does not approach its limit from one side, so that no grid
convergence index applies (`fingertap converge` says "not asymptotic").

====  =====  =========  ==========  ==========
 dim  tip    peak (N)   impulse     duration
      (mm)              (mN s)      (us)
====  =====  =========  ==========  ==========
   3  0.200  92.948      9.8569     200.456
   3  0.141  94.428      9.8809     200.815
   3  0.100  95.644      9.8887     200.718
   3  0.071  95.374      9.8966     200.599
   3  0.050  95.357      9.9015     200.596
   2  0.050  184.520     9.7696     93.331
   2  0.025  184.335     9.7731     93.479
====  =====  =========  ==========  ==========
"""

from collections.abc import Mapping

from validation.compare.tap_errors import TapQuantities
from validation.studies.bench.truths import Known

SOLID = Known(
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
PLANE = Known(
    TapQuantities(
        contact_time_s=0.134295,
        turn_s=4.2148e-5,
        duration_s=9.3479e-5,
        peak_normal_force_N=184.335,
        normal_impulse_N_s=9.7731e-3,
    ),
    own_error=2e-3,
    source="stored (2026-11-21): tip of 0.025 mm (32,000 elements), contact by impulses, from rest",
)
KNOWN: Mapping[str, Known] = {"fem3d": SOLID, "fem2d": PLANE}
EVENT_ERROR_S = 2e-6  # of the truths' own event times: that of the extrapolated contact time
