"""The finger's shape at an instant, and how far a phalanx is bent."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np

from hcm.arrays import Floats
from hcm.beam.chain import Chain


@dataclass(frozen=True)
class Posture:
    """Nodes of every phalanx at time_s: positions (n_w + 1, 2) in m and slopes r' (n_w + 1, 2).

    velocities_m_per_s, slope_rates_per_s : their rates, likewise; empty if only the shape is kept.
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
        hinges = np.array([nodes[0] for nodes in self.positions_m[1:]]).reshape(-1, 2)
        side = end[0] * hinges[:, 1] - end[1] * hinges[:, 0]
        return bool(side.sum() > 0)


@dataclass(frozen=True, eq=False)
class Postures(Sequence[Posture]):
    """Postures in rising order of time, each made when it is asked for.

    times_s : (m,). places : `node_places`.
    q, v : (m, n) bordered nodal coordinates, and their rates where these are kept.
    """

    times_s: tuple[float, ...]
    places: tuple[tuple[int, int], ...]
    q: Floats
    v: Floats | None = None

    def __len__(self) -> int:
        return len(self.times_s)

    @overload
    def __getitem__(self, index: int) -> Posture: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Posture, ...]: ...
    def __getitem__(self, index: int | slice) -> Posture | tuple[Posture, ...]:
        """One posture, its arrays views of q and v, or the tuple of several."""
        if isinstance(index, slice):
            return tuple([self[i] for i in range(*index.indices(len(self)))])
        time = self.times_s[index]
        return Posture(
            time,
            *[
                tuple([bordered[index, a:b].reshape(-1, 4)[:, c : c + 2] for a, b in self.places])
                for bordered in (self.q, self.v)
                if bordered is not None
                for c in (0, 2)
            ],
        )


def node_places(chain: Chain) -> tuple[tuple[int, int], ...]:
    """For each phalanx, the place of its first node and the place past its last node."""
    ends = [*chain.hinge[1:].tolist(), chain.tip + 4]
    return tuple(zip(chain.hinge_outer.tolist(), ends, strict=True))
