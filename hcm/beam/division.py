"""Divide beams of few elements into more: the same curve, with other nodes.

A node (r, r') of the many elements, at a share x of one of the few, takes its static shapes there,
r = N(x) q, r' = T(x) q (`hcm.beam.refinement`). If n elements become m n, their curve is the same,
shear included, as a piece of a static shape is a static shape.
"""

from dataclasses import replace

import numpy as np

from hcm.arrays import Floats, Ints
from hcm.assumptions import Assumptions
from hcm.beam.chain import Chain
from hcm.beam.refinement import beams_of, shapes, shear_number
from hcm.compiled import entry_with
from hcm.parameters import Finger, Settings


def flight_elements(finger: Finger, settings: Settings) -> Finger | None:
    """The finger with the elements of a flight of its own; None: those of the taps throughout."""
    most = settings.flight_elements
    if settings.flight == "rigid" or not (most or settings.flight == "modal"):
        return None
    few = [replace(p, elements=min(p.elements, most or p.elements)) for p in finger.phalanges]
    return Finger(tuple(few))


def divided(
    values: Floats, few: Finger, many: Finger, chain: Chain, assumptions: Assumptions
) -> Floats:
    """Nodal coordinates or velocities (m, n) on the elements of `many`, multipliers zero.

    values : (m, n) bordered, on the elements of `few`. chain : of `many`.
    """
    out = np.zeros((len(values), chain.scale.size))
    beams = beams_of(few, assumptions).phalanges
    counts = np.array([[p.elements for p in body.phalanges] for body in (few, many)])
    phi = np.array([shear_number(beam, assumptions) for beam in beams])
    divide(values, counts, np.array([p.length for p in beams]), phi, out)
    return out


@entry_with()
def divide(values: Floats, counts: Ints, lengths: Floats, phi: Floats, out: Floats) -> None:
    """Fill `out` of `divided`, zeros; counts : (2, P) elements before and after. lengths : (P,) of
    the beams, m. phi : (P,) Phi of the elements before (`hcm.beam.refinement`).
    """
    old = new = 2
    for w in range(lengths.size):
        few, many = counts[0, w], counts[1, w]
        for i in range(many + 1):
            element = min(i * few // many, few - 1)
            axis, turn = shapes(i * few / many - element, lengths[w] / few, phi[w])
            at, to = old + 4 * element, new + 4 * i
            for m in range(len(values)):
                for c in range(2):
                    for k in range(4):
                        out[m, to + c] += axis[k] * values[m, at + 2 * k + c]
                        out[m, to + 2 + c] += turn[k] * values[m, at + 2 * k + c]
        old, new = old + 4 * few + 6, new + 4 * many + 6
