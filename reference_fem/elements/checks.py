"""The checks of given arrays that every element shares."""

import numpy as np

from reference_fem.arrays import Array, Index


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


def check_relaxation(relaxation: Array | None, n_cells: int) -> Array:
    """Return the relaxation times, s, (n_cells,), zeros for None.

    Raises
    ------
    ValueError
        If the shape is wrong or one is negative or not finite.
    """
    if relaxation is None:
        return np.zeros(n_cells)
    tau = np.ascontiguousarray(relaxation, dtype=np.float64)
    if tau.shape != (n_cells,):
        raise ValueError(f"relaxation has shape {tau.shape}; one value per cell, ({n_cells},)")
    wrong = ~((tau >= 0.0) & np.isfinite(tau))
    if wrong.any():
        raise ValueError(f"relaxation is {tau[wrong][0]} s in a cell; it must be 0 or above")
    return tau


def damping_rows(relaxation: Array) -> tuple[Array, ...]:
    """What the kernels store of the relaxation times, (n_cells,): nothing where all are zero."""
    return (relaxation,) if relaxation.any() else ()


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
