"""The 8-node hexahedron with a mean dilatation: set-up from scikit-fem."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.elements.base import ElementKernel, Stresses, lame_constants
from reference_fem.elements.blocks import Blocks
from reference_fem.elements.checks import (
    check_material,
    check_mesh,
    check_relaxation,
    damping_rows,
)
from reference_fem.elements.geometry import by_element, geometries
from reference_fem.elements.hexahedron.eight_point_kernel import SCRATCH_ROWS
from reference_fem.elements.hexahedron.eight_point_outputs import Hex8Blocks, stresses


@dataclass(frozen=True, eq=False)
class Hex8(ElementKernel):
    """8-node hexahedra on one mesh; `gradients` are those at the centres."""

    blocks_of_kind: ClassVar[type[Blocks]] = Hex8Blocks
    scratch_rows: ClassVar[int] = SCRATCH_ROWS
    stresses: ClassVar[Stresses] = stresses
    mean_dilatation: ClassVar[bool] = True


def hex8(
    points: Array, cells: Index, young: Array, poisson: Array, density: Array,
    relaxation: Array | None = None,
) -> Hex8:  # fmt: skip
    """8-node hexahedra with a mean dilatation, St. Venant-Kirchhoff.

    Parameters
    ----------
    points : (n_nodes, 3), m
    cells : (n_cells, 8) in VTK's node order
    young, poisson, density : (n_cells,) Young's modulus (Pa), Poisson's ratio, density (kg/m^3)

    relaxation : (n_cells,) tau of the damping, s; None: none

    Raises
    ------
    ValueError
        If a shape or a material value is wrong, or an element is inverted.
    """
    points, cells = check_mesh(points, cells, 3, 8)
    young, poisson, density = check_material(young, poisson, density, len(cells))
    tau = check_relaxation(relaxation, len(cells))
    mu, lame = lame_constants(young, poisson)
    of_points, volume, corner_volumes, centre_gradients = by_element(
        geometries(points, cells),
        lambda g: (g.rows_of_points(), g.volume, g.corner_volumes, g.centre_gradients),
    )
    return Hex8(
        points=points,
        cells=cells,
        mu=mu,
        lame=lame,
        cell_volume=volume,
        cell_mass=density[:, None] * corner_volumes,
        gradients=centre_gradients,
        relaxation=tau,
        rows=np.column_stack((of_points, mu, lame / volume, *damping_rows(tau))),
    )
