"""Axial stress at R: mid-length of the last phalanx, lower surface."""

import math
from dataclasses import dataclass

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.elements.base import ElementKernel
from reference_fem.elements.section import Section, build_section

# Places that differ by less, over the phalanx's length or a cell's, count as one: with a single
# layer of cells the fit has no slope along the axis.
SAME_PLACE = 1e-6


@dataclass(frozen=True)
class StressProbe:
    """Interpolates the axial stress to the section through R, extrapolates it to its lower surface.

    The cells about the section give σ = t·σ_Cauchy·t at their centres, t being the phalanx's
    current axis (best-fit rotation of those cells' nodes). A volume-weighted least-squares fit
    σ(s, y) = a + b y + s (c + d y), s along the axis from the section, evaluated at (0, -R), is
    the reading: the beam's "axial + bending" stress (paper section 4), independent of the cells'
    arrangement. Centre values of a linear field are exact, so for bending under a shear force the
    fit is as well; its error goes with the square of the cells' length.

    cells : (k,)
    weights : (k,), the reading is weights·σ: the fit is linear in its data
    section : the cells' nodes, for the rotation of the axis
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


def build_probe(kernel: ElementKernel, candidates: Index, radius: float) -> StressProbe:
    """Probe at mid-length of the body made of the cells `candidates`.

    It reads cells whose centres lie within one cut cell's length of the section: a layer on either
    side, or the one that the section halves.

    candidates : (m,), cells of the last phalanx.
    radius : distance R of the lower surface from the axis, m.
    """
    points, cells = kernel.points, kernel.cells
    along = points[cells[candidates], 0]
    first, last = along.min(axis=1), along.max(axis=1)
    middle = 0.5 * (first.min() + last.max())
    slack = SAME_PLACE * (last.max() - first.min())
    cut = (first <= middle + slack) & (last >= middle - slack)
    centre = points[cells[candidates]].mean(axis=1)
    s = centre[:, 0] - middle
    length = (last - first)[cut].max()
    near = np.abs(s) < length - slack
    chosen, s, y = candidates[near], s[near] / length, centre[near, 1] / radius
    design = np.stack([np.ones_like(y), y, s, s * y], axis=1)
    root = np.sqrt(kernel.cell_volume[chosen])
    root /= root.max()
    inverse = np.linalg.pinv(design * root[:, None], rcond=SAME_PLACE)
    weights = np.array([1.0, -1.0, 0.0, 0.0]) @ inverse * root
    section = build_section(points, np.unique(cells[chosen]), kernel.lumped_mass)
    return StressProbe(chosen, weights, section)
