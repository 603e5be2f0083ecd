"""Spread edges along a curve: even around the contact point, then in geometric progression.

Nodes are placed where the number of edges since the curve's start is whole, so that a curve may run
through the contact point, and blocks on either side of a corner continue each other's edges.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Division:
    """`count` edges of a curve; `nodes` are the inner nodes' shares of its length; empty: even."""

    count: int
    nodes: tuple[float, ...] = ()

    @property
    def evened(self) -> Division:
        """The same number of even edges."""
        return Division(self.count)

    @property
    def halfway(self) -> Division:
        """Half way between these edges and even ones."""
        even = ((k + 1) / self.count for k in range(self.count))
        shares = (0.5 * (a + b) for a, b in zip(self.nodes, even, strict=False))
        return Division(self.count, tuple(shares))


@dataclass(frozen=True)
class Grading:
    """Edges over their distance d from the contact point, along curves.

        h = fine                       |d| <= even
        h, growth h, growth² h, ...    beyond, up to `coarse`, which then stays

    Positions on either side have different signs.
    """

    fine: float
    growth: float
    even: float
    coarse: float

    @property
    def _steepness(self) -> float:
        return (self.growth - 1.0) / self.fine

    @property
    def _plateau(self) -> float:
        """Distance at which the edges are `coarse`."""
        if self.coarse <= self.fine:
            return self.even
        slope = math.log(self.growth) / (self.growth - 1.0)
        widest = max(self.coarse / slope, self.fine)
        return self.even + (widest - self.fine) / (self.growth - 1.0)

    def edges(self, d: float) -> float:
        """Number of edges from the contact point to d, with the sign of d; not a whole number.

        Within the progression n edges fill the length l = h (g^n - 1)/(g - 1).
        """
        far = abs(d)
        count = min(far, self.even) / self.fine
        if far > self.even:
            ramp = min(far, self._plateau) - self.even
            count += math.log1p(ramp * self._steepness) / math.log(self.growth)
            count += max(far - self._plateau, 0.0) / max(self.coarse, self.fine)
        return math.copysign(count, d)

    def distance(self, edges: float) -> float:
        """Where that many edges end: the inverse of `edges`."""
        many = abs(edges)
        far = min(many * self.fine, self.even)
        left = many - self.even / self.fine
        if left > 0.0:
            rising = min(left, self.edges(self._plateau) - self.even / self.fine)
            far += math.expm1(rising * math.log(self.growth)) / self._steepness
            far += (left - rising) * max(self.coarse, self.fine)
        return math.copysign(far, edges)

    def count(self, start: float, stop: float) -> int:
        """Fewest edges between two positions such that none is longer than asked."""
        return max(1, math.ceil(abs(self.edges(stop) - self.edges(start)) - 1e-9))

    def divide(self, start: float, stop: float, least: int) -> Division:
        """As many edges as asked between two positions, in these proportions; at least `least`."""
        count = max(least, self.count(start, stop))
        first = self.edges(start)
        step = (self.edges(stop) - first) / count
        shares = (
            (self.distance(first + k * step) - start) / (stop - start) for k in range(1, count)
        )
        return Division(count, tuple(shares))


def count_even(length: float, size: float, least: int = 1) -> int:
    """Number of even edges of about `size` on a curve of `length`, at least `least`."""
    return max(least, round(length / size))
