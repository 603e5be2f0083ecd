"""Joint torques as couples on the faces that they turn."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.compiled import inner, njit
from reference_fem.elements.section import Section, apply_couple, section_angle


class Couples(NamedTuple):
    """Torques about Z on c faces; compiled kernels take it as it is.

    A joint's torque acts on the first face of its phalanx, its reaction on the face before.

    phalanges, joints : (c,), from 0: whose face it is, and whose torque
    signs : (c,), 1, or -1 for a reaction
    starts : (c + 1,), face i owns nodes starts[i]:starts[i+1]
    nodes, arms, masses : of all faces' sections, one after another; see `Section`
    """

    phalanges: Index
    joints: Index
    signs: Array
    starts: Index
    nodes: Index
    arms: Array
    masses: Array

    def torques(self, of_joints: Array) -> Array:
        """Torques (..., c) on the faces from those of the joints (..., P), N·m."""
        return self.signs * of_joints[..., self.joints]

    def work(self, of_joints: Array, angles: Array) -> float:
        """Σ T θ of the joints' torques (P,) and the faces' angles (c,), J."""
        return float(sum((self.torques(of_joints) * angles).tolist()))


def couples_of(faces: Iterable[tuple[int, int, float, Section]]) -> Couples:
    """Couples from each face's phalanx, joint, sign and section."""
    phalanges, joints, signs, sections = tuple(zip(*faces, strict=True)) or ((), (), (), ())
    empty = Section(np.empty(0, np.int64), np.empty((0, 2)), np.empty(0))
    return Couples(
        np.array(phalanges, dtype=np.int64),
        np.array(joints, dtype=np.int64),
        np.array(signs, dtype=np.float64),
        np.cumsum([0, *(section.nodes.size for section in sections)]),
        *(np.concatenate(parts) for parts in zip(empty, *sections, strict=True)),
    )


@inner()
def _section(couples: Couples, face: int) -> Section:
    first, last = couples.starts[face], couples.starts[face + 1]
    return Section(couples.nodes[first:last], couples.arms[first:last], couples.masses[first:last])


@njit(cache=True)
def apply_couples(couples: Couples, torques: Array, displacement: Array, residual: Array) -> None:
    """Subtract the nodal forces of the faces' torques (c,), N·m, from the residual."""
    for face in range(torques.size):
        apply_couple(_section(couples, face), torques[face], displacement, residual)


@njit(cache=True)
def turn_faces(couples: Couples, displacement: Array, angles: Array) -> None:
    """Bring the rotations of the faces (c,), rad, up to date, each on the nearest branch."""
    for face in range(angles.size):
        angles[face] = section_angle(_section(couples, face), displacement, angles[face])
