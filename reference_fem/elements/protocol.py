"""What the explicit loop asks of an element, and the checks that every element shares.

Contract for whoever adds an element (one file for the set-up, one for its compiled kernel; what
elements share is in `base`, `blocks`, `loops` and `threads`):

1. One object per mesh, built once by a function (`hex8`, `quad4_plane_stress`), frozen afterwards.
2. Arrays in, arrays out, SI units, node order of VTK and gmsh.
3. `internal_force` is the exact gradient of `strain_energy`; a rigid motion gives neither.
4. The same input and the same number of threads give the same bits.
5. No call allocates arrays of the size of the mesh except to return them. What a call needs is a
   workspace inside the object, so one object serves one caller at a time (it is not re-entrant).
"""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from reference_fem.arrays import Array, Index
from reference_fem.compiled import njit

Nodes = NDArray[np.uint32]  # unsigned: numba then emits no test for negative indices
# Energies of strains and of hourglass modes by thread, (threads, 2), J. Where it is None, numba
# leaves out all that concerns them.
Stored = Array | None

# Of compiled kernels. No nnan or ninf: a NaN in the displacement must reach the audit, not be
# optimised away.
SAFE_MATH = {"contract", "nsz"}
compiled = njit(cache=True, fastmath=SAFE_MATH, error_model="numpy")
inlined = njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)


class ElementKernel(Protocol):
    """Elements of one kind on one mesh."""

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""

    @property
    def n_cells(self) -> int:
        """Number of elements."""

    @property
    def dim(self) -> int:
        """Number of space dimensions, 2 or 3."""

    @property
    def lumped_mass(self) -> Array:
        """Row-sum mass of each node, (n_nodes,), kg, of the body as meshed."""

    @property
    def cell_volume(self) -> Array:
        """Reference volume of each element, (n_cells,), m^3."""

    def internal_force(self, displacement: Array, out: Array) -> None:
        """Overwrite `out` (n_nodes, dim) with the internal force in N.

        Runs on as many threads as numba's current setting (`numba.set_num_threads`).
        """

    @property
    def loop_bytes(self) -> int:
        """What one evaluation of the force reads of the elements, nodal arrays excepted, bytes."""

    def energies(self, displacement: Array) -> tuple[float, float]:
        """All that is stored, J, and what hourglass control holds of it (0 without such control).

        From the strains at the points, not from force times displacement.
        """

    def audited_force(self, displacement: Array, out: Array) -> tuple[float, float]:
        """`internal_force` and `energies` in one pass over the elements.

        It takes 3 % more than the force of 1-point hexahedra, 10 % of 8-point ones, 20 % of plane
        quadrilaterals (measured); a pass for the energies alone, half of it or more.
        """

    def strain_energy(self, displacement: Array) -> float:
        """The first of `energies`, J."""

    def hourglass_energy(self, displacement: Array) -> float:
        """The second of `energies`, J."""

    def cell_stress(self, displacement: Array, cells: Index | None = None) -> Array:
        """Cauchy stress at the elements' centres in Pa.

        (n, 6) as xx, yy, zz, xy, yz, xz in 3D; (n, 3) as xx, yy, xy in 2D. `cells` picks elements
        (all of them when None), so that a probe costs what it looks at.
        """

    def von_mises(self, displacement: Array, cells: Index | None = None) -> Array:
        """Equivalent stress at the elements' centres in Pa, (n,)."""

    def min_det_F(self, displacement: Array) -> float:
        """Smallest det F over all points: zero or less means an inverted element."""

    def max_frequency(self) -> float:
        """Upper bound in rad/s on the largest eigenfrequency at the reference configuration.

        Irons' theorem: with M and K sums of element matrices (here the row-sum masses of each
        element) the largest eigenvalue of the mesh is at most the largest one of any element.
        """


def check_mesh(points: Array, cells: Index, dim: int, corners: int) -> tuple[Array, Index]:
    """Return points (n, dim) and cells (m, corners) as contiguous float64 and int64.

    Raises
    ------
    ValueError
        If a shape is wrong, a coordinate is not finite or a cell names a node that is not there.
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    cells = np.ascontiguousarray(cells, dtype=np.int64)
    if points.ndim != 2 or points.shape[1] != dim:
        raise ValueError(f"points has shape {points.shape}; (n_nodes, {dim}) is needed")
    if cells.ndim != 2 or cells.shape[1] != corners or not len(cells):
        raise ValueError(f"cells has shape {cells.shape}; (n_cells > 0, {corners}) is needed")
    if not np.isfinite(points).all():
        raise ValueError("points holds values that are not finite; check the mesh")
    if cells.min() < 0 or cells.max() >= len(points):
        raise ValueError(
            f"cells names nodes {cells.min()}..{cells.max()}; only 0..{len(points) - 1} exist"
        )
    return points, cells


def check_material(
    young: Array, poisson: Array, density: Array, n_cells: int
) -> tuple[Array, Array, Array]:
    """Return Young's modulus (Pa), Poisson's ratio and density (kg/m^3), each (n_cells,).

    Raises
    ------
    ValueError
        If a shape is wrong or a value lies outside E > 0, -1 < nu < 0.5, rho > 0.
    """
    given = {"young": (young, 0.0, np.inf), "poisson": (poisson, -1.0, 0.5)}
    given["density"] = (density, 0.0, np.inf)
    arrays = []
    for name, (value, low, high) in given.items():
        array = np.ascontiguousarray(value, dtype=np.float64)
        if array.shape != (n_cells,):
            raise ValueError(f"{name} has shape {array.shape}; one value per cell, ({n_cells},)")
        wrong = ~((array > low) & (array < high))
        if wrong.any():
            raise ValueError(f"{name} is {array[wrong][0]} in a cell; allowed: {low} < . < {high}")
        arrays.append(array)
    return arrays[0], arrays[1], arrays[2]


def check_displacement(displacement: Array, shape: tuple[int, int]) -> Array:
    """Return the displacement as the contiguous float64 array that the kernels take.

    Raises
    ------
    ValueError
        If its shape is not (n_nodes, dim).
    """
    displacement = np.ascontiguousarray(displacement, dtype=np.float64)
    if displacement.shape != shape:
        raise ValueError(f"displacement has shape {displacement.shape}; {shape} is needed")
    return displacement


def check_out(out: Array, shape: tuple[int, int]) -> None:
    """Refuse an output array that a kernel could not write in place.

    Raises
    ------
    ValueError
        If `out` is not a C-contiguous float64 array of shape (n_nodes, dim).
    """
    if out.shape != shape or out.dtype != np.float64 or not out.flags.c_contiguous:
        raise ValueError(f"out is {out.dtype}{out.shape}; a C-contiguous float64{shape} is needed")
