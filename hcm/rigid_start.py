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

from hcm.layout import Chain, Floats
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
    hinge, speed = np.zeros(2), np.zeros(2)
    for phalanx, place, angle, rate in zip(
        finger.phalanges, chain.hinge_outer, start.angles, start.rates, strict=True
    ):
        along = np.array([-math.cos(angle), -math.sin(angle)])
        across = rate * np.array([math.sin(angle), -math.cos(angle)])
        for i in range(phalanx.elements + 1):
            s, node = i * phalanx.length / phalanx.elements, int(place) + 4 * i
            q[node : node + 4] = *(hinge + s * along), *along
            v[node : node + 4] = *(speed + s * across), *across
        hinge, speed = hinge + phalanx.length * along, speed + phalanx.length * across
    return q, v
