"""The soft scene's tap and its contact alone, by `hcm.reference_solution`."""

import math
from typing import Any

import hcm
from hcm import reference_solution
from hcm.beam.chain import build_chain
from hcm.model import rigid_motion
from validation.compare.tap_errors import TapQuantities
from validation.models.hcm import hcm_scene
from validation.scenes.load import load_scene

# A rigid state like the one at impact: the paper's posture, the tip just above the surface.
IMPACT_ANGLES = (1.3089969389957472, 1.0471975511965976)  # rad below -X, phalanges 1 and 2
IMPACT_RATES = (12.0, 14.0, 40.0)  # rad/s
CLEARANCE = 1e-9  # m


def impact_start(surface_height: float, length: float) -> Any:
    """The rigid state from which the contact alone is solved."""
    upper = sum(length * math.sin(angle) for angle in IMPACT_ANGLES)
    last = math.asin((surface_height - CLEARANCE - upper) / length)
    return hcm.RigidStart((*IMPACT_ANGLES, last), IMPACT_RATES)


def solve_tap(elements: int, rtol: float) -> TapQuantities:
    """Solve the tap from rest; takes minutes."""
    return _solve(soft_scene(elements), rtol)


def solve_impact(elements: int, rtol: float) -> TapQuantities:
    """Solve the contact alone, from `impact_start`: a second with 5 elements, half a minute, 20."""
    scene = soft_scene(elements)
    chain, _ = build_chain(scene.finger, scene.drive)
    state = impact_start(scene.surface.height, scene.finger.phalanges[0].length)
    start = reference_solution.ChainStart(*rigid_motion(scene.finger, chain, state))
    return _solve(scene, rtol, start)


def soft_scene(elements: int) -> hcm.Scene:
    """The soft scene with that many elements per phalanx."""
    return hcm_scene(load_scene("soft", (f"finger.elements={elements}",)), estimate=False)


def _solve(
    scene: hcm.Scene, rtol: float, start: reference_solution.ChainStart | None = None
) -> TapQuantities:
    of = scene.finger, scene.surface, scene.tip, scene.drive
    solved = reference_solution.solve(*of, rtol=rtol, atol=1e-4 * rtol, start=start)
    contact = solved.time_of("contact")
    return TapQuantities(
        contact_time_s=contact,
        turn_s=solved.time_of("compression_to_restitution") - contact,
        duration_s=solved.time_of("separation") - contact,
        peak_normal_force_N=solved.peak_normal_force_N,
        normal_impulse_N_s=solved.normal_impulse_N_s,
    )
