"""One ball against a rigid wall, by the reference's finite elements and by hcm's refined contact.

Units of the ball: R = E = rho = 1, so that speeds are in those of a bar's wave, c = sqrt(E/rho).
The mesh's ball lacks 3 % of the volume, which its density makes up for, and, lumped, has 1.8 %
more inertia J than 2/5 m R^2: its spin, R w' = m R^2/J J_t/m by the tangential impulse J_t, is
multiplied by the ratio of `mindlin`'s spins for 2/5 m R^2 and for J.
"""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

import hcm
import reference_fem as fem
from hcm.arrays import Floats
from hcm.contact.build import law_of
from hcm.contact.law import COMPRESSION, IN_FLIGHT, STICK, ContactState
from hcm.contact.round_tip_kinematics import begin_mode, commit_history, subtract_force
from meshes.ball import half_ball
from reference_fem.dynamics.loop import explicit_tap
from reference_fem.dynamics.state import LoopState
from reference_fem.dynamics.step import start_state
from reference_fem.model import build_model
from validation.harness.interrupts import unless_interrupted
from validation.studies.evidence.mindlin import FRICTION, spin

EDGE, GROWTH, EVEN = 0.25, 1.6, 1.2  # edges over the patch's radius, their growth, the even part
# Edges of the mesh from which a number's error is estimated, over its own; growth is raised to this
# power, so that both meshes are similar everywhere.
COARSER = 1.5
STIFFNESS = 100.0  # `surface_factor` times a/R: 0.4 % of Hertz's compliance is the penalty's
CLEARANCE = 1e-3  # gap below the ball at the start, over Hertz's approach
STEPS = 4000  # of hcm's ball in a contact; half as many change the spin by 1e-4
MASS = 4.0 / 3.0 * math.pi


@dataclass(frozen=True)
class Bounce:
    """A ball's contact: its force and the mass centre's approach over time (n,), a/R by Hertz, and
    the ball's final spin R w'/(mu v_n).
    """

    time: Floats
    force: Floats
    approach: Floats
    patch: float
    spin: float


def hertz(speed: float, poisson: float) -> tuple[float, float]:
    """Largest approach over R of a ball of E = rho = 1, and the contact's duration times c/R."""
    depth = (1.25 * math.pi * speed**2 * (1.0 - poisson**2)) ** 0.4
    return depth, 2.9432 * depth / speed


def mesh_error(fine: float, coarse: float) -> float:
    """Error of the finer mesh's number, if it is of first order in the edges."""
    return abs(fine - coarse) / (COARSER - 1.0)


@cache
def bounces(
    model: str, speed: float, x: float, poisson: float, snapshots: int = 8
) -> tuple[Bounce, Bounce]:
    """A model's bounce, and the one of a coarser mesh; hcm, which has none, has one bounce."""
    if model == "hcm":
        return (by_reduced_model(speed, x, poisson),) * 2
    fine, coarse = (by_elements(speed, x, poisson, snapshots, by) for by in (1.0, COARSER))
    return fine, coarse


def by_elements(
    speed: float, x: float, poisson: float, snapshots: int = 8, coarser: float = 1.0
) -> Bounce:
    """Bounce of the reference's half ball that meets the wall at v_n = `speed`, v_t = x mu v_n."""
    depth, duration = hertz(speed, poisson)
    patch = math.sqrt(depth)
    mesh = half_ball(1.0, coarser * EDGE * patch, GROWTH**coarser, patch_size=EVEN * patch)
    settings = fem.Settings(
        contact="surface", surface_factor=STIFFNESS / patch, estimate=False,
        max_contact_time_s=10.0 * duration, snapshots=snapshots,
    )  # fmt: skip
    given = fem.Surface(1.0 + CLEARANCE * depth, FRICTION), fem.Drive(gravity=0.0), settings
    light = build_model(mesh, (fem.Material(1.0, poisson, 1.0),), *given)
    density = MASS / (light.symmetry_factor * light.mass.sum())
    model = build_model(mesh, (fem.Material(1.0, poisson, density),), *given)
    velocity = np.zeros_like(model.points)
    velocity[:, :2] = x * FRICTION * speed, -speed
    state = start_state(model, np.zeros_like(velocity), velocity, 0.0)
    start = LoopState(state, 0.0, origin_energy_J=None)
    run = unless_interrupted(explicit_tap(model, settings, start))
    if run.status is not fem.Status.COMPLETED:
        raise ArithmeticError(run.message)
    time, shares = run.forces.time_s, model.mass / model.mass.sum()
    inertia = float(shares @ (mesh.points[:, :2] ** 2).sum(axis=1))
    turned = -float(np.trapezoid(run.forces.tangential_force_N, time)) / MASS / inertia
    if x:
        turned *= spin(x, poisson) / spin(x, poisson, inertia)
    fallen = [-float(shares @ s.displacement[:, 1]) for s in run.snapshots]
    deep = np.interp(time, [s.time_s for s in run.snapshots], fallen) - CLEARANCE * depth
    return Bounce(time, run.forces.normal_force_N, deep, patch, turned / (FRICTION * speed))


def by_reduced_model(speed: float, x: float, poisson: float) -> Bounce:
    """Bounce of a rigid ball on hcm's round-tip law (`RoundTipLaw`), with partial slip."""
    depth, duration = hertz(speed, poisson)
    assumed = hcm.Assumptions(lowest_point=True, hertz=True, partial_slip=True)
    rod = hcm.Phalanx(4.0, 2.0, 1.0, 1.0, 1, poisson_ratio=poisson)
    law = law_of(hcm.Finger((rod,)), hcm.Surface(2.0, FRICTION), hcm.Tip(1.0), assumed)
    contact, step = ContactState(COMPRESSION, STICK, 0.0, 0.0, 0.0, 0.0), duration / STEPS
    inertia = MASS * np.array([1.0, 1.0, 0.4])
    place = np.array([0.0, -law.height, -0.5 * math.pi])  # x, y and the angle of r'
    velocity = np.array([x * FRICTION * speed, -speed, 0.0])
    force, rows = np.zeros(3), [(0.0, 0.0, 0.0)]
    q, at_rest = np.array([*place[:2], 0.0, -1.0]), np.zeros(4)
    begin_mode(q, 0, IN_FLIGHT, contact, law)
    while True:  # velocity Verlet
        velocity += 0.5 * step * force / inertia
        place += step * velocity
        gap = place[1] + law.height
        if gap >= 0.0:
            break
        q, out = np.array([*place[:2], math.cos(place[2]), math.sin(place[2])]), np.zeros(4)
        subtract_force(q, at_rest, 0, contact, law, out)
        commit_history(q, 0, contact, law)
        force = -np.array([out[0], out[1], q[2] * out[3] - q[3] * out[2]])
        velocity += 0.5 * step * force / inertia
        rows.append((rows[-1][0] + step, force[1], -gap))
    turned = -float(velocity[2]) / (FRICTION * speed)
    time, normal, deep = np.array(rows).T
    return Bounce(time, normal, deep, math.sqrt(depth), turned)
