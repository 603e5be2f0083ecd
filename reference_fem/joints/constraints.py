"""What holds a body: hanging nodes, the symmetry plane and hinges."""

from typing import NamedTuple

from reference_fem.arrays import Array, Index
from reference_fem.compiled import inner, njit
from reference_fem.contact.law import Motion
from reference_fem.joints.hinges import Hinges, hinge_reactions
from reference_fem.ties import Ties, follow, hand_on


class Constraints(NamedTuple):
    """Constraints of a body's nodes; compiled kernels take it as it is.

    ties, hinges : see their classes
    symmetry : (k,), nodes held in the plane Z = 0
    """

    ties: Ties
    symmetry: Index
    hinges: Hinges


@inner()
def hand_on_forces(residual: Array, constraints: Constraints) -> None:
    """See `ties.hand_on`; r_z = 0 on the symmetry plane, where u_z and v_z start and stay zero."""
    symmetry = constraints.symmetry
    hand_on(residual, constraints.ties)
    for j in range(symmetry.size):
        residual[symmetry[j], 2] = 0.0


@njit(cache=True)
def constrain(motion: Motion, residual: Array, constraints: Constraints, reactions: Array) -> None:
    """Residual of the constrained motion in place of that of the forces.

    reactions : (P, 2), of hinges, N, filled
    """
    hand_on_forces(residual, constraints)
    hinge_reactions(motion, constraints.hinges, residual, reactions)
    follow(residual, motion.inverse_mass, constraints.ties)
