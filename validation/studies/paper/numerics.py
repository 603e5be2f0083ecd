"""Numerical settings that the article prints or lets one infer, as overrides of a scene.

It prints xi = 0.8, steps of 1 ms in flight and 0.1 us in contact, and starts from q.. = 0 (fig. 6).
The times under fig. 13's postures (67.2, 9.1 and 6.7 ms in flight) are no multiples of 1 ms; all
nine are multiples of 0.02 ms, the longest flight step that they allow.
"""

_PAPER = (
    "solver.hcm.flight_tolerance=0.0",
    "solver.hcm.contact_step=1e-7",
    "solver.hcm.contact_tolerance=0.0",
    "solver.hcm.spectral_radius=0.8",
    "solver.hcm.consistent_start=false",
)
PRINTED = ("solver.hcm.flight_step=1e-3", *_PAPER)
POSTURE_GRID = ("solver.hcm.flight_step=2e-5", *_PAPER)
# What a scene without a [solver.hcm] table runs with.
DEFAULTS = (
    "solver.hcm.flight_step=1e-4",
    "solver.hcm.flight_tolerance=1e-7",
    "solver.hcm.contact_step=1e-6",
    "solver.hcm.contact_tolerance=1e-11",
    "solver.hcm.spectral_radius=0.8",
)
