"""Energy and linear momentum of a run, from its nodal states by an independent quadrature.

hcm's audit uses hcm's matrices. Here the states kept at the events are integrated over Hermite's
cubics by Gauss points, losses and impulses over the history's forces, and both must satisfy the
laws of mechanics:

    energy      T + U + V + contact = work of the torques - friction - loops
    momentum    p = int (-lam_1 + F_c + W) dt,      p = int rho A r. dx
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicHermiteSpline

from hcm import Finger, Posture, Scene, Status, TapResult
from hcm.arrays import Floats
from hcm.stepping import LARGEST_RESIDUAL
from validation.studies.stress.stability_map import RIGHT_WITHIN

EPS = float(np.finfo(float).eps)

# rad; a first node that turns faster between two kept postures may have turned once more.
MOST_TURNED = 1.0
# About the number of states that are checked, in runs with more events.
MOST_STATES = 60
FRAMES = 1000
GAUSS_POINTS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(8)


@dataclass(frozen=True)
class Mechanics:
    """T, U, V (J) and p (2,) (N s) of one state; floor (J): strain energy of q's rounding."""

    kinetic_J: float
    strain_J: float
    gravity_J: float
    momentum_N_s: Floats
    floor_J: float


def mechanics(finger: Finger, gravity: float, state: Posture) -> Mechanics:
    """Integrate a state with rates over the finger."""
    w, kinetic, strain, potential, floor = 0.5 * GAUSS_WEIGHTS, 0.0, 0.0, 0.0, 0.0
    momentum = np.zeros(2)
    for phalanx, r, d, v, dv in zip(
        finger.phalanges, state.positions_m, state.slopes, state.velocities_m_per_s,
        state.slope_rates_per_s, strict=True,
    ):  # fmt: skip
        el, line = phalanx.length / phalanx.elements, phalanx.density * phalanx.area
        knots = np.arange(phalanx.elements + 1)
        shape, rates = CubicHermiteSpline(knots, r, el * d), CubicHermiteSpline(knots, v, el * dv)
        x = knots[:-1] + 0.5 * (GAUSS_POINTS[:, None] + 1)  # (points, elements)
        place, first, second, speed = shape(x), shape(x, 1) / el, shape(x, 2) / el**2, rates(x)
        axial = 0.5 * ((first**2).sum(-1) - 1)
        stored = phalanx.area * axial**2 + phalanx.second_moment * (second**2).sum(-1)
        kinetic += 0.5 * line * el * float((w @ (speed**2).sum(-1)).sum())
        strain += 0.5 * phalanx.youngs_modulus * el * float((w @ stored).sum())
        potential += gravity * line * el * float((w @ place[..., 1]).sum())
        momentum += line * el * np.einsum("g,gnc->c", w, speed)
        # positions give the chords with an error of eps L/l
        stretch = (8 * EPS * finger.length / el) ** 2
        floor += phalanx.elements * phalanx.youngs_modulus * phalanx.area * el * stretch
    return Mechanics(kinetic, strain, potential, momentum, floor)


def observed(scene: Scene) -> Scene:
    """The scene with frames from which driven phalanges' turns are counted; steps do not change."""
    s = scene.settings
    if not any(scene.drive.torques):
        return scene
    end = s.end_time or s.taps * (s.max_flight_time + s.max_contact_time)
    times = np.union1d(np.linspace(0.0, end, FRAMES), np.geomspace(1e-6 * end, end, FRAMES))
    return replace(scene, settings=replace(s, frame_times=tuple(times.tolist())))


def _unresolved(time: Floats, rate: Floats) -> Floats:
    """Error of the trapezoidal rule up to each row: the largest change without every other row.

    The rows sample a vibration faster than the steps by chance: they do not determine the momentum
    of a run full of it. Jumps (two rows at one time) are not vibration.
    """
    before, after = time[1:-1] - time[:-2], time[2:] - time[1:-1]
    with np.errstate(invalid="ignore"):
        between = (after * rate[:-2] + before * rate[2:]) / (before + after)
    left_out = 0.5 * (rate[1:-1] - between) * (before + after)
    off = np.concatenate([[0.0], np.where((before > 0) & (after > 0), left_out, 0.0), [0.0]])
    odd = np.arange(off.size) % 2 == 1
    either = [np.abs(np.cumsum(np.where(rows, off, 0.0))) for rows in (odd, ~odd)]
    return np.asarray(np.maximum.accumulate(np.maximum(*either)))


def _losses(scene: Scene, result: TapResult) -> Floats:
    """Energy that friction and hysteresis loops have taken up to each row, J."""
    h, tip = result.history, scene.tip
    power = -h.tangential_force_N * h.particle_velocity_m_per_s
    # V_P jumps as P starts to slip: a step belongs to the mode in which it began
    slid = 0.5 * (power[:-1] + power[1:]) * np.diff(h.time_s) * (h.mode[:-1] % 3 == 2)
    friction = np.append(0.0, np.cumsum(slid))
    # compression that ends at F2 after it began at F1 can't give back (1 - e*^2) (F2^2 - F1^2)/(2k)
    square = np.diff(h.normal_force_N**2) * (h.mode[:-1] // 3 == 1)
    loops = np.append(0.0, np.cumsum(square)) * (1 - tip.restitution**2)
    return np.asarray(friction + loops / (2 * tip.k))


def _turned(before: Posture, after: Posture) -> Floats:
    """Angles by which the first nodes' slopes turned between two postures, rad, in (-pi, pi]."""
    a = np.array([slopes[0] for slopes in before.slopes])
    b = np.array([slopes[0] for slopes in after.slopes])
    return np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(axis=1))


def _works(scene: Scene, result: TapResult) -> dict[float, float] | None:
    """Work of the torques up to each kept posture, by time, J; None if its turns are not known.

    The frames between the events must be dense enough to count the turns: see `observed`.
    """
    if not any(scene.drive.torques):
        return {posture.time_s: 0.0 for posture in result.event_postures}
    if scene.drive.reaction or not scene.settings.frame_times:
        return None
    torques = np.array(scene.drive.torques)
    start = Posture(0.0, (), tuple(np.array([[-1.0, 0.0]]) for _ in torques))
    works, work, before = {}, 0.0, start
    for after in sorted((*result.frames, *result.event_postures), key=lambda p: p.time_s):
        turned = _turned(before, after)
        if np.abs(turned).max() > MOST_TURNED:
            return None
        work += float(torques @ turned)
        works[after.time_s] = work
        before = after
    return works


def audit(scene: Scene, result: TapResult) -> Iterator[str]:
    """Violations of the laws of mechanics by a run's states, one sentence each."""
    h = result.history
    states = result.event_postures[:: max(1, len(result.event_postures) // MOST_STATES)]
    losses, works = _losses(scene, result), _works(scene, result)
    largest = float(h.kinetic_energy_J.max())
    mass = sum(p.density * p.area * p.length for p in scene.finger.phalanges)
    force = np.column_stack([h.tangential_force_N, h.normal_force_N]) + h.hinge_reactions_N[:, 0]
    force[:, 1] -= mass * scene.drive.gravity
    impulse = cumulative_trapezoid(force, h.time_s, axis=0, initial=0.0)
    unresolved = np.column_stack([_unresolved(h.time_s, force[:, c]) for c in range(2)]).max(axis=1)
    stored = h.contact_energy_J
    for state in states:
        row = int(np.searchsorted(h.time_s, state.time_s, side="right")) - 1
        own = mechanics(scene.finger, scene.drive.gravity, state)
        at = f"at {state.time_s:.6g} s"
        for name, value, reported in (
            ("kinetic", own.kinetic_J, h.kinetic_energy_J[row]),
            ("strain", own.strain_J, h.strain_energy_J[row]),
        ):
            noise = 1e-6 * max(value, reported) + 1e-9 * largest + own.floor_J
            if abs(value - reported) > noise:
                yield f"{name} energy {reported:.6g} J {at}, its state {value:.6g} J"
        if result.status is not Status.COMPLETED:
            continue
        if works is not None:
            held = own.kinetic_J + own.strain_J + own.gravity_J + float(stored[row])
            off = abs(held + losses[row] - works[state.time_s])
            if off > LARGEST_RESIDUAL * largest + own.floor_J:
                yield f"energy off by {off / largest:.3g} of the largest {at}"
        if scene.settings.flight_integrator == "gauss":
            # in a step of order 10 the reaction swings more than once; its row has the end's only
            continue
        gap = float(np.abs(own.momentum_N_s - impulse[row]).max())
        scale = (2 * mass * largest) ** 0.5
        if gap > RIGHT_WITHIN * scale + unresolved[row]:
            yield f"momentum off by {gap / scale:.3g} of the largest {at}"
