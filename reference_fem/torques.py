"""Torques over time: linear between the times of a table, held before the first and after the last.

Two equal times are a jump, at which the later row takes over. The explicit loop samples them at its
steps; the rigid flight is integrated from kink to kink.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from reference_fem.arrays import Array

# Points of a Gauss rule for the angles of a rigid flight between two kinks.
POINTS = 32


@dataclass(frozen=True)
class Torques:
    """Torques on P joints or bodies.

    times : (n,), s, in rising order; two equal ones make a jump
    values : (n, P), N·m
    """

    times: Array
    values: Array

    def __truediv__(self, symmetry_factor: int) -> "Torques":
        """Torques on the meshed part of a body that is `symmetry_factor` times as large."""
        return replace(self, values=self.values / symmetry_factor)

    def with_reactions(self) -> "Torques":
        """Torques on bodies whose joints react on the body before."""
        values = self.values.copy()
        values[:, :-1] -= self.values[:, 1:]
        return replace(self, values=values)

    def at(self, time_s: float, *, before: bool = False) -> Array:
        """Torques at a time, (P,); at a jump those after it, or, with `before`, before it."""
        times, values = self.times, self.values
        n = int(np.searchsorted(times, time_s, side="left" if before else "right"))
        if n == 0 or n == times.size:
            return values[min(n, times.size - 1)]
        share = (time_s - times[n - 1]) / (times[n] - times[n - 1])
        return (1.0 - share) * values[n - 1] + share * values[n]

    @property
    def steady(self) -> bool:
        """Whether the torques never change."""
        return self.times.size == 1

    def pieces(self, begin_s: float, end_s: float) -> Iterator[tuple[float, float, Array, Array]]:
        """Pieces between kinks: begin and end, s, torques at the begin (P,) and rates, N·m/s."""
        inside = np.unique(self.times[(self.times > begin_s) & (self.times < end_s)])
        for begin, end in pairwise([begin_s, *inside.tolist(), end_s]):
            first = self.at(begin)
            yield begin, end, first, (self.at(end, before=True) - first) / (end - begin)

    def torque_change_work(
        self, angles_at: Callable[[float], Array], begin_s: float, end_s: float
    ) -> float:
        """∫ θ dT over changes at begin_s < time <= end_s, J: the torques' work is [T θ] less this.

        angles_at : the angles (P,) at a time, rad
        """
        if end_s <= begin_s:
            return 0.0
        nodes, weights = np.polynomial.legendre.leggauss(POINTS)
        total = 0.0
        for begin, end, _, rate in self.pieces(begin_s, end_s):
            half = 0.5 * (end - begin)
            if rate.any():
                for node, weight in zip(nodes, weights, strict=True):
                    total += half * weight * float(rate @ angles_at(begin + half * (1.0 + node)))
            jump = self.at(end) - self.at(end, before=True)
            if jump.any():
                total += float(jump @ angles_at(end))
        return total
