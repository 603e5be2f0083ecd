"""A patch in shear, which is softer along the normal.

By statics at finite strain (`build`), with F_t/F_n up to `MOST_SHEAR`,

    u_Y += e p F_n,      p = (F_t/F_n)^2.

In restitution this yield is part of the contact, as all of the tip's, and e*^2 times as large.
Where the tip sticks as it turns back, F_t still changes with the tip's X, and the part of u_Y. that
is due to it falls to e*^2 times its value. If |F_t| grows the tip would turn back again at once. So
there

    u_Y += e*^2 e p F_n + h X + a constant,      h = (1 - e*^2) e 2 F_t/F_n dF_t/dX at the reversal,

by which u_Y. is continuous; where it sticks and turns again, h changes by as much as there is then.
dF_t/dX is the tip's, its compliance included, if all of the patch sticks. Where |F_t| falls, and as
the stick ends, h = 0 and u_Y alone is continuous.
"""

import math

from hcm.compiled import kernel
from hcm.contact.law import ContactState
from hcm.contact.round_tip import RoundTipLaw, strain_share

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
    """Way by which u_Y grows but for h X, m, and its derivatives by F_t and F_n, m/N."""
    if not fn > 0.0:
        return contact.shear_ref, 0.0, 0.0
    e, (p, slope) = strain_share(contact, law) * law.softening, shear_share(ft / fn)
    return contact.shear_ref + e * p * fn, e * slope, e * (p - slope * ft / fn)
