"""Static equilibrium of the beams under dead loads, by Newton's method in steps of the load."""

import numpy as np

from hcm.arrays import Floats, Ints
from hcm.assembly.equations import residual, tangent
from hcm.beam.banded_ldl import HALF_BANDWIDTH, factorize, solve, storage
from hcm.beam.chain import Chain
from hcm.contact.law import IN_FLIGHT, ContactLaw

NOWHERE = ContactLaw(1.0, 1.0, 0.75, 0.0, 1e3)  # a surface out of reach
STATIC = 1e12  # weight of the stiffness, beside which the mass is negligible
LOAD_STEPS, ITERATIONS = 20, 100  # most iterations in a step
CHANGE_TOLERANCE = 1e-11  # largest change of the scaled unknowns in the last iteration


def equilibrium(chain: Chain, start: Floats, held: Ints, load: Floats) -> Floats:
    """Coordinates q (n,) with K(q) q = `load` in all rows but `held`, which stay as in `start`.

    chain : without torques; `load` replaces its weight.
    start : (n,), where the load's first step begins.
    held : (k,), places of coordinates, and of the multipliers that would hold them.
    load : (n,), generalized forces, of which an equal part is added in every step.

    Raises ArithmeticError: Newton's method does not converge.
    """
    w, q, still, rows = HALF_BANDWIDTH, start.copy(), np.zeros_like(start), storage(start.size)
    change = np.zeros(w + q.size)  # as `banded_ldl.solve` takes it
    for share in np.linspace(0.0, 1.0, LOAD_STEPS + 1)[1:]:
        loaded = chain._replace(weight=share * load)
        for _ in range(ITERATIONS):
            residual(q, still, still, loaded, IN_FLIGHT, NOWHERE, change[w:])
            tangent(q, STATIC, 0.0, loaded, IN_FLIGHT, NOWHERE, rows)
            change[w:] *= -STATIC * chain.scale
            for i in held:  # its row and its column become those of the identity
                below = np.arange(min(w + 1, q.size - i))
                rows[w + i + below, w - below] = rows[w + i] = 0.0
                rows[w + i, w], change[w + i] = 1.0, 0.0
            usable = factorize(rows)
            solve(rows, change)
            q += chain.scale * change[w:]
            if usable and np.abs(change).max() < CHANGE_TOLERANCE:
                break
        else:
            raise ArithmeticError(f"no equilibrium at {share:g} of the load")
    return q
