"""A patch in shear, which is softer along the normal.

By statics at finite strain (`build`), with F_t/F_n up to `MOST_SHEAR`,

    u_Y += e p F_n,      p = (F_t/F_n)^2.
"""

import math

from hcm.compiled import kernel
from hcm.contact.law import ContactState
from hcm.contact.round_tip import (
    NORMAL_FORCE,
    SHEARED,
    TANGENTIAL_FORCE,
    RoundTipLaw,
    strain_share,
)

# Largest F_t/F_n of the study's fingers: the softening goes on along its tangent there.
MOST_SHEAR = 1.2


@kernel
def shear_share(ratio: float) -> tuple[float, float]:
    """(p, dp/dr) of r = F_t/F_n: r^2, and from `MOST_SHEAR` on its tangent."""
    size = abs(ratio)
    least = min(size, MOST_SHEAR)
    return least * (2.0 * size - least), 2.0 * math.copysign(least, ratio)


@kernel
def sheared_way(
    ft: float, fn: float, contact: ContactState, law: RoundTipLaw
) -> tuple[float, float, float]:
    """Way e p F_n, m, of a patch in shear, which is softer, and its derivatives by F_t and F_n,
    m/N; in restitution e*^2 times those, from where it began.
    """
    if not fn > 0.0:
        return law.memory[SHEARED], 0.0, 0.0
    e, (p, slope) = strain_share(contact, law) * law.softening, shear_share(ft / fn)
    return law.memory[SHEARED] + e * p * fn, e * slope, e * (p - slope * ft / fn)


@kernel
def shear_work(after: tuple[float, float], contact: ContactState, law: RoundTipLaw) -> float:
    """Work of F_n on `sheared_way` that is not stored, from the last accepted step to the springs'
    forces `after`, J, by the trapezoid rule.

    int F_n d(e p F_n) = e p F_n^2/2 + e/2 int F_n^2 dp, whose last term is zero while the patch
    slides and of either sign while it sticks. e*^2 e p F_n^2/2 is stored: in compression the rest
    of it is lost.
    """
    ft, fn = law.memory[TANGENTIAL_FORCE], law.memory[NORMAL_FORCE]
    if not after[1] > 0.0:
        return 0.0
    p = shear_share(after[0] / after[1])[0]
    p0 = shear_share(ft / fn)[0] if fn > 0.0 else p
    half, share = 0.5 * law.softening, strain_share(contact, law)
    turned = 0.5 * half * (fn * fn + after[1] ** 2) * (p - p0)
    stored = half * (p * after[1] ** 2 - p0 * fn * fn)
    return share * turned + (share - law.restitution**2) * stored
