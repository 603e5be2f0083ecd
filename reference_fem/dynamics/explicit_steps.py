"""Explicit steps in compiled code: forces, constraints and the leapfrog, step by step."""

from typing import Any

import numpy as np

from reference_fem.arrays import Array
from reference_fem.compiled import njit
from reference_fem.contact.law import GAP, Memory, Motion, contact_forces
from reference_fem.dynamics.central_difference import leapfrog
from reference_fem.elements.blocks import Blocks, Moving
from reference_fem.elements.loops import internal_force
from reference_fem.joints.constraints import Constraints, constrain, hand_on_forces
from reference_fem.joints.couples import Couples, apply_couples, face_angles


@njit(cache=True, error_model="numpy")
def explicit_steps(
    blocks: Blocks, parts: tuple[Any, ...], constraints: Constraints, couples: Couples,
    motion: Motion, memory: Memory, torques: Array, angles: Array, moving: Moving, threads: int,
    searched: bool, log: Array, power: Array, stored: Array,
) -> tuple[Array, Array, Array, float]:  # fmt: skip
    """Take as many steps as `log` (steps, COLUMNS) and `power` (steps,) have rows to fill.

    Contact, if it is searched for, comes after all else that acts on its nodes, which a constraint
    needs to know; its history is committed.

    parts : of the contact law. motion, memory : changed in place.
    torques : (1 | steps + 1, c), N·m, on the couples' faces, steady or at each step and the end
    angles : (c,), of these faces, brought up to date where torques change
    moving : see `ElementKernel.force`; the power of damping, W, is logged
    stored : (threads, 2), energies of the first step's elements, J, see `blocks.Stored`

    Returns, of the first step, reactions of hinges (P, 2), N, the synchronous velocity
    (n_points, dim) and normal forces of contact (n_points,), N; and ∫ θ dT of all, J.
    """
    displacement, velocity, step = motion.displacement, motion.velocity, motion.step
    residual, synchronous = np.empty_like(displacement), velocity.copy()
    reactions, pushed = np.zeros((constraints.hinges.starts.size - 1, 2)), np.zeros(len(residual))
    steady, torque_change_work = len(torques) == 1, 0.0
    for n in range(len(log)):
        if n == 0:
            internal_force(blocks, displacement, threads, residual, stored, moving)
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
                pushed[:] = residual[:, 1]
            contact_forces(parts, motion, memory, residual, log[n])
            if n == 0:
                pushed -= residual[:, 1]
        found = constrain(motion, residual, constraints)
        leapfrog(displacement, velocity, residual, motion.inverse_mass, motion.gravity_vector, step)
        if n == 0:
            reactions = found
            synchronous += velocity
        if not steady:
            before = angles.copy()
            angles[:] = face_angles(couples, displacement, angles)
            for c in range(angles.size):
                change = torques[n + 1, c] - torques[n, c]
                torque_change_work += change * (0.5 * (before[c] + angles[c]))
    return reactions, 0.5 * synchronous, pushed, torque_change_work
