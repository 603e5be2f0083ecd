"""Joint torque on a node's slope (paper, eqs. 12-14).

The torque tau does the work tau dtheta on the slope's angle theta = atan2(r'_Y, r'_X), so its
generalized force on (r'_X, r'_Y) is tau grad(theta) = tau (-r'_Y, r'_X)/|r'|^2.
"""

from __future__ import annotations

import math

from hcm.compiled import kernel


@kernel
def torque_force(tau: float, sx: float, sy: float) -> tuple[float, float]:
    """Generalized force on the slope (sx, sy), N m."""
    f2 = sx * sx + sy * sy
    return -tau * sy / f2, tau * sx / f2


@kernel
def torque_tangent(tau: float, sx: float, sy: float) -> tuple[float, float]:
    """Derivatives of the generalized force, N m: (d/dsx of its X part, d/dsy of its X part).

    The Hessian of theta is symmetric and has no trace: the other two follow.
    """
    f4 = (sx * sx + sy * sy) ** 2
    return 2.0 * tau * sx * sy / f4, tau * (sy * sy - sx * sx) / f4


@kernel
def turned_angle(sx0: float, sy0: float, sx1: float, sy1: float) -> float:
    """Angle from slope 0 to slope 1, rad, in (-pi, pi]; times tau it is the torque's work."""
    return math.atan2(sx0 * sy1 - sy0 * sx1, sx0 * sx1 + sy0 * sy1)


@kernel
def turn_rate(sx: float, sy: float, vx: float, vy: float) -> float:
    """Rate of the angle of the slope (sx, sy), rad/s, whose own rate is (vx, vy)."""
    return (sx * vy - sy * vx) / (sx * sx + sy * sy)
