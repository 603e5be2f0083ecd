"""The finger's shape at an instant, and how far a phalanx is bent."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hcm.layout import Chain

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Posture:
    """Nodes of every phalanx at time_s: positions (n_w + 1, 2) in m and slopes r' (n_w + 1, 2).

    velocities_m_per_s, slope_rates_per_s : their rates, alike; empty where only the shape is kept.
    """

    time_s: float
    positions_m: tuple[Floats, ...]
    slopes: tuple[Floats, ...]
    velocities_m_per_s: tuple[Floats, ...] = ()
    slope_rates_per_s: tuple[Floats, ...] = ()

    def deflection(self, phalanx: int) -> tuple[Floats, Floats]:
        """Axial position and deflection of the nodes of one phalanx (counted from 0), m.

        Measured in the frame that moves with the phalanx's first node and its tangent; a positive
        deflection is away from the surface (to the right of r', the finger pointing to -X).
        """
        arm = self.positions_m[phalanx] - self.positions_m[phalanx][0]
        tx, ty = self.slopes[phalanx][0] / np.linalg.norm(self.slopes[phalanx][0])
        return arm @ np.array([tx, ty]), arm @ np.array([ty, -tx])

    @property
    def is_concave(self) -> bool:
        """Whether the hinges lie below the line from the fixed hinge to the tip."""
        end = self.positions_m[-1][-1]
        hinges = np.array([nodes[0] for nodes in self.positions_m[1:]])
        side = end[0] * hinges[:, 1] - end[1] * hinges[:, 0]
        return bool(side.sum() > 0)


def postures(
    chain: Chain, times: Sequence[float], q: Floats, v: Floats | None = None
) -> tuple[Posture, ...]:
    """Read postures off bordered nodal coordinates q (m, n), with their rates off v if given.

    Their arrays are views of q and v.
    """
    ends = [*chain.hinge[1:].tolist(), q.shape[1]]
    places = list(zip(chain.hinge_outer.tolist(), ends, strict=True))

    def split(bordered: Floats) -> list[Floats]:
        return [bordered[:, a:b].reshape(len(bordered), (b - a) // 4, 4) for a, b in places]

    shapes, rates = split(q), split(v) if v is not None else []
    return tuple(
        Posture(
            time,
            tuple([nodes[i, :, :2] for nodes in shapes]),
            tuple([nodes[i, :, 2:] for nodes in shapes]),
            tuple([nodes[i, :, :2] for nodes in rates]),
            tuple([nodes[i, :, 2:] for nodes in rates]),
        )
        for i, time in enumerate(times)
    )
