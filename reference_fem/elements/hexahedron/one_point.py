"""The 1-point hexahedron with hourglass stiffness: set-up from scikit-fem."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.elements.base import ElementKernel, Stresses, lame_constants
from reference_fem.elements.blocks import Blocks
from reference_fem.elements.checks import check_material, check_mesh, check_relaxation
from reference_fem.elements.frequency import element_stiffness
from reference_fem.elements.geometry import CHUNK, CORNERS, by_element, geometries
from reference_fem.elements.hexahedron import one_point_kernel as kernel

HOURGLASS = 1.0  # c: exact bending of a cube


def hourglass_signs() -> Array:
    """Hourglass vectors h^n, (4, 8): xi eta, eta zeta, xi zeta, xi eta zeta at the corners."""
    x, y, z = (2.0 * CORNERS[3] - 1.0).T
    return np.ascontiguousarray([x * y, y * z, x * z, x * y * z])


@dataclass(frozen=True, eq=False)
class Hex8OnePoint(ElementKernel):
    """Hexahedra with one point on one mesh; `gradients` are the mean ones.

    control : (n_cells,) hourglass stiffness k, N/m
    """

    control: Array

    blocks_of_kind: ClassVar[type[Blocks]] = kernel.OnePointBlocks
    scratch_rows: ClassVar[int] = kernel.SCRATCH_ROWS
    stresses: ClassVar[Stresses] = kernel.stresses

    def _stiffness_and_mass(self) -> Iterator[tuple[Array, Array]]:
        signs = hourglass_signs()
        for start in range(0, self.n_cells, CHUNK):
            some = slice(start, start + CHUNK)
            b = self.gradients[some]
            stiffness = element_stiffness(
                b[:, None], self.cell_volume[some, None], self.mu[some], self.lame[some], False
            )
            shapes = np.einsum("na,eaj->enj", signs, self.points[self.cells[some]])
            g = signs - np.einsum("enj,eaj->ena", shapes, b)
            control = np.einsum("e,ena,enb,ij->eaibj", self.control[some], g, g, np.eye(3))
            yield stiffness + control.reshape(stiffness.shape), self.cell_mass[some]


def hex8_one_point(
    points: Array, cells: Index, young: Array, poisson: Array, density: Array,
    relaxation: Array | None = None,
) -> Hex8OnePoint:  # fmt: skip
    """8-node hexahedra with one point and hourglass stiffness, St. Venant-Kirchhoff.

    Parameters and errors are those of `hex8`; a relaxation time is one.
    """
    points, cells = check_mesh(points, cells, 3, 8)
    young, poisson, density = check_material(young, poisson, density, len(cells))
    tau = check_relaxation(relaxation, len(cells))
    if tau.any():
        raise ValueError(
            f"relaxation_time = {tau.max():g}: one point damps no hourglass modes, part of "
            "bending: use element = 'hex8-sri', or leave relaxation_time out"
        )
    mu, lame = lame_constants(young, poisson)
    volume, corner_volumes, integrals = by_element(
        geometries(points, cells),
        lambda g: (
            g.volume,
            g.corner_volumes,
            np.einsum("nq,nqai->nai", g.weights, g.gradients),
        ),
    )
    gradients = integrals / volume[:, None, None]
    squares = np.einsum("nai,nai->n", gradients, gradients)
    control = HOURGLASS * young * volume * squares / 72.0
    return Hex8OnePoint(
        points=points,
        cells=cells,
        mu=mu,
        lame=lame,
        cell_volume=volume,
        cell_mass=density[:, None] * corner_volumes,
        gradients=gradients,
        relaxation=tau,
        rows=np.stack((volume * mu, volume * lame, control), axis=1),
        control=control,
    )
