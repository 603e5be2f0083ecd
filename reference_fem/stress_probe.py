"""Axial stress at R: mid-length of the last phalanx, lower surface."""

import math
from dataclasses import dataclass

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.elements.base import ElementKernel
from reference_fem.joints.section import Section, build_section


@dataclass(frozen=True)
class StressProbe:
    """Extrapolates the section's axial stress to its lower surface.

    The cells that reach the cross-section through R give σ = t·σ_Cauchy·t at their centres, t
    being the phalanx's current axis (best-fit rotation of those cells' nodes). A volume-weighted
    least-squares line σ(y) = a + b y over the section, evaluated at y = -R, is the reading: the
    beam's "axial + bending" stress (paper section 4), free of the mesh's arrangement. Centre
    values of a linear field are exact, so for bending the line is as well.

    cells : (k,)
    weights : (k,), the reading is weights·σ: the line fit is linear in its data
    section : of the cells' nodes, for the rotation
    """

    cells: Index
    weights: Array
    section: Section

    def read(self, kernel: ElementKernel, displacement: Array, velocity: Array) -> float:
        """Axial Cauchy stress at R, Pa; tension positive."""
        angle = self.section.angle(displacement)
        c, s = math.cos(angle), math.sin(angle)
        stress = kernel.cell_stress(displacement, self.cells, velocity)
        shear = stress[:, 3 if kernel.dim == 3 else 2]
        axial = c * c * stress[:, 0] + s * s * stress[:, 1] + 2.0 * c * s * shear
        return float(self.weights @ axial)


def build_probe(
    points: Array, cells: Index, candidates: Index, cell_volume: Array, lumped_mass: Array
) -> StressProbe:
    """Probe at mid-length of the body made of the cells `candidates`.

    Parameters
    ----------
    points : (n_points, dim)
    cells : (n_cells, 8 | 4)
    candidates : (m,), cells of the last phalanx
    cell_volume : (n_cells,)
    lumped_mass : (n_points,)
    """
    along = points[cells[candidates], 0]
    middle = 0.5 * (along.min() + along.max())
    slack = 1e-6 * (along.max() - along.min())
    reaches = (along.min(axis=1) <= middle + slack) & (along.max(axis=1) >= middle - slack)
    chosen = candidates[reaches]
    centre = points[cells[chosen]].mean(axis=1)[:, 1]
    lower = points[np.unique(cells[candidates]), 1].min()
    design = np.stack([np.ones_like(centre), centre], axis=1)
    root = np.sqrt(cell_volume[chosen])[:, None]
    weights = np.array([1.0, lower]) @ np.linalg.pinv(design * root) * root[:, 0]
    section = build_section(points, np.unique(cells[chosen]), lumped_mass)
    return StressProbe(chosen, weights, section)
