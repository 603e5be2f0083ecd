"""Stored solutions of `hcm.reference_solution` that errors are taken against, and their own errors.

`hcm.reference_solution` solves the same semi-discrete equations by an explicit Runge-Kutta pair of
order 8 in minimal coordinates: other unknowns, another integrator, another event search. From rest
it takes minutes, so its result is kept here; `recompute` makes it anew.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from validation.compare.tap_errors import TapQuantities
from validation.models.hcm import translate
from validation.scenes.load import load_scene

TAP_ELEMENTS = 5
# A rigid state like the one at impact: the paper's posture, the tip just above the surface.
IMPACT_ANGLES = (1.3089969389957472, 1.0471975511965976)  # rad below -X, phalanges 1 and 2
IMPACT_RATES = (12.0, 14.0, 40.0)  # rad/s
CLEARANCE = 1e-9  # m


@dataclass(frozen=True)
class Known:
    """A truth, and a bound on its own relative error."""

    values: TapQuantities
    own_error: float
    source: str


# rtol = 1e-10 and 1e-9 agree to 3e-9 in the peak, 1e-11 in the impulse, 2e-11 s in the turn.
TAP = Known(
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


def from_truth(solved: Any) -> TapQuantities:
    """A `hcm.reference_solution.Truth` of one tap as quantities."""
    contact = solved.time_of("contact")
    return TapQuantities(
        contact_time_s=contact,
        turn_s=solved.time_of("compression_to_restitution") - contact,
        duration_s=solved.time_of("separation") - contact,
        peak_normal_force_N=solved.peak_normal_force_N,
        normal_impulse_N_s=solved.normal_impulse_N_s,
    )


def impact_start(surface_height: float, length: float) -> Any:
    """The rigid state from which the contact alone is studied."""
    import hcm

    upper = sum(length * math.sin(angle) for angle in IMPACT_ANGLES)
    last = math.asin((surface_height - CLEARANCE - upper) / length)
    return hcm.RigidStart((*IMPACT_ANGLES, last), IMPACT_RATES)


def solve_tap(elements: int, rtol: float) -> TapQuantities:
    """The tap from rest: minutes."""
    from hcm import reference_solution as truth

    given = arguments(elements)
    return from_truth(truth.solve(**given, rtol=rtol, atol=1e-4 * rtol))


def solve_impact(elements: int, rtol: float) -> TapQuantities:
    """The contact alone, from `impact_start`: a second at 5 elements, a half minute at 20."""
    from hcm import reference_solution as truth
    from hcm.beam.chain import build_chain
    from hcm.model import rigid_motion

    given = arguments(elements)
    finger = given["finger"]
    chain, _ = build_chain(finger, given["drive"])
    start = impact_start(given["surface"].height, finger.phalanges[0].length)
    motion = truth.Start(*rigid_motion(finger, chain, start))
    return from_truth(truth.solve(**given, start=motion, rtol=rtol, atol=1e-4 * rtol))


def arguments(elements: int) -> dict[str, Any]:
    """The soft scene for `hcm.reference_solution.solve`."""
    given = translate(load_scene("soft", (f"finger.elements={elements}",)))
    return {name: given[name] for name in ("finger", "surface", "tip", "drive")}


def largest_difference(a: TapQuantities, b: TapQuantities) -> float:
    """The largest relative difference of any quantity but the contact's time."""
    names = [field.name for field in fields(a) if field.name != "contact_time_s"]
    return max(abs(getattr(a, name) / getattr(b, name) - 1.0) for name in names)


# From 5 to 10 to 20 elements a phalanx the duration moves by 9.7e-5, then 1.6e-5; peak and impulse
# by 1e-4 and 2e-5, then 4e-6 and 2e-9. The turn, where short waves make v_n cross zero, moves by
# 5e-8 s and is not bounded by the same figure.
CONTACT = Known(
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
CONTACT_ELEMENTS = 20
KNOWN: Mapping[str, Known] = {"tap": TAP, "contact": CONTACT}


def recompute(progress: Callable[[float, str], None]) -> dict[str, Known]:
    """Both truths anew, in minutes.

    A truth that has moved from the one kept here carries the difference as its own error.
    """
    progress(0.0, "truth of the tap from rest")
    tap = solve_tap(TAP_ELEMENTS, 1e-9)
    progress(0.8, "truth of the contact alone")
    contact = solve_impact(CONTACT_ELEMENTS, 1e-9)
    return {
        study: replace(
            known,
            values=found,
            own_error=max(known.own_error, largest_difference(found, known.values)),
            source=known.source.replace("1e-10", "1e-9"),
        )
        for study, found, known in (("tap", tap, TAP), ("contact", contact, CONTACT))
    }
