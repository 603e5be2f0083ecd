"""Explicit steps in compiled code: forces, constraints and the leapfrog, step by step."""

from typing import Any, NamedTuple

import numpy as np

from reference_fem.arrays import Array
from reference_fem.compiled import njit
from reference_fem.contact.law import GAP, Memory, Motion, contact_forces
from reference_fem.dynamics.central_difference import leapfrog
from reference_fem.elements.blocks import Blocks, Moving
from reference_fem.elements.loops import internal_force
from reference_fem.joints.constraints import Constraints, constrain, hand_on_forces
from reference_fem.joints.couples import Couples, apply_couples, turn_faces


class FirstStep(NamedTuple):
    """What is recorded of a block's first step, to be filled.

    stored : (threads, 2), energies of the elements, J, see `blocks.Stored`
    reactions : (P, 2), of hinges, N
    velocity : (n_points, dim), synchronous with the displacement, m/s
    pushed : (n_points,), normal forces of contact, N; zero before
    """

    stored: Array
    reactions: Array
    velocity: Array
    pushed: Array


@njit(cache=True)
def explicit_steps(
    blocks: Blocks, parts: tuple[Any, ...], constraints: Constraints, couples: Couples,
    motion: Motion, memory: Memory, torques: Array, angles: Array, moving: Moving, threads: int,
    searched: bool, log: Array, power: Array, first: FirstStep,
) -> float:  # fmt: skip
    """Take as many steps as `log` (steps, COLUMNS) and `power` (steps,) have rows; ∫ θ dT, J.

    All but that number is filled in: while numba makes Python's arrays of a result, an interrupt
    that came in the meantime would raise a SystemError.

    Contact, if it is searched for, comes after all else that acts on its nodes, which a constraint
    needs to know; its history is committed.

    parts : of the contact law. motion, memory : changed in place.
    torques : (1 | steps + 1, c), N·m, on the couples' faces, steady or at each step and the end
    angles : (c,), of these faces, brought up to date where torques change
    moving : see `ElementKernel.force`; the power of damping, W, is logged
    """
    displacement, velocity, step = motion.displacement, motion.velocity, motion.step
    residual, reactions = np.empty_like(displacement), np.empty_like(first.reactions)
    steady, torque_change_work = len(torques) == 1, 0.0
    first.velocity[:] = velocity
    for n in range(len(log)):
        if n == 0:
            internal_force(blocks, displacement, threads, residual, first.stored, moving)
        else:
            internal_force(blocks, displacement, threads, residual, None, moving)
        if moving is not None:
            for t in range(threads):
                power[n] += moving[2][t]
        apply_couples(couples, torques[0 if steady else n], displacement, residual)
        log[n, GAP] = np.inf
        if searched:
            hand_on_forces(residual, constraints)
            if n == 0:
                first.pushed[:] = residual[:, 1]
            contact_forces(parts, motion, memory, residual, log[n])
            if n == 0:
                first.pushed[:] -= residual[:, 1]
        constrain(motion, residual, constraints, first.reactions if n == 0 else reactions)
        leapfrog(displacement, velocity, residual, motion.inverse_mass, motion.gravity_vector, step)
        if n == 0:
            first.velocity[:] = 0.5 * (first.velocity + velocity)
        if not steady:
            before = angles.copy()
            turn_faces(couples, displacement, angles)
            for c in range(angles.size):
                change = torques[n + 1, c] - torques[n, c]
                torque_change_work += change * (0.5 * (before[c] + angles[c]))
    return torque_change_work
