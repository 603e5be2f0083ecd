"""The lumped contact law on one point of a solid."""

from dataclasses import dataclass

import numpy as np

import meshes
from reference_fem.arrays import Array
from reference_fem.contact import law, lumped
from reference_fem.contact.law import ContactLaw, Memory, Motion
from reference_fem.contact.lumped import MEMORY, TURN, LumpedContact, lumped_force
from reference_fem.joints.section import Section, build_section


@dataclass(frozen=True)
class LumpedLaw(ContactLaw):
    """The law on a point C that moves with the mean of a section's nodes, w_i = m_i/Σ m.

    radius 0: C is the mean itself, here of the flat end face (the reduced model's tip node).
    radius R: C is the lowest point of a sphere about the mean, here the equator's section of the
    hemispherical end; it rolls, so that with the section's rotation θ

        g = Σ w_i y_i - R + H,   x_C = Σ w_i x_i + R θ,   f_i = w_i (F_t, F_n), couple R F_t.

    C stands for the whole surface: the nodes have no pressure and no stiffness of their own. The
    history's `anchor` is (1, MEMORY + 1): the memory of `lumped_force`, then θ, which counts full
    turns.

    constants
    section : the nodes whose mean it follows
    weights : (k,)
    rest : (2,), mean of the undeformed nodes, m
    radius : m
    symmetry_factor : 2 for a half model, else 1: the constants are those of the full body
    """

    constants: LumpedContact
    section: Section
    weights: Array
    rest: Array
    radius: float
    symmetry_factor: int

    @property
    def coupled_eigenvalue(self) -> float:
        """k_max/m (1 + m R²/J), rad²/s².

        The springs act on the mean: K_c = k w wᵀ, whose largest eigenvalue in M⁻¹K_c is
        k Σ w_i²/m_i = k/m for mass weights, m = Σ m_i; a rolling sphere's tangential spring turns
        the section, of inertia J, as well.
        """
        section = self.section
        mass = self.symmetry_factor * float(section.masses.sum())
        inertia = self.symmetry_factor * float(section.masses @ (section.arms**2).sum(axis=1))
        return self.constants.stiffest * (1.0 / mass + self.radius**2 / inertia)

    def new_memory(self, displacement: Array, angle: float) -> Memory:
        """See `ContactLaw`."""
        anchor = np.zeros((1, MEMORY + 1))
        anchor[0, TURN] = self._turn(displacement, angle)
        return Memory(np.zeros(1, dtype=np.bool_), anchor, np.zeros((1, 0)))

    def touching_points(self, position: Array) -> Array:
        """C alone, (1, 2); its X, on which no gap depends, is the mean's."""
        x, y = (float(self.weights @ axis) for axis in position.T[:2].copy())
        return np.array([[x, y - self.radius]])

    def separation_s(self, times: Array, forces: Array) -> float:
        """Where F_n = 0 on the line through the last two steps: one point lets go at once."""
        drop = forces[1] - forces[0]
        if not drop < 0.0:
            return float(times[-1])
        return float(times[0] - forces[0] * (times[1] - times[0]) / drop)

    def apply(self, motion: Motion, memory: Memory, residual: Array, row: Array) -> None:
        """See `lumped_force`."""
        own, nodes, displacement = memory.anchor[0], self.section.nodes, motion.displacement
        x, y = (self.rest + self.weights @ displacement[nodes, :2]).tolist()
        v_x, v_y = (self.weights @ motion.velocity[nodes, :2]).tolist()
        turn = self._turn(displacement, own[TURN])
        x += self.radius * turn
        v_x += self.radius * ((turn - own[TURN]) / motion.step)
        gap, energies = y - self.radius + motion.height, np.zeros(lumped.ENERGIES)
        constants = self.constants.constants
        tangential, normal = lumped_force(
            x, gap, v_x, v_y, *constants, motion.friction, own[:MEMORY], energies
        )
        own[TURN] = turn
        memory.touching[0] = normal > 0.0
        factor = self.symmetry_factor
        residual[nodes, 0] -= self.weights * (tangential / factor)
        residual[nodes, 1] -= self.weights * (normal / factor)
        if self.radius and tangential:
            self.section.apply_couple(self.radius * (tangential / factor), displacement, residual)
        row[:] = 0.0
        row[law.NORMAL], row[law.TANGENTIAL] = normal, tangential
        row[law.EXCESS] = max(0.0, abs(tangential) - motion.friction * normal)
        row[law.SPRING_ENERGY] = energies[lumped.STORED]
        row[law.DISSIPATION] = energies[lumped.FRICTION_LOSS]
        row[law.DAMPING] = energies[lumped.HYSTERESIS_LOSS]
        row /= factor
        row[law.GAP] = gap

    def _turn(self, displacement: Array, near: float) -> float:
        """θ, rad, on the branch nearest to `near`."""
        return self.section.angle(displacement, near) if self.radius else 0.0


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
    rest = weights @ mesh.points[nodes, :2]
    return LumpedLaw(
        nodes=nodes,
        area=np.full(nodes.size, np.inf),
        stiffness=np.zeros(nodes.size),
        damping=np.zeros(nodes.size),
        constants=constants,
        section=section,
        weights=weights,
        rest=rest,
        radius=radius,
        symmetry_factor=symmetry_factor,
    )
