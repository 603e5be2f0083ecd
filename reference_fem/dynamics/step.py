"""A block of explicit steps: state in, state out."""

from dataclasses import dataclass

import numba
import numpy as np

from reference_fem.arrays import Array
from reference_fem.contact.law import COLUMNS, DAMPING, DISSIPATION, Motion
from reference_fem.dynamics.explicit_steps import FirstStep, explicit_steps
from reference_fem.dynamics.state import State
from reference_fem.elements.base import stored_energies
from reference_fem.joints.constraints import constrain
from reference_fem.joints.couples import apply_couples, turn_faces
from reference_fem.model import Model


@dataclass(frozen=True)
class Block:
    """Record of a block of steps, summed over the mesh as given.

    log : (steps, COLUMNS), contact at t_n, t_{n+1}, ... (see `contact.law`); DISSIPATION and
        DAMPING accumulate from the start of the run. All zero, and GAP infinite, where contact was
        not searched for.
    velocity : (n_points, dim), v at t_n, synchronous with the displacement of the state that went
        in
    material_J : dissipation of the material's damping up to t_n
    stored_J, hourglass_J : stored energy at t_n, and hourglass control's part of it
    reactions : (P, 2), hinge forces at t_n
    pressure : (n_points,), contact pressure at t_n, Pa: each node's normal force over its tributary
        area
    searched : whether contact was searched for
    """

    log: Array
    velocity: Array
    material_J: float
    stored_J: float
    hourglass_J: float
    reactions: Array
    pressure: Array
    searched: bool


class CutsSurfaceError(ValueError):
    """The surface cuts into the body at the start."""


ROUNDING = 1e-14  # over the surface's depth: round-off of a zero gap, a sum over a facet's nodes


def start_state(
    model: Model,
    displacement: Array,
    velocity: Array,
    time_s: float,
    angles: Array | None = None,
    torque_change_work_J: float = 0.0,
) -> State:
    """State for the first step from u and v at the same time.

    v(-Δt/2) = v(0) - Δt/2 a(0): central differences keep their second order from the start.

    angles : (phalanges,), rotations of the phalanges so far, to within half a turn; None: less than
        half a turn.

    Raises CutsSurfaceError.
    """
    u, v = (np.array(start, dtype=np.float64, order="C") for start in (displacement, velocity))
    gap = lowest_gap(model, u)
    if gap < -ROUNDING * model.surface.height:
        raise CutsSurfaceError(
            f"surface.height = {model.surface.height}: the surface cuts {-gap:.3g} m into the "
            "finger at the start; put it lower"
        )
    residual = np.empty_like(v)
    model.kernel.force(u, residual, (v, 0.0))
    motion = _motion(model, u, v)
    torques = model.couples.torques(model.torques.at(time_s))
    apply_couples(model.couples, torques, u, residual)
    constrain(motion, residual, model.constraints, np.empty((model.hinges.size, 2)))
    half = -0.5 * model.step_s
    back = v - (half * model.inverse_mass)[:, None] * residual
    back[:, :2] += half * np.array(model.gravity_vector)
    near = np.zeros(model.touching_body + 1) if angles is None else angles
    of_faces = near[model.couples.phalanges]
    turn_faces(model.couples, u, of_faces)
    return State(
        step=0,
        time_s=time_s,
        displacement=u,
        velocity=back,
        memory=model.contact.new_memory(u, near[model.touching_body]),
        dissipation_J=0.0,
        damping_J=0.0,
        material_J=0.0,
        face_angles=of_faces,
        torque_change_work_J=torque_change_work_J,
    )


def lowest_gap(model: Model, displacement: Array) -> float:
    """Height of the lowest point that may touch above the plane, m."""
    nodes = model.contact.nodes
    points = model.contact.touching_points(model.points[nodes] + displacement[nodes])
    return float(np.min(points[:, 1]) + model.surface.height)


def advance(model: Model, state: State, steps: int, search: bool) -> tuple[State, Block]:
    """Take `steps` explicit steps; the state that goes in is left as it is.

    A steadily driven face must not turn by half a turn or more within a block: the drive work
    counts its turns from one block to the next.

    search : False skips contact: the caller knows that the surface is out of reach.
    """
    memory, u, v = state.memory.copy(), state.displacement.copy(), state.velocity.copy()
    threads, step, began = numba.get_num_threads(), model.step_s, state.time_s
    log, power = np.zeros((steps, COLUMNS)), np.zeros(steps)
    of_hinges, of_points = np.empty((model.hinges.size, 2)), np.zeros(len(u))
    first = FirstStep(np.empty((threads, 2)), of_hinges, np.empty_like(v), of_points)
    times = [began] if model.torques.steady else (began + step * np.arange(steps + 1)).tolist()
    torques = np.array([model.couples.torques(model.torques.at(time)) for time in times])
    angles, moving = state.face_angles.copy(), model.kernel.damping(v, 0.5 * step)
    work = explicit_steps(
        model.kernel.blocks, model.contact.parts, model.constraints, model.couples,
        _motion(model, u, v), memory, torques, angles, moving, threads, search, log, power, first,
    )  # fmt: skip
    log[:, DISSIPATION] = state.dissipation_J + np.cumsum(log[:, DISSIPATION])
    log[:, DAMPING] = state.damping_J + np.cumsum(log[:, DAMPING])
    if state.step == 0:  # before the first step there was no motion
        power[0] = 0.0
    lost = np.cumsum([state.material_J, *(step * power).tolist()])[1:]
    pressure, nodes = np.zeros(len(u)), model.contact.nodes
    pressure[nodes] = first.pushed[nodes] / model.contact.area
    turn_faces(model.couples, u, angles)
    after = State(
        step=state.step + steps,
        time_s=state.time_s + steps * step,
        displacement=u,
        velocity=v,
        memory=memory,
        dissipation_J=float(log[-1, DISSIPATION]),
        damping_J=float(log[-1, DAMPING]),
        material_J=float(lost[-1]),
        face_angles=angles,
        torque_change_work_J=state.torque_change_work_J + work,
    )
    energies = float(lost[0]), *stored_energies(first.stored)
    return after, Block(log, first.velocity, *energies, first.reactions, pressure, search)


def _motion(model: Model, displacement: Array, velocity: Array) -> Motion:
    """The motion of a model whose displacement and velocity change in place."""
    return Motion(
        points=model.points,
        displacement=displacement,
        velocity=velocity,
        inverse_mass=model.inverse_mass,
        gravity_vector=model.gravity_vector,
        step=model.step_s,
        height=model.surface.height,
        friction=model.surface.friction,
    )
