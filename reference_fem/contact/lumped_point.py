"""The point of a solid on which a lumped contact law acts."""

from dataclasses import dataclass

import numpy as np

import meshes
from reference_fem.arrays import Array, Index
from reference_fem.joints.section import Section, build_section


@dataclass(frozen=True)
class LumpedPoint:
    """A point C that moves with the mean of a section's nodes, w_i = m_i/Σ m.

    radius 0: C is the mean itself, here of the flat end face (the reduced model's tip node).
    radius R: C is the lowest point of a sphere about the mean, here the equator's section of the
    hemispherical end; it rolls, so that with the section's rotation θ

        g = Σ w_i y_i - R + H,   x_C = Σ w_i x_i + R θ,   f_i = w_i (F_t, F_n), couple R F_t.

    section : the nodes whose mean it follows
    weights : (k,)
    rest : (2,), mean of the undeformed nodes, m
    radius : m
    """

    section: Section
    weights: Array
    rest: Array
    radius: float

    def position(self, displacement: Array, near: float) -> tuple[float, float, float]:
        """(x_C, y_C, θ), m and rad; θ on the branch nearest to `near`."""
        x, y = self.rest + self.weights @ displacement[self.section.nodes, :2]
        turn = self.section.angle(displacement, near) if self.radius else 0.0
        return float(x) + self.radius * turn, float(y) - self.radius, turn

    def velocity(self, velocity: Array, turning: float) -> tuple[float, float]:
        """Velocity of C, m/s, the section turning at `turning`, rad/s."""
        vx, vy = self.weights @ velocity[self.section.nodes, :2]
        return float(vx) + self.radius * turning, float(vy)

    def load(self, tangential: float, normal: float, displacement: Array, residual: Array) -> None:
        """Subtract the nodal forces of (F_t, F_n) on the mesh as given from the residual."""
        residual[self.section.nodes, 0] -= self.weights * tangential
        residual[self.section.nodes, 1] -= self.weights * normal
        if self.radius and tangential:
            self.section.apply_couple(self.radius * tangential, displacement, residual)


def lumped_point(mesh: meshes.FingerMesh, mass: Array) -> LumpedPoint:
    """The flat end's mean, or the lowest point of the hemispherical end.

    Raises ValueError: the last phalanx has neither a flat end face nor a section at its sphere's
        equator.
    """
    last = mesh.phalanges
    flat = np.asarray(mesh.node_sets.get(f"distal_face_{last}", ()), dtype=np.int64)
    if flat.size:
        return _point(mesh, mass, flat, 0.0)
    nodes = np.unique(mesh.cells[mesh.cell_sets[f"phalanx_{last}"]])
    x, y = mesh.points[nodes, 0], mesh.points[nodes, 1]
    radius = float(np.abs(y).max())
    equator = nodes[np.abs(x - (x.min() + radius)) < 1e-6 * radius]
    if equator.size < 3:
        raise ValueError(
            f"mesh: no node set 'distal_face_{last}' and no section of nodes at "
            f"x = {x.min() + radius:.6g} m, the equator of a hemispherical end; the lumped law "
            "acts on one of the two: mesh the finger with `meshes`"
        )
    return _point(mesh, mass, equator, radius)


def _point(mesh: meshes.FingerMesh, mass: Array, nodes: Index, radius: float) -> LumpedPoint:
    section = build_section(mesh.points, nodes, mass)
    weights = section.masses / section.masses.sum()
    return LumpedPoint(section, weights, weights @ mesh.points[nodes, :2], radius)
