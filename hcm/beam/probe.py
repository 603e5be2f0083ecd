"""Where the stress at section R, mid-length of the last phalanx, is read.

The paper's model reads it at R itself, where the curvature of cubic elements of length l is wrong
by -l^2 k''/12 at a node and by l^2 k''/24 in the middle of an element. It is most accurate at an
element's two Gauss points (Barlow, Int. J. Numer. Methods Eng. 10, 1976): the refined model reads
it at the four of them nearest to R, as the cubic through them.

Cauchy's stress in a St. Venant-Kirchhoff rod under the model's force and moment, as a linear fit
over the section gives it at the round surface, is to second order in the stretching strain e and
the bending strain b

    sigma = E [e + b + (1 + 2 nu) e^2 + (1 + 5 nu) e b + nu b^2/2].
"""

import math
from typing import NamedTuple

import numpy as np

from hcm.arrays import Floats, Ints
from hcm.parameters import Finger

GAUSS_POINTS = 0.5 + np.array([-0.5, 0.5]) / math.sqrt(3.0)  # x/l
NEAREST = 4


class Probe(NamedTuple):
    """Places at which the stress is read, and their shares in it.

    elements : (m,) indices; abscissa : (m,) x/l in each; weights : (m,).
    youngs_modulus : Pa; radius : d/2, m. rigidity : 1/(1 + Phi) of `hcm.beam.refinement`.
    second_order : (3,), the terms above as coefficients of (2 e)^2, 2 e k and k^2, b = -k d/2; zero
        where the stress is E (e + b).
    """

    elements: Ints
    abscissa: Floats
    weights: Floats
    youngs_modulus: float
    radius: float
    rigidity: float
    second_order: Floats


def build_probe(finger: Finger) -> Probe:
    """R itself; where two elements meet there, and r'' jumps, the mean of both sides."""
    last, offset = finger.phalanges[-1], sum(p.elements for p in finger.phalanges[:-1])
    share, middle = math.modf(0.5 * last.elements)
    at = offset + int(middle)
    elements, abscissa = ([at, at], [share, share]) if share else ([at - 1, at], [1.0, 0.0])
    return Probe(
        np.array(elements, dtype=np.int64), np.array(abscissa), np.full(2, 0.5),
        float(last.youngs_modulus), last.diameter / 2, 1.0, np.zeros(3),
    )  # fmt: skip


def smooth_probe(finger: Finger, length: float, rigidity: float, cauchy: bool = False) -> Probe:
    """The `NEAREST` Gauss points about R, at half of `length`, m; the last beam may be shorter.

    cauchy : whether the stress is Cauchy's, for which nu must be known.
    """
    last, offset = finger.phalanges[-1], sum(p.elements for p in finger.phalanges[:-1])
    at = min(0.5 * length / last.length, 1.0) * last.elements
    places = (np.arange(last.elements)[:, None] + GAUSS_POINTS).ravel()
    begin = max(min(int(places.searchsorted(at)) - NEAREST // 2, places.size - NEAREST), 0)
    near = places[begin : begin + NEAREST]
    element = near.astype(np.int64)
    others = [np.delete(near, i) for i in range(near.size)]
    weights = [float(np.prod((at - x) / (own - x))) for own, x in zip(near, others, strict=True)]
    nu, radius = last.poisson_ratio or 0.0, last.diameter / 2
    second = np.array(
        [0.25 * (1.0 + 2.0 * nu), -0.5 * radius * (1.0 + 5.0 * nu), 0.5 * nu * radius**2]
    )
    return Probe(
        offset + element, near - element, np.array(weights), float(last.youngs_modulus),
        radius, rigidity, second if cauchy else np.zeros(3),
    )  # fmt: skip
