"""A motion that starts from straight, unstrained phalanges instead of from rest along -X.

Phalanx w, turned by theta_w from -X, has the tangent t = (-cos theta, -sin theta) and, turning at
omega_w, the nodes

    r(s) = r_w + s t,     r' = t,     v(s) = v_w + s omega n,     v' = omega n,
    n = e_z x t = (sin theta, -cos theta),

r_w and v_w being the end of the phalanx before: the hinges hold at once in position and velocity.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hcm.arrays import Floats
from hcm.beam.chain import Chain
from hcm.compiled import kernel
from hcm.parameters import Finger, ParameterError


@dataclass(frozen=True)
class RigidStart:
    """A rigid state of the finger.

    Parameters
    ----------
    angles : theta_w, rad, counter-clockwise from the rest along -X, one per phalanx.
    rates : omega_w, rad/s, absolute, one per phalanx.
    time_s : time of that state, s, 0 or above.
    """

    angles: tuple[float, ...]
    rates: tuple[float, ...]
    time_s: float = 0.0

    def __post_init__(self) -> None:
        for field in ("angles", "rates"):
            values = getattr(self, field)
            if not all(math.isfinite(value) for value in values):
                raise ParameterError(f"start.{field} = {values!r}: must be finite numbers")
        if not (math.isfinite(self.time_s) and self.time_s >= 0):
            raise ParameterError(f"start.time_s = {self.time_s!r}: must be 0 or above, in s")


def rigid_motion(finger: Finger, chain: Chain, start: RigidStart) -> tuple[Floats, Floats]:
    """Bordered coordinates q and velocities v (n,) of a rigid state.

    Raises
    ------
    ParameterError
        There is not one angle and one rate per phalanx.
    """
    count = len(finger.phalanges)
    if len(start.angles) != count or len(start.rates) != count:
        raise ParameterError(
            f"start has {len(start.angles)} angles and {len(start.rates)} rates:"
            f" must be one of each per phalanx ({count})"
        )
    q, v = np.zeros(chain.weight.size), np.zeros(chain.weight.size)
    lengths = np.array([p.length for p in finger.phalanges])
    place(np.array([*start.angles, *start.rates], dtype=float), lengths, chain, q, v)
    return q, v


@kernel
def place(state: Floats, lengths: Floats, chain: Chain, q: Floats, v: Floats) -> None:
    """Write the nodes of rigid phalanges, theta and theta. in `state` (2 P,), to q and v (n,).

    lengths : (P,) of the phalanges, m.
    """
    x, y, vx, vy, links = 0.0, 0.0, 0.0, 0.0, lengths.size
    for w in range(links):
        tx, ty = -math.cos(state[w]), -math.sin(state[w])
        nx, ny = -state[links + w] * ty, state[links + w] * tx
        first = chain.hinge_outer[w]
        last = chain.hinge_inner[w + 1] if w + 1 < links else chain.tip
        for node in range(first, last + 1, 4):
            s = lengths[w] * (node - first) / max(last - first, 1)
            q[node], q[node + 1], q[node + 2], q[node + 3] = x + s * tx, y + s * ty, tx, ty
            v[node], v[node + 1], v[node + 2], v[node + 3] = vx + s * nx, vy + s * ny, nx, ny
        x, y, vx, vy = q[last], q[last + 1], v[last], v[last + 1]
