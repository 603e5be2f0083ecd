"""When a tip that has left its surface would touch again: as a rigid body, and as it vibrates."""

import math

import numpy as np

from reference_fem.arrays import Array, Flags
from reference_fem.compiled import njit
from reference_fem.model import Model

# Transits of an axial wave along the last phalanx: more than any run lasts.
NEVER = 1e12
# tan β = tanh β: the lowest bending vibration of a beam with one hinged and one free end.
HINGED_FREE = 3.926602
SHEAR = 3.0
LOOKS_A_RADIAN, MOST_LOOKS = 16, 100_000


def next_touch_s(model: Model, displacement: Array, velocity: Array) -> float:
    """Time until the last phalanx would reach the surface as a rigid body, s.

    If it does not come down, `NEVER` transits of a wave, as records hold finite numbers.

    An edge that hits first bounces off while its body still comes down, so that nodes tell nothing
    about the body. With the mean velocity v_c and the spin ω = L/I of the last phalanx in the plane
    of motion, a point of gap g arrives after

        g / -v_y,  v_y = v_cy + ω (x - x_c) < 0

    displacement, velocity : (n_points, dim).
    """
    nodes, body = model.contact.nodes, model.body_of_point == model.touching_body
    centre, mean, spin = _planar_motion(body, model.mass, model.points, displacement, velocity)
    place = model.contact.touching_points(model.points.take(nodes, 0) + displacement.take(nodes, 0))
    speed = mean + spin * (place[:, 0] - centre)
    down = speed < 0.0
    gap = np.maximum(place[down, 1] + model.surface.height, 0.0)
    return float(np.min(gap / -speed[down], initial=NEVER * model.transit_s))


def bent_touches(model: Model, displacement: Array, velocity: Array, within_s: float) -> bool:
    """Whether the last phalanx would reach the surface within a time, s, if it also bent.

    To the rigid motion is added the lowest vibration of a rod with one hinged and one free end:

        gap + v_y t + δ (cos ω t - 1) + δ'/ω sin ω t = 0,  tan β = tanh β,
        ω² = (β/l)⁴ (c r)²/(1 + (β r/l)² (1 + E/(κ G))),  r = d/4,

    δ, δ' of `_vibration`, l the rod's length up to the sphere's centre, c the speed of an
    axial wave; the denominator is Timoshenko's first correction for rotary inertia and shear (2.8
    to 3.1 for E/(κ G) of a round section, ν from 0.3 to 0.5). Bodies that are free, or not longer
    than wide, are taken as rigid.

    displacement, velocity : (n_points, dim).
    """
    nodes, body = model.contact.nodes, model.body_of_point == model.touching_body
    length, diameter = np.ptp(model.points[body, :2], axis=0).tolist()
    if model.chain is None or length <= diameter:
        return False
    place = model.contact.touching_points(model.points.take(nodes, 0) + displacement.take(nodes, 0))
    gap = max(float(place[:, 1].min()) + model.surface.height, 0.0)
    centre, mean, spin = _planar_motion(body, model.mass, model.points, displacement, velocity)
    speed = mean + spin * float((model.points + displacement)[model.pole, 0] - centre)
    bent, rate = _vibration(model, displacement, velocity)
    radius, wave = 0.25 * diameter, HINGED_FREE / (length - 0.5 * diameter)
    soft = 1.0 + (wave * radius) ** 2 * (1.0 + SHEAR)
    frequency = wave**2 * radius * length / model.transit_s / math.sqrt(soft)
    looks = 2 + math.ceil(LOOKS_A_RADIAN * within_s * frequency)
    t = np.linspace(0.0, within_s, min(looks, MOST_LOOKS))
    swing = bent * (np.cos(frequency * t) - 1.0) + rate / frequency * np.sin(frequency * t)
    return bool((gap + speed * t + swing <= 0.0)[1:].any())


def _vibration(model: Model, displacement: Array, velocity: Array) -> tuple[float, float]:
    """The pole's y, m, and its rate, m/s, by the last phalanx's lowest bending vibration.

    Of y = a + b s + c f, by least squares weighted with the mass, s = 0 to 1 from hinge to pole and
    f = sin β s + sin β/sinh β sinh β s, what is not rigid: c f(1), less the shift and the turn that
    fit it best.
    """
    body = model.body_of_point == model.touching_body
    rest = model.points[body]
    along = rest[:, 0].max() - np.append(rest[:, 0], model.points[model.pole, 0])
    along /= np.ptp(rest[:, 0])
    ratio = math.sin(HINGED_FREE) / math.sinh(HINGED_FREE)
    mode = np.sin(HINGED_FREE * along) + ratio * np.sinh(HINGED_FREE * along)
    rigid, mass = np.stack([np.ones_like(along), along]), model.mass[body]
    weighted = rigid[:, :-1] * mass
    mode -= np.linalg.solve(weighted @ rigid[:, :-1].T, weighted @ mode[:-1]) @ rigid
    share = mass * mode[:-1] * mode[-1] / (mass @ mode[:-1] ** 2)
    return float(share @ (rest[:, 1] + displacement[body, 1])), float(share @ velocity[body, 1])


@njit(cache=True)
def _planar_motion(
    body: Flags, mass: Array, points: Array, displacement: Array, velocity: Array
) -> tuple[float, float, float]:
    """x_c, m, v_cy, m/s, and ω, rad/s, of the points that `body` marks."""
    total, centre, mean = 0.0, np.zeros(2), np.zeros(2)
    for i in range(mass.size):
        if body[i]:
            total += mass[i]
            for k in range(2):
                centre[k] += mass[i] * (points[i, k] + displacement[i, k])
                mean[k] += mass[i] * velocity[i, k]
    centre /= total
    mean /= total
    momentum, inertia = 0.0, 0.0
    for i in range(mass.size):
        if body[i]:
            x = points[i, 0] + displacement[i, 0] - centre[0]
            y = points[i, 1] + displacement[i, 1] - centre[1]
            momentum += mass[i] * (x * (velocity[i, 1] - mean[1]) - y * (velocity[i, 0] - mean[0]))
            inertia += mass[i] * (x * x + y * y)
    return centre[0], mean[1], momentum / inertia
