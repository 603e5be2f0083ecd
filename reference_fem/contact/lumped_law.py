"""The lumped contact law on one point of a solid."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

import meshes
from reference_fem.arrays import Array
from reference_fem.compiled import inner, use_for
from reference_fem.contact import law, lumped
from reference_fem.contact.law import ContactLaw, Memory, Motion, contact_forces
from reference_fem.contact.lumped import MEMORY, TURN, lumped_force
from reference_fem.elements.section import Section, apply_couple, build_section, section_angle
from reference_fem.settings import LumpedContact


class LumpedPoint(NamedTuple):
    """A point C that moves with the mean of a section's nodes, w_i = m_i/Σ m, and its law.

    radius 0: C is the mean itself, here of the flat end face (the reduced model's tip node).
    radius R: C is the lowest point of a sphere about the mean, here the equator's section of the
    hemispherical end; it rolls, so that with the section's rotation θ

        g = Σ w_i y_i - R + H,   x_C = Σ w_i x_i + R θ,   f_i = w_i (F_t, F_n), couple R F_t.

    constants : `LumpedContact.constants`
    section : the nodes whose mean it follows
    weights : (k,)
    rest : (2,), mean of the undeformed nodes, m
    radius : m
    symmetry_factor : 2 for a half model, else 1: the constants are those of the full body
    """

    constants: tuple[float, float, float, float]
    section: Section
    weights: Array
    rest: Array
    radius: float
    symmetry_factor: int


@dataclass(frozen=True)
class LumpedLaw(ContactLaw):
    """The law on one point, which stands for the whole surface.

    The nodes have no pressure and no stiffness of their own. The history's `anchor` is
    (1, MEMORY + 1): the memory of `lumped_force`, then θ, which counts full turns.

    stiffest : `LumpedContact.stiffest`, N/m
    """

    parts: LumpedPoint
    stiffest: float

    @property
    def coupled_eigenvalue(self) -> float:
        """k_max/m (1 + m R²/J), rad²/s².

        The springs act on the mean: K_c = k w wᵀ, whose largest eigenvalue in M⁻¹K_c is
        k Σ w_i²/m_i = k/m for mass weights, m = Σ m_i; a rolling sphere's tangential spring turns
        the section, of inertia J, as well.
        """
        section, factor = self.parts.section, self.parts.symmetry_factor
        mass = factor * float(section.masses.sum())
        inertia = factor * float(section.masses @ (section.arms**2).sum(axis=1))
        return self.stiffest * (1.0 / mass + self.parts.radius**2 / inertia)

    def new_memory(self, displacement: Array, angle: float) -> Memory:
        """See `ContactLaw`."""
        anchor = np.zeros((1, MEMORY + 1))
        if self.parts.radius:
            anchor[0, TURN] = self.parts.section.angle(displacement, angle)
        return Memory(np.zeros(1, dtype=np.bool_), anchor, np.zeros((1, 0)))

    def touching_points(self, position: Array) -> Array:
        """C alone, (1, 2); its X, on which no gap depends, is the mean's."""
        x, y = (float(self.parts.weights @ axis) for axis in position.T[:2].copy())
        return np.array([[x, y - self.parts.radius]])

    def separation_s(self, times: Array, forces: Array) -> float:
        """Where F_n = 0 on the line through the last two steps: one point lets go at once."""
        drop = forces[1] - forces[0]
        if not drop < 0.0:
            return float(times[-1])
        return float(times[0] - forces[0] * (times[1] - times[0]) / drop)


@inner()
def lumped_point_forces(
    point: LumpedPoint, motion: Motion, memory: Memory, residual: Array, row: Array
) -> None:
    """See `LumpedPoint` and `lumped_force`; `row` as in `law.contact_forces`."""
    section, weights, radius = point.section, point.weights, point.radius
    own, displacement, velocity = memory.anchor[0], motion.displacement, motion.velocity
    x, y, v_x, v_y = point.rest[0], point.rest[1], 0.0, 0.0
    for j in range(weights.size):
        i = section.nodes[j]
        x += weights[j] * displacement[i, 0]
        y += weights[j] * displacement[i, 1]
        v_x += weights[j] * velocity[i, 0]
        v_y += weights[j] * velocity[i, 1]
    turn = section_angle(section, displacement, own[TURN]) if radius > 0.0 else 0.0
    x += radius * turn
    v_x += radius * ((turn - own[TURN]) / motion.step)
    gap, energies = y - radius + motion.height, np.zeros(lumped.ENERGIES)
    k, restitution, ratio, hertz = point.constants
    tangential, normal = lumped_force(
        x, gap, v_x, v_y, k, restitution, ratio, hertz, motion.friction, own[:MEMORY], energies
    )
    own[TURN] = turn
    memory.touching[0] = normal > 0.0
    share = 1.0 / point.symmetry_factor  # exact
    for j in range(weights.size):
        i = section.nodes[j]
        residual[i, 0] -= weights[j] * (tangential * share)
        residual[i, 1] -= weights[j] * (normal * share)
    if radius > 0.0 and tangential != 0.0:
        apply_couple(section, radius * (tangential * share), displacement, residual)
    row[:] = 0.0
    row[law.NORMAL], row[law.TANGENTIAL] = normal, tangential
    row[law.EXCESS] = max(0.0, abs(tangential) - motion.friction * normal)
    row[law.SPRING_ENERGY] = energies[lumped.STORED]
    row[law.DISSIPATION] = energies[lumped.FRICTION_LOSS]
    row[law.DAMPING] = energies[lumped.HYSTERESIS_LOSS]
    row *= share
    row[law.GAP] = gap


use_for(contact_forces, LumpedPoint, lambda *args: lumped_point_forces(*args))


def lumped_law(
    mesh: meshes.FingerMesh, mass: Array, symmetry_factor: int, constants: LumpedContact
) -> LumpedLaw:
    """The law on the flat end's mean, or on the lowest point of the hemispherical end.

    Raises ValueError: the last phalanx has neither a flat end face nor a section at its sphere's
        equator.
    """
    last, radius = mesh.phalanges, 0.0
    nodes = np.asarray(mesh.node_sets.get(f"distal_face_{last}", ()), dtype=np.int64)
    if not nodes.size:
        body = np.unique(mesh.cells[mesh.cell_sets[f"phalanx_{last}"]])
        x, radius = mesh.points[body, 0], float(mesh.radii[-1])
        nodes = body[np.abs(x - (x.min() + radius)) < 1e-6 * radius]
        if nodes.size < 3:
            raise ValueError(
                f"mesh: no node set 'distal_face_{last}' and no section of nodes at "
                f"x = {x.min() + radius:.6g} m, the equator of a hemispherical end; the lumped law "
                "acts on one of the two: mesh the finger with `meshes`"
            )
    section = build_section(mesh.points, nodes, mass)
    weights = section.masses / section.masses.sum()
    point = LumpedPoint(
        constants.constants, section, weights, weights @ mesh.points[nodes, :2], radius,
        symmetry_factor,
    )  # fmt: skip
    return LumpedLaw(
        nodes=nodes,
        area=np.full(nodes.size, np.inf),
        stiffness=np.zeros(nodes.size),
        damping=np.zeros(nodes.size),
        parts=point,
        stiffest=constants.stiffest,
    )
