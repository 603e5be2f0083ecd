"""Beams of few elements divided into more: the same curve, at other nodes.

The nodes (r, r') of the many at the share x of one of the few are its static shapes there,
r = N(x) q, r' = T(x) q (`hcm.beam.refinement`). Where n elements become m n, their curve is the
same, shear included, as a piece of a static shape is one.
"""

from dataclasses import replace

import numpy as np

from hcm.arrays import Floats
from hcm.assumptions import Assumptions
from hcm.beam.chain import Chain
from hcm.beam.refinement import beams_of, shapes, shear_number
from hcm.parameters import Finger, Settings


def flight_elements(finger: Finger, settings: Settings) -> Finger:
    """The finger with its elements of an elastic flight."""
    most = settings.flight_elements
    if settings.flight == "rigid" or not most:
        return finger
    return Finger(tuple([replace(p, elements=min(p.elements, most)) for p in finger.phalanges]))


def divided(
    values: Floats, few: Finger, many: Finger, chain: Chain, assumptions: Assumptions
) -> Floats:
    """Nodal coordinates or velocities (m, n) on the elements of `many`, multipliers zero.

    Parameters
    ----------
    values : (m, n) bordered, on the elements of `few`.
    chain : of `many`.
    """
    out, place = np.zeros((len(values), chain.scale.size)), 0
    beams = beams_of(few, assumptions).phalanges
    for beam, fine, first in zip(beams, many.phalanges, chain.hinge_outer, strict=True):
        count, parts = beam.elements, np.arange(fine.elements + 1) * beam.elements
        element = np.minimum(parts // fine.elements, count - 1)
        axis, turn = shapes(
            parts / fine.elements - element, beam.length / count, shear_number(beam, assumptions)
        )
        # r and r' of both ends, X and Y
        nodes = values[:, place + 2 : place + 6 + 4 * count].reshape(-1, 2 * count + 2, 2)
        ends = nodes[:, 2 * element[:, None] + np.arange(4)]
        own = np.einsum("kis,msic->mskc", np.stack([axis, turn]), ends)
        out[:, first : first + 4 * parts.size] = own.reshape(-1, 4 * parts.size)
        place += 6 + 4 * count
    return out
