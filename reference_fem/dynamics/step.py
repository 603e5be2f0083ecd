"""A block of explicit steps: state in, state out."""

from dataclasses import dataclass, replace

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.compiled import njit
from reference_fem.contact.law import COLUMNS, DAMPING, DISSIPATION, GAP, Memory, Motion
from reference_fem.dynamics.central_difference import leapfrog
from reference_fem.dynamics.state import State
from reference_fem.joints.hinges import Hinges, hinge_reactions
from reference_fem.model import Model
from reference_fem.ties import Ties, follow, hand_on


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
    near = np.zeros(model.touching_body + 1) if angles is None else angles
    state = State(
        step=0,
        time_s=time_s,
        displacement=np.array(displacement, dtype=np.float64, order="C"),
        velocity=np.array(velocity, dtype=np.float64, order="C"),
        memory=model.contact.new_memory(displacement, near[model.touching_body]),
        dissipation_J=0.0,
        damping_J=0.0,
        material_J=0.0,
        face_angles=_face_angles(model, displacement, near[[c.phalanx for c in model.couples]]),
        torque_change_work_J=torque_change_work_J,
    )
    gap = lowest_gap(model, state.displacement)
    if gap < -ROUNDING * model.surface.height:
        raise CutsSurfaceError(
            f"surface.height = {model.surface.height}: the surface cuts {-gap:.3g} m into the "
            "finger at the start; put it lower"
        )
    residual = np.empty_like(state.velocity)
    model.kernel.force(state.displacement, residual, (state.velocity, 0.0))
    motion = _motion(model, state.displacement, state.velocity)
    _less_external(model, motion, model.torques.at(time_s), residual)
    half = -0.5 * model.step_s
    back = state.velocity - (half * model.inverse_mass)[:, None] * residual
    back[:, :2] += half * np.array(model.gravity_vector)
    return replace(state, velocity=back)


def lowest_gap(model: Model, displacement: Array) -> float:
    """Height of the lowest point that may touch above the plane, m."""
    nodes = model.contact.nodes
    points = model.contact.touching_points(model.points[nodes] + displacement[nodes])
    return float(np.min(points[:, 1]) + model.surface.height)


def advance(model: Model, state: State, steps: int, search: bool) -> tuple[State, Block]:
    """Take `steps` explicit steps; the state that goes in is left as it is.

    A driven face must not turn by half a turn or more within a block: the drive work counts its
    turns from one block to the next.

    search : False skips contact: the caller knows that the surface is out of reach.
    """
    memory = state.memory.copy()
    touching = memory if search else None
    residual = np.empty_like(state.displacement)
    log = np.zeros((steps, COLUMNS))
    log[:, GAP] = np.inf
    pressure = np.zeros(len(state.displacement))
    kernel, lag = model.kernel, 0.5 * model.step_s
    stored, hourglass, power = kernel.force(
        state.displacement, residual, (state.velocity, lag), audited=True
    )
    # before the first step there was no motion
    lost = lost_before = state.material_J + (model.step_s * power if state.step else 0.0)
    torques, torque_change_work = model.torques.at(state.time_s), state.torque_change_work_J
    u, v = state.displacement.copy(), state.velocity.copy()
    motion = _motion(model, u, v)
    reactions = _less_external(model, motion, torques, residual, touching, log[0], pressure)
    constants = model.inverse_mass, model.gravity_vector, model.step_s
    leapfrog(u, v, residual, *constants)
    synchronous = 0.5 * (state.velocity + v)
    for number in range(1, steps + 1):
        if not model.torques.steady:
            before, torques = torques, model.torques.at(state.time_s + number * model.step_s)
            if (change := torques - before).any():
                began, ends = (
                    _face_angles(model, x, state.face_angles) for x in (u - model.step_s * v, u)
                )
                torque_change_work += work_of(model, change, 0.5 * (began + ends))
        if number == steps:
            break
        lost += model.step_s * kernel.force(u, residual, (v, lag)).power
        _less_external(model, motion, torques, residual, touching, log[number])
        leapfrog(u, v, residual, *constants)
    log[:, DISSIPATION] = state.dissipation_J + np.cumsum(log[:, DISSIPATION])
    log[:, DAMPING] = state.damping_J + np.cumsum(log[:, DAMPING])
    after = State(
        step=state.step + steps,
        time_s=state.time_s + steps * model.step_s,
        displacement=u,
        velocity=v,
        memory=memory,
        dissipation_J=float(log[-1, DISSIPATION]),
        damping_J=float(log[-1, DAMPING]),
        material_J=lost,
        face_angles=_face_angles(model, u, state.face_angles),
        torque_change_work_J=torque_change_work,
    )
    shown = log, synchronous, lost_before, stored, hourglass, reactions, pressure, search
    return after, Block(*shown)


def work_of(model: Model, torques: Array, angles: Array) -> float:
    """Σ T θ of joints' torques T (P,) and the angles (n_couples,) of the faces they turn, J."""
    pairs = zip(model.couples, angles, strict=True)
    return float(sum(couple.sign * torques[couple.joint] * angle for couple, angle in pairs))


def _face_angles(model: Model, displacement: Array, near: Array) -> Array:
    turned = zip(model.couples, near, strict=True)
    return np.array([couple.section.angle(displacement, close) for couple, close in turned])


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


def _less_external(
    model: Model,
    motion: Motion,
    torques: Array,
    residual: Array,
    memory: Memory | None = None,
    row: Array | None = None,
    pressure: Array | None = None,
) -> Array:
    """Subtract contact, couples and hinge reactions, which it returns (P, 2), from the residual.

    Contact, if its `memory` is given, comes after all else that acts on its nodes, which a
    constraint needs to know. Its history is committed; `row` and, if given, `pressure` (n_points,)
    are filled.
    """
    for couple in model.couples:
        torque = couple.sign * torques[couple.joint]
        couple.section.apply_couple(torque, motion.displacement, residual)
    if memory is not None and row is not None:
        _hand_on(residual, model.ties, model.symmetry)
        nodes = model.contact.nodes
        before = None if pressure is None else residual[nodes, 1]
        model.contact.apply(motion, memory, residual, row)
        if pressure is not None and before is not None:
            pressure[nodes] = (before - residual[nodes, 1]) / model.contact.area
    return np.asarray(_constrain(motion, residual, model.ties, model.symmetry, model.hinges))


@njit(cache=True)
def _constrain(
    motion: Motion, residual: Array, ties: Ties, symmetry: Index, hinges: Hinges
) -> Array:
    """Residual of the constrained motion in place of that of the forces; hinge reactions, N."""
    _hand_on(residual, ties, symmetry)
    reactions = hinge_reactions(motion, hinges, residual)
    follow(residual, motion.inverse_mass, ties)
    return reactions


@njit(cache=True)
def _hand_on(residual: Array, ties: Ties, symmetry: Index) -> None:
    """See `ties.hand_on`; r_z = 0 on the symmetry plane, where u_z and v_z start and stay zero."""
    hand_on(residual, ties)
    for j in range(symmetry.size):
        residual[symmetry[j], 2] = 0.0
