"""Reasons not to trust a run's numbers, from its stated errors, its flight and its friction."""

import math
from collections.abc import Mapping

import numpy as np

from reference_fem.arrays import Array
from reference_fem.estimates.accuracy import EDGE, FLUTTER_FRICTION, RELAXATION_SHARE
from reference_fem.estimates.flight_error import CHANGE, MAGNIFIED, Flight, FlightErrors, magnified
from reference_fem.estimates.mesh_error import IMPULSE
from reference_fem.results.result import ForceRecord, Summary
from reference_fem.settings import Material

# Share of mu F_n above which a tip slides as a whole.
SLIP_SHARE = 0.9
# Relative error that a number may state without a caution.
CAUTION_ERROR = 0.02
# Share by which a phalanx's inertia may be off its shape's; corrected masses leave round-off.
INERTIA_OFF = 1e-3
# Relative error of the impulse by motion that a flight omits, above which a run is cautioned.
LARGEST_LEFT_OUT = 0.01
ELSEWHERE = (
    "the round end's own flight leads to a different first touch: it grazes the surface, or "
    "magnifies small differences, so no mesh can tell which comes first: start nearer ([start])"
)
MAGNIFIES = (
    "the flight magnifies its start: angles changed by {:g} rad change the speed of approach by "
    "{}, which the errors leave out: start nearer ([start])"
)
RINGS = "bending, stretching and vibration in flight change the tap by {}: {}"
REMEDY = {
    "rigid": "let the elements fly (solver.fem.flight = 'coarse', or 'explicit'), or start nearer",
    "coarse": "let the run's own elements fly (solver.fem.flight = 'explicit'), or start nearer",
    "explicit": "refine the shafts (solver.fem.section_size and axial_size), or start nearer",
}
TITLES = {
    "contact_time_s": "time of contact",
    "tip_velocity_at_contact_m_per_s": "tip velocity at contact",
    "peak_normal_force_N": "peak normal force",
    "peak_normal_force_time_s": "time of the peak",
    "peak_tangential_force_N": "peak tangential force",
    "contact_duration_s": "contact duration",
    "normal_impulse_N_s": "normal impulse",
    "peak_stress_R_Pa": "peak stress at R",
}
"""The numbers with an estimate, by the summary's fields."""


def imprecise(
    summary: Summary,
    errors: Mapping[str, float | tuple[float, float]],
    of_mesh: Mapping[str, float],
    edge_over_patch: float,
) -> tuple[str, ...]:
    """A line that names numbers with relative errors above `CAUTION_ERROR`, and asks for a finer
    mesh where that may remove half of one.

    of_mesh : parts of errors that it may reduce. edge_over_patch : see `mesh_error.Resolution`
    """
    found = _shares(summary, errors)
    names = sorted((name for name in found if found[name] > CAUTION_ERROR), key=found.__getitem__)
    poor = {name: found[name] for name in reversed(names)}
    if not poor:
        return ()
    known = ", ".join(f"{TITLES[name]} {percent(share)}" for name, share in poor.items())
    line = f"estimated errors beyond {percent(CAUTION_ERROR)}: {known}"
    by_mesh = _shares(summary, of_mesh)
    if any(0.5 * poor[name] <= by_mesh.get(name, 0.0) < math.inf for name in poor):
        line += (
            f"; an edge where it touches is {edge_over_patch:.2g} of the patch's radius: ask for a "
            "smaller accuracy or, without one, refine the mesh, there first (solver.fem.tip_size, "
            "or in the mesh's file)"
        )
    return (line,)


def flutter(
    forces: ForceRecord, friction: float, material: Material, edge: float, patch: float
) -> tuple[str, ...]:
    """A caution if an undamped tip slides on a mesh fine enough to show that it flutters.

    edge : edge length at the contact, m. patch : Hertz's radius, m
    """
    normal, tangential = forces.normal_force_N, forces.tangential_force_N
    pushed = normal > 0.5 * normal.max(initial=0.0)
    slides = np.abs(tangential[pushed]) > SLIP_SHARE * friction * normal[pushed]
    damped = friction < FLUTTER_FRICTION or material.relaxation_time > 0.0
    if damped or edge > EDGE * patch or not slides.any():
        return ()
    time_s = RELAXATION_SHARE * patch / material.bar_speed
    return (
        "a sliding elastic tip flutters, and meshes this fine do not converge: of 74 fingers 20 "
        "had a peak or an impulse more than 1 % off, by up to 11 %; set "
        f"material.relaxation_time = {time_s:.2g} (not with hex8-one-point), or leave it and the "
        "element out of a run that is given an accuracy",
    )


def later_taps(forces: ForceRecord, over_s: float) -> tuple[str, ...]:
    """A caution where a run goes on to touch again; over_s : end of its first tap, s."""
    later = forces.time_s[(forces.time_s > over_s) & (forces.normal_force_N > 0.0)]
    if not later.size:
        return ()
    return (
        "estimated errors cover the first tap only: what follows, from"
        f" t = {later[0]:.6g} s on, depends on the vibration it leaves",
    )


def _shares(
    summary: Summary, errors: Mapping[str, float | tuple[float, float]]
) -> dict[str, float]:
    """Relative errors, by name: the largest component over the magnitude of the number."""
    return {
        name: float(np.max(error) / max(np.linalg.norm(getattr(summary, name)), 1e-300))
        for name, error in errors.items()
    }


def unlike_shape(inertia: Array, true: Array) -> tuple[str, ...]:
    """A caution where a phalanx kept its meshed masses (`true_body.mass_factors`).

    inertia, true : (P,), of the meshed bodies and of their shapes, kg m^2
    """
    off = np.abs(inertia / true - 1.0)
    worst = int(np.argmax(off))
    if off[worst] <= INERTIA_OFF:
        return ()
    return (
        f"the mesh of phalanx {worst + 1} is so coarse that its moment of inertia is"
        f" {percent(off[worst])} off: reduce solver.fem.axial_size and section_size",
    )


def flight_doubts(
    errors: FlightErrors, flight: Flight, how: str, approach_speed: float, unlike: tuple[str, ...]
) -> tuple[str, ...]:
    """A caution where the true body comes to another touch, unless its masses may explain that, or
    a flight magnifies its start or omits too much of a tap.

    how : `Settings.flight`. unlike : of `unlike_shape`.
    """
    if errors.of_speed == math.inf:  # nothing is known of another touch
        return unlike or (ELSEWHERE,)
    doubts = unlike
    if (by := magnified(flight)) >= MAGNIFIED:
        what = percent(by) if by < math.inf else "an unknown share"
        doubts += (MAGNIFIES.format(CHANGE, what),)
    left = errors.omitted.share(IMPULSE, approach_speed)
    if left <= LARGEST_LEFT_OUT:
        return doubts
    share = percent(left) if left < math.inf else "an unknown share"
    # on a coarse mesh, and on any after many periods, the phase of the ringing is arbitrary
    rings = errors.omitted.ringing_speed > LARGEST_LEFT_OUT * approach_speed
    remedy = REMEDY["coarse" if rings and how == "rigid" else how]
    return *doubts, RINGS.format(share, remedy)


def percent(share: float) -> str:
    """A share as text, in per cent with two digits; "unknown" if infinite."""
    if share == math.inf:
        return "unknown"
    if share > 10.0:
        return "more than 1000 %"
    return f"{100 * share:.2g} %" if share < 0.995 else f"{100 * share:.0f} %"
