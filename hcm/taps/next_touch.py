"""When a tip that has left its surface would touch again: as a rigid body, and as it vibrates."""

import math

import numpy as np

from hcm.arrays import Floats
from hcm.beam.chain import Chain
from hcm.parameters import Phalanx

# tan x = tanh x: the lowest bending vibration of a beam with one hinged and one free end
HINGED_FREE = 3.926602
SHEAR = 3.0  # E/(kappa G)
LOOKS_A_RADIAN, MOST_LOOKS = 16, 100_000


def next_touch_s(q: Floats, v: Floats, chain: Chain, height: float) -> float:
    """Time, s, until the tip would touch if the last phalanx moved as a rigid body; inf: never.

    With M its elements' masses, X, Y their coordinates (q of one axis) and e those of a shift,

        m = e M e,  v_c = e M V/m,  L = X M V_Y - Y M V_X,  I = X M X + Y M Y,  both less the
        centre's share, gap/-v_y,  v_y = v_cy + L/I (x - x_c) < 0.

    height : of the surface below the hinge, less a round tip's radius, m.
    """
    mass = turn = inertia = 0.0
    shift, momentum = [0.0, 0.0], [0.0, 0.0]
    for e in _last_phalanx(chain):
        x, y = _places(chain, e)
        along = chain.mass[e][0] + chain.mass[e][2]
        mass += float(along[0] + along[2])
        turn += float(q[x] @ chain.mass[e] @ v[y] - q[y] @ chain.mass[e] @ v[x])
        inertia += float(q[x] @ chain.mass[e] @ q[x] + q[y] @ chain.mass[e] @ q[y])
        for axis, places in enumerate((x, y)):
            shift[axis] += float(along @ q[places])
            momentum[axis] += float(along @ v[places])
    turn -= (shift[0] * momentum[1] - shift[1] * momentum[0]) / mass
    inertia -= (shift[0] ** 2 + shift[1] ** 2) / mass
    speed = momentum[1] / mass + turn / inertia * (float(q[chain.tip]) - shift[0] / mass)
    gap = max(float(q[chain.tip + 1]) + height, 0.0)
    return gap / -speed if speed < 0.0 else math.inf


def bent_touches(
    q: Floats, v: Floats, chain: Chain, height: float, phalanx: Phalanx, within_s: float
) -> bool:
    """Whether the tip would touch within a time, s, if the last phalanx also bent.

    By `swings_down` with the lowest vibration of a beam with one hinged and one free end:

        w^2 = (x/l)^4 E I/(rho A)/(1 + (x/l)^2 (1 + E/(kappa G)) I/A),  tan x = tanh x

    l is the length of a beam of the phalanx's mass (a half-ball's, too); the denominator is
    Timoshenko's first correction for rotary inertia and shear (2.8 to 3.1 for E/(kappa G), nu from
    0.3 to 0.5). In the study that foretells 46 of the 48 touches within the time of `TapEndRule`,
    and one that fails to come.
    """
    gap = max(float(q[chain.tip + 1]) + height, 0.0)
    mass = float(chain.mass[_last_phalanx(chain)][:, ::2, ::2].sum())
    length = mass / phalanx.line_density
    square = (HINGED_FREE / length) ** 2
    soft = 1.0 + square * (1.0 + SHEAR) * phalanx.second_moment / phalanx.area
    frequency = square * math.sqrt(phalanx.bending_stiffness / phalanx.line_density / soft)
    return swings_down(gap, *_tip_motion(q, v, chain, length), frequency, within_s)


def swings_down(
    gap: float, speed: float, bent: float, rate: float, frequency: float, within_s: float
) -> bool:
    """Whether, for some t up to `within_s`,  gap + v_y t + d (cos w t - 1) + d'/w sin w t <= 0.

    gap, m. speed : v_y, m/s. bent, rate : d, m, and d', m/s. frequency : w, rad/s.
    """
    looks = 2 + math.ceil(LOOKS_A_RADIAN * within_s * frequency)
    t = np.linspace(0.0, within_s, min(looks, MOST_LOOKS))[1:]
    swing = bent * (np.cos(frequency * t) - 1.0) + rate / frequency * np.sin(frequency * t)
    return bool((gap + speed * t + swing <= 0.0).any())


def _tip_motion(q: Floats, v: Floats, chain: Chain, length: float) -> tuple[float, float, float]:
    """v_y, m/s, of the tip as part of a rigid body, and its d, m, and d', m/s, by vibration.

    Y = a + b s + c f and V_Y alike, by least squares weighted with the mass, l s the distance from
    the hinge, f = sin x s + sin x/sinh x sinh x s; at the tip v_y = a' + b' s, d = c f.

    length : l, m.
    """
    elements = _last_phalanx(chain)
    ends, x = np.append(0.0, chain.length[elements].cumsum() / length), HINGED_FREE
    ratio = math.sin(x) / math.sinh(x)
    # values of 1, s and f at nodes, and their slopes, (3, 2, nodes)
    fields = np.zeros((3, 2, ends.size))
    fields[0, 0], fields[1, 0], fields[1, 1] = 1.0, ends, 1.0
    fields[2, 0] = np.sin(x * ends) + ratio * np.sinh(x * ends)
    fields[2, 1] = x * (np.cos(x * ends) + ratio * np.cosh(x * ends))
    fields[:, 1] /= length
    products, moving = np.zeros((3, 3)), np.zeros((3, 2))
    for n, e in enumerate(elements):
        y = _places(chain, e)[1]
        nodes = fields[:, :, n : n + 2].transpose(0, 2, 1).reshape(3, 4)
        products += nodes @ chain.mass[e] @ nodes.T
        moving += nodes @ chain.mass[e] @ np.stack([q[y], v[y]], axis=1)
    fit = np.linalg.solve(products, moving) * fields[:, 0, -1:]
    return float(fit[:2, 1].sum()), float(fit[2, 0]), float(fit[2, 1])


def _last_phalanx(chain: Chain) -> list[int]:
    """Its elements."""
    return [e for e in range(chain.first.size) if chain.first[e] >= chain.hinge_outer[-1]]


def _places(chain: Chain, e: int) -> tuple[list[int], list[int]]:
    """Places of an element's X and of its Y."""
    i, j = int(chain.first[e]), int(chain.second[e])
    return [i, i + 2, j, j + 2], [i + 1, i + 3, j + 1, j + 3]
