"""The contact law of a scene: the paper's lumped one, or that of a round tip.

Closed form of the tip's compliance between the beam's end and the half-space, from finite-element
statics (a Hertz-shaped pressure on a patch of radius b, less the compliance of the half-space and
of the cantilever from a section R behind C, for b^2 -> 0), known to 0.03, 0.05 and 0.1:

    E R c_nn = -0.15 + 0.55 (nu - 0.4),  E R c_nt = 0.34 + 0.4 (nu - 0.4),
    E R c_tt = (1.6 + 2.6 (nu - 0.4)) cos(alpha),       alpha from the vertical to the last phalanx.

For a tip that deforms, known to 0.05 (e: 0.1), with effects that are of the order of a/R, as C is:

    E R c_nn += 0.015 + 0.15 (nu - 0.4) + 0.22 cos^2(alpha),      E R c_nt -= 0.28 cos(alpha),
    E R e = 0.25.

-  A patch of a/R = 0.13 to 0.28: c_nn = -0.235 + 0.05 cos^2(alpha) + 0.7 (nu - 0.4), by statics.
-  St. Venant-Kirchhoff's law softens under pressure: +0.23 for all nu, by statics of a half-ball on
   a rod at finite strain (which at alpha = 0 agree with these first two effects to 0.02).
-  Parts between contact and centre lag: c_nn -0.13 + 0.17 cos^2(alpha), by the linear response of
   a free phalanx to a half-sine force, in finite elements less that of this model's beam.
-  They lag along the surface too: c_nt -0.16, -0.19 and -0.17 at 30, 45 and 60 degrees, by least
   squares to pulses ~ sin^(3/2) that rise in 6 and 10 R/c on the same phalanx, less statics on the
   same patch. With what statics for b^2 -> 0 have less than 0.34 at these angles (0, 0.01, 0.05)
   that is 0.31, 0.29, 0.26 of cos(alpha) (0.28, 0.26, 0.22 at nu = 0.3).
-  Friction softens the patch further, u_Y = g + .. + e F_t^2/F_n: E R e = 0.19 to 0.22 at a/R of
   0.1, 0.3 at 0.2, 0.36 at 0.3, by statics of a half-ball that slides at mu = 0.6 (0.26 at 1 as at
   0.5).

On larger patches c_nt is smaller by linear statics of a sliding half-ball (0.28, 0.23 and 0.15 at
a/R = 0.12, 0.2 and 0.28; 45 degrees, nu = 0.4; 0.2 at 57), which finite strain gives back (0.01 to
0.04, 0.16 and 0.31; 0.12 at 57 degrees, 0.14 and 0.17 at nu = 0.3 and 0.48): neither is included.

With a patch that grows, E R c_nn += 0.28 (a/R - 0.28), to 0.01 of the same axisymmetric statics at
finite strain for a/R 0.13 to 0.35 and nu = 0.4 (slopes 0.24 and 0.31 at nu = 0.3 and 0.48, a/R 0.2
to 0.4, where it is 0.03 higher and 0.01 lower); beyond 0.41 no equilibrium was found.

A neo-Hookean tip (material.law) stiffens where St. Venant-Kirchhoff's softens. By the same statics
E R c_nn of a tip that deforms has -0.22 - 0.2 (nu - 0.4) besides, does not grow with the patch
(-0.175 within 0.007 for a/R 0.09 to 0.41 at nu = 0.4, alpha = 0; -0.19 and -0.145 within 0.015 at
0.3 and 0.48), and E R e = 0 (-0.03 at a/R = 0.2, 0.06 at 0.28; 45 degrees). c_nt gets back 0.10 and
0.2 of what a patch of a/R = 0.2 and 0.28 takes, 0.06 and 0.1 less than with the other law: it has
-0.1 cos(alpha) besides, and c_tt -0.45 cos(alpha), as a tip that sticks gives way by so much less
along the surface (0.4, 0.36 and 0.56 at 30, 45 and 60 degrees, nu = 0.4, 0.43 at 30 and 0.49, in
the mean of a/R 0.2 to 0.3; 0.1 each).

For a tip that radiates, by a least-squares fit of c F - D F. to pulses F ~ sin^(3/2) on the same
free phalanx that rise in 5 to 11 R/c, c = sqrt(E/rho) (0.07 and 0.02 about the means of 20 to 60
degrees, a/R 0.15 to 0.4, nu 0.3 to 0.48; D grows with the rise, from 0.13 to 0.29):

    D = 0.22/(E c),     E R c_nn -= 0.06,

the second because the lag above, fitted to the rise of a pulse alone, contains a share of D.
"""

import math
from typing import NamedTuple

import numpy as np

from hcm.arrays import Floats
from hcm.assumptions import Assumptions
from hcm.beam.refinement import touching_height
from hcm.contact.contract import Law
from hcm.contact.law import contact_law
from hcm.contact.round_tip import MEMORY, RoundTipLaw
from hcm.parameters import NEO_HOOKE, SAINT_VENANT, Finger, MaterialLaw, Phalanx, Surface, Tip

# Springs from the middle of the patch to a distance of R, denser towards the middle: x_i/R is the
# square of i/SPRINGS, so that a patch of any size has sqrt(a/R) of them, and its edge a width of
# 2 sqrt(R/a)/SPRINGS over a.
SPRINGS = 200
# Largest a/R of the round end's statics at finite strain; largest strain, and least length over
# diameter, for which the stress at mid-length is the solids' to 5 % (seen over 128 fingers).
LARGEST_PATCH, LARGEST_STRAIN, SHORTEST = 0.41, 0.05, 2.5
# The a/R at which a patch that grows has the E R c_nn of a tip that deforms (above).
GROWN = 0.28


class FiniteStrain(NamedTuple):
    """What a law's finite strain adds to a tip that deforms (above).

    compliance, by_poisson : E R c_nn at a/R = GROWN, alpha = 90 degrees and nu = 0.4, and its slope
    over nu. growth : its slope over a/R. softening : E R e. across, along : E R c_nt and
    E R c_tt over cos(alpha), with the parts' lag.
    """

    compliance: float
    by_poisson: float
    growth: float
    softening: float
    across: float
    along: float


FINITE_STRAIN: dict[MaterialLaw, FiniteStrain] = {
    SAINT_VENANT: FiniteStrain(0.015, 0.15, growth=0.28, softening=0.25, across=-0.28, along=0.0),
    NEO_HOOKE: FiniteStrain(-0.205, -0.05, growth=0.0, softening=0.0, across=-0.38, along=-0.45),
}
# E c D of a tip that radiates, and what is subtracted from E R c_nn.
RADIATION, RADIATED = 0.22, 0.06
# Friction towards the hinge, over F_n, beyond which a tap has a caution.
# c_nt holds for friction away from the hinge, where the patch's and finite strain's effects cancel.
PULLED = 0.1
# F_t over its limit below which a tip sticks, and the share of a/R by which peaks of F_t of
# neo-Hookean tips that stick are low at most (0 to 0.37 seen on nine fingers, a/R 0.07 to 0.4, up
# to 9 %; with St. Venant-Kirchhoff's law within 3 %), said from the tolerance of the study on.
STUCK, LOW_TANGENTIAL, SAID = 0.9, 0.4, 0.02
# Relaxation time over a tap's duration: up to which damped taps were compared with solids, and from
# which a contact that it does not damp has a caution (the soft finger's peak is then 2 % off).
RELAXED, UNDAMPED = 0.2, 0.005
# Where the closed form of the tip's compliance was compared with statics: nu, and degrees.
NU_CHECKED, ANGLES_CHECKED = (0.3, 0.49), (15.0, 62.0)
STEEPER = "raise surface.height for a steeper touch"


def law_of(finger: Finger, surface: Surface, tip: Tip, assumptions: Assumptions) -> Law:
    """The law of a scene's contact, its memory empty."""
    lumped = contact_law(surface, tip)
    if not (assumptions.has("lowest_point") or assumptions.has("hertz")):
        return lumped
    last = finger.phalanges[-1]
    radius, nu = last.diameter / 2, last.poisson_ratio or 0.0
    plane_strain_modulus = _plane_strain_modulus(last)
    effective_shear_modulus = 2 * last.youngs_modulus / ((1 + nu) * (2 - nu))
    hertz, partial = assumptions.has("hertz"), assumptions.has("partial_slip")
    edges = radius * np.linspace(0.0, 1.0, (SPRINGS if partial else 0) + 1) ** 2
    width = np.diff(edges)
    # the mean of x^2/R over a spring's width
    depth = np.diff(edges**3) / (3 * radius * width)
    return RoundTipLaw(
        k=4 / 3 * plane_strain_modulus * math.sqrt(radius) if hertz else lumped.k,
        restitution=lumped.restitution,
        tangential_ratio=(
            effective_shear_modulus / plane_strain_modulus if partial else lumped.tangential_ratio
        ),
        mu=lumped.mu,
        height=touching_height(finger, surface, assumptions),
        radius=radius,
        lowest=assumptions.has("lowest_point"),
        hertz=hertz,
        growth=_growth(last, assumptions),
        plane_strain_modulus=plane_strain_modulus,
        effective_shear_modulus=effective_shear_modulus,
        tangential_stiffness=lumped.k * lumped.tangential_ratio,
        compliance=_compliance(last, tip, assumptions),
        softening=_softening(last, assumptions),
        radiation=_radiation(last, assumptions),
        relaxation=last.relaxation_time if hertz else 0.0,
        springs=np.zeros(width.size),
        depth=depth,
        width=width,
        memory=np.zeros(MEMORY),
    )


def beyond_checks(
    last: Phalanx, tip: Tip, assumptions: Assumptions, angle: float, peak: float, stress: float,
    pull: float,
) -> tuple[str, ...]:  # fmt: skip
    """Cautions about a tap: a closed form out of its range, friction towards the hinge, a patch
    that is large or reaches the shaft, a beam's stress that may differ from a solid's.

    angle : of the last phalanx below the horizontal at the touch, rad. peak : of F_n, N. stress :
        the peak at R, Pa. pull : F_t when F_n is largest, positive towards the hinge, N.
    """
    found, nu, degrees = [], last.poisson_ratio or 0.0, math.degrees(angle)
    given = None not in (tip.compliance_nn, tip.compliance_nt, tip.compliance_tt)
    checked = (
        (nu, NU_CHECKED, "poisson_ratio {}"),
        (degrees, ANGLES_CHECKED, "last phalanges {} degrees below the horizontal"),
    )
    beyond = [
        text.format(f"{low:g} to {high:g}") + f", not {value:.4g}"
        for value, (low, high), text in checked
        if not low <= value <= high
    ]
    if assumptions.has("tip_compliance") and not given and beyond:
        found.append(
            f"the tip's compliance is a closed form that was checked for {' and '.join(beyond)}:"
            " state tip.compliance_nn, .." + f", or {STEEPER}" * (degrees < ANGLES_CHECKED[0])
        )
    crosses = assumptions.has("tip_compliance") and tip.compliance_nt is None
    if crosses and pull > PULLED * peak:
        found.append(
            f"friction pulls the tip towards its hinge ({pull / peak:.2g} of the normal force), for"
            " which the tip's compliance is not known"
        )
    if assumptions.has("lowest_point"):
        patch, strain = patch_size(last, peak), abs(stress) / last.youngs_modulus
        if strain > LARGEST_STRAIN or last.length < SHORTEST * last.diameter:
            found.append(
                f"the stress at R is a beam's and may be more than 5 % off the reference's: strain"
                f" {100 * strain:.2g} % (checked to {100 * LARGEST_STRAIN:g}), a last phalanx of"
                f" {last.length / last.diameter:.2g} diameters (from {SHORTEST:g} on)"
            )
        found += patch_cautions(patch, angle)
    return tuple(found)


def patch_size(last: Phalanx, force: float) -> float:
    """Hertz's a/R at a normal force, N."""
    return float(np.cbrt(0.75 * force / _plane_strain_modulus(last) / (last.diameter / 2) ** 2))


def sticking_cautions(
    last: Phalanx, surface: Surface, assumptions: Assumptions, normal: float, tangential: float
) -> tuple[str, ...]:
    """Caution about a neo-Hookean tip's peak of F_t. normal, tangential : forces at the peak, N."""
    stiffens = last.material_law == NEO_HOOKE and assumptions.has("deforming_tip")
    sticks = abs(tangential) < STUCK * surface.friction * normal
    low = LOW_TANGENTIAL * patch_size(last, normal)
    if not (stiffens and sticks and low >= SAID):
        return ()
    return (
        f"the peak of F_t may be up to {100 * low:.0f} % low: a neo-Hookean tip that sticks is"
        " stiffer along the surface than its statics account for",
    )


def patch_cautions(patch: float, angle: float) -> tuple[str, ...]:
    """Cautions about a patch that is large or reaches the shaft.

    patch : its radius a/R. angle : of the last phalanx below the horizontal at the touch, rad.
    """
    found = []
    if patch > LARGEST_PATCH:
        found.append(
            f"the patch's radius reaches {patch:.2f} of the tip's, and the tip's statics were"
            f" checked to {LARGEST_PATCH:g}: use a stiffer material or a slower impact"
        )
    if patch > math.sin(angle):
        found.append(
            "the patch reaches the shaft, which touches at an angle of"
            f" {math.degrees(angle):.0f} degrees: the tip is not a sphere there;"
            f" {STEEPER}"
        )
    return tuple(found)


def relaxation_cautions(
    last: Phalanx, assumptions: Assumptions, duration: float
) -> tuple[str, ...]:
    """Cautions about a material that relaxes for a good part of the tap's duration, s."""
    share = last.relaxation_time / duration
    of = f"relaxation_time is {share:.2g} of the tap's duration"
    if assumptions.has("hertz"):
        checked = f"{of}: damped taps were compared with finite elements up to {RELAXED:g}"
        return (checked,) if share > RELAXED else ()
    undamped = (
        f"{of}, and damps the beams alone, not this contact, whose peak rises with it while a"
        " solid's falls: use assumptions = 'refined'"
    )
    return (undamped,) if share > UNDAMPED else ()


def _plane_strain_modulus(last: Phalanx) -> float:
    """E*, Pa."""
    return last.youngs_modulus / (1 - (last.poisson_ratio or 0.0) ** 2)


def _growth(last: Phalanx, assumptions: Assumptions) -> float:
    """s, 1/m: s d^2 = growth (a/R) F_n/(E R) with Hertz's F_n and a^2 = R d."""
    if not assumptions.has("growing_patch"):
        return 0.0
    growth, nu = FINITE_STRAIN[last.material_law].growth, last.poisson_ratio or 0.0
    return 8 * growth / (3 * (1 - nu**2) * last.diameter)


def _radiation(last: Phalanx, assumptions: Assumptions) -> float:
    """D, m s/N."""
    if not assumptions.has("radiating_tip"):
        return 0.0
    return RADIATION / (last.youngs_modulus * math.sqrt(last.youngs_modulus / last.density))


def _softening(last: Phalanx, assumptions: Assumptions) -> float:
    """e, m/N."""
    if not assumptions.has("deforming_tip"):
        return 0.0
    return FINITE_STRAIN[last.material_law].softening / (last.youngs_modulus * last.diameter / 2)


def _compliance(last: Phalanx, tip: Tip, assumptions: Assumptions) -> Floats:
    """c_nn and c_nt at alpha = 90 degrees, c_tt/cos(alpha), and the factors of cos^2(alpha) in c_nn
    and of cos(alpha) in c_nt, for a patch of zero size, m/N; zeros without `tip_compliance`.
    """
    if not assumptions.has("tip_compliance"):
        return np.zeros(5)
    over = (last.poisson_ratio or 0.0) - 0.4
    closed = (-0.15 + 0.55 * over, 0.34 + 0.4 * over, 1.6 + 2.6 * over)
    given = (tip.compliance_nn, tip.compliance_nt, tip.compliance_tt)
    numbers = [form if own is None else own for own, form in zip(given, closed, strict=True)]
    finite = FINITE_STRAIN[last.material_law]
    normal = finite.compliance + finite.by_poisson * over
    deforming = (normal, 0.0, finite.along, 0.22, finite.across)
    sizes = np.array([*numbers, 0.0, 0.0])
    if assumptions.has("deforming_tip"):
        sizes += deforming
    if assumptions.has("growing_patch"):
        sizes[0] -= finite.growth * GROWN
    if assumptions.has("radiating_tip"):
        sizes[0] -= RADIATED
    return sizes / (last.youngs_modulus * last.diameter / 2)
