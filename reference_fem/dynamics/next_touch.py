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
SHEAR = 3.0  # E/(κ G)
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
    never = NEVER * model.transit_s
    return float(_earliest(place, centre, mean, spin, model.surface.height, never))


def bent_touches(model: Model, displacement: Array, velocity: Array, within_s: float) -> bool:
    """Whether the last phalanx would reach the surface within a time, s, if it also bent.

    By `swings_down` with its `bending_frequency`. Bodies that are free, or not longer than wide, do
    not bend.

    displacement, velocity : (n_points, dim).
    """
    nodes, body = model.contact.nodes, model.body_of_point == model.touching_body
    length, diameter = np.ptp(model.points[body, :2], axis=0).tolist()
    if model.chain is None or length <= diameter:
        return False
    place = model.contact.touching_points(model.points.take(nodes, 0) + displacement.take(nodes, 0))
    gap = max(float(place[:, 1].min()) + model.surface.height, 0.0)
    rod, frequency = bending_frequency(length, diameter, length / model.transit_s)
    return swings_down(gap, *_pole_motion(model, displacement, velocity, rod), frequency, within_s)


def bending_frequency(length: float, diameter: float, wave: float) -> tuple[float, float]:
    """(l, ω), m and rad/s, of the lowest vibration of a rod with one hinged and one free end.

        ω² = (β/l)⁴ (c r)²/(1 + (β r/l)² (1 + E/(κ G))),  r = d/4,  tan β = tanh β,

    l the length of a rod of the phalanx's mass, its round end d/6 shorter; c the speed of an axial
    wave, m/s; the denominator is Timoshenko's first correction for rotary inertia and shear (2.8 to
    3.1 for E/(κ G) of a round section, ν from 0.3 to 0.5).
    """
    radius, rod = 0.25 * diameter, length - diameter / 6.0
    square = (HINGED_FREE / rod) ** 2
    soft = 1.0 + square * radius**2 * (1.0 + SHEAR)
    return rod, square * radius * wave / math.sqrt(soft)


def swings_down(
    gap: float, speed: float, bent: float, rate: float, frequency: float, within_s: float
) -> bool:
    """Whether, for some t up to `within_s`,  gap + v_y t + δ (cos ω t - 1) + δ'/ω sin ω t <= 0.

    gap, m. speed : v_y, m/s. bent, rate : δ, m, and δ', m/s. frequency : ω, rad/s.
    """
    looks = 2 + math.ceil(LOOKS_A_RADIAN * within_s * frequency)
    t = np.linspace(0.0, within_s, min(looks, MOST_LOOKS))[1:]
    swing = bent * (np.cos(frequency * t) - 1.0) + rate / frequency * np.sin(frequency * t)
    return bool((gap + speed * t + swing <= 0.0).any())


def _pole_motion(
    model: Model, displacement: Array, velocity: Array, rod: float
) -> tuple[float, float, float]:
    """v_y, m/s, of the pole as part of a rigid body, and its δ, m, and δ', m/s, by vibration.

    y = a + b s + c f and its velocity alike, by least squares weighted with the mass, l s the
    distance from the hinge, f = sin β s + sin β/sinh β sinh β s; at the pole v_y = a' + b' s,
    δ = c f.

    rod : l, m.
    """
    body = model.body_of_point == model.touching_body
    rest = model.points[body]
    along = rest[:, 0].max() - np.append(rest[:, 0], model.points[model.pole, 0])
    along /= rod
    ratio = math.sin(HINGED_FREE) / math.sinh(HINGED_FREE)
    mode = np.sin(HINGED_FREE * along) + ratio * np.sinh(HINGED_FREE * along)
    fields = np.stack([np.ones_like(along), along, mode])
    weighted = fields[:, :-1] * model.mass[body]
    moving = np.stack([rest[:, 1] + displacement[body, 1], velocity[body, 1]], axis=1)
    fit = np.linalg.solve(weighted @ fields[:, :-1].T, weighted @ moving) * fields[:, -1:]
    return float(fit[:2, 1].sum()), float(fit[2, 0]), float(fit[2, 1])


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


@njit(cache=True)
def _earliest(
    place: Array, centre: float, mean: float, spin: float, height: float, never: float
) -> float:
    """Least time, s, in which one of the points (n, dim) arrives; `never` if none comes down."""
    soonest = never
    for i in range(len(place)):
        speed = mean + spin * (place[i, 0] - centre)
        if speed < 0.0:
            soonest = min(soonest, max(place[i, 1] + height, 0.0) / -speed)
    return soonest
