"""Springs of a patch of which a part slips.

By the method of dimensionality reduction (Popov and Hess 2015, ch. 5) they are at the distances x_i
from the patch's middle, E* and G* stiff per length, G* = 4 G/(2 - nu):

    w_i = d - x_i^2/R >= 0,  u_i. = u_X. where |u_i| < mu (E*/G*) w_i,  F_t = -2 G* c sum dx_i u_i,

2 for both sides, c near 1 but for the first few springs (`evening`). The spring in the middle slips
last: every other one started later, with a limit that grows as fast.
"""

import math

from hcm.compiled import kernel
from hcm.contact.round_tip import INDENTATION, RoundTipLaw

# Largest c of `evening`.
MOST_EVENING = 2.0


@kernel
def slip_limit(i: int, d: float, law: RoundTipLaw) -> float:
    """Largest |u_i| of a spring that sticks, m."""
    return law.mu / law.tangential_ratio * max(d - law.depth[i], 0.0)


@kernel
def spring_displacement(i: int, moved: float, d: float, law: RoundTipLaw) -> tuple[float, float]:
    """(u_i, du_i/dmoved) of a spring that sticks, m; moved : change of the springs' X since the
    last accepted step, m. A spring that touches within the step takes only the part from then on.
    """
    share, before = 1.0, law.memory[INDENTATION]
    if law.depth[i] > before:
        share = (d - law.depth[i]) / (d - before)
    return law.springs[i] + share * moved, share


@kernel
def evening(reach: float, held: float, d: float, law: RoundTipLaw) -> tuple[float, float]:
    """(c, dc/dd), -, 1/m: the factor with which springs at their limits hold mu F_n.

        c sum dx_i w_i = int_0^a w dx = 2/3 a d,      a^2 = R d;

    at most `MOST_EVENING`, while the first spring alone hardly touches.

    reach, held : sums of dx_i, m, and dx_i w_i, m^2, over one side's springs in touch. Without c
    the force would jump, and the mode chatter, where a stick begins slowly.
    """
    a = math.sqrt(law.radius * max(d, 0.0))
    if not 2.0 / 3.0 * d * a < MOST_EVENING * held:
        return MOST_EVENING, 0.0
    c = 2.0 / 3.0 * d * a / held
    return c, (a - c * reach) / held


@kernel
def spring_sums(moved: float, d: float, law: RoundTipLaw) -> tuple[float, float, float, float]:
    """Sum of c dx u over one side's springs in touch (m^2), its derivatives by `moved` and by d
    (m), and the sum of c dx u^2 (m^3); c : of `evening`, moved : as in `spring_displacement`.
    """
    limits = law.mu / law.tangential_ratio
    total, by_way, by_depth, squares, reach, held = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(law.springs.size):
        if law.depth[i] >= d:
            break
        limit, width = slip_limit(i, d, law), law.width[i]
        u, share = spring_displacement(i, moved, d, law)
        if abs(u) > limit:
            u = math.copysign(limit, u)
            by_depth += width * math.copysign(limits, u)
        else:
            by_way += width * share
            if share < 1.0:
                by_depth += width * moved * (1.0 - share) / (d - law.memory[INDENTATION])
        total += width * u
        squares += width * u * u
        reach += width
        held += width * (d - law.depth[i])
    c, growth = evening(reach, held, d, law)
    return c * total, c * by_way, c * by_depth + growth * total, c * squares


@kernel
def springs_loss(moved: float, d0: float, d1: float, law: RoundTipLaw) -> float:
    """What springs that slip dissipate while d changes from d0, of the last accepted step, to d1,
    J; moved : as in `spring_displacement`. A spring slips from where |u_i|, which changes evenly,
    meets its limit, which does as well.
    """
    lost, reach, held = 0.0, 0.0, 0.0
    for i in range(law.springs.size):
        if law.depth[i] >= max(d0, d1):
            break
        before, limit = slip_limit(i, d0, law), slip_limit(i, d1, law)
        u, _ = spring_displacement(i, moved, d1, law)
        excess = abs(u) - limit
        if excess > 0.0:
            free = max(before - math.copysign(law.springs[i], u * law.springs[i]), 0.0)
            begun = before + free / (excess + free) * (limit - before)
            lost += law.width[i] * (begun + limit) * excess
        reach += law.width[i]
        held += law.width[i] * max(d1 - law.depth[i], 0.0)
    return law.effective_shear_modulus * evening(reach, held, d1, law)[0] * lost
