"""Geometry of elements at their points, from scikit-fem: volumes, gradients, Jacobians."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from skfem import ElementHex1, ElementQuad1, MeshHex, MeshQuad
from skfem.quadrature import get_quadrature

from reference_fem.arrays import Array, Index

# Corners of VTK's (and gmsh's) cells in the reference square and cube [0, 1]^dim.
CORNERS = {
    2: np.array([[0, 0], [1, 0], [1, 1], [0, 1]]),
    3: np.array(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
    ),
}
CHUNK = 4096  # elements handled at once: 24 x 24 stiffness matrices of 19 MB


def check_mesh(points: Array, cells: Index, dim: int) -> tuple[Array, Index]:
    """Return points (n, dim) and cells (m, 2^dim) as contiguous float64 and int64.

    Raises ValueError: a shape is wrong, a coordinate is not finite or a cell names a node that does
        not exist.
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    cells = np.ascontiguousarray(cells, dtype=np.int64)
    if points.ndim != 2 or points.shape[1] != dim:
        raise ValueError(f"points has shape {points.shape}; (n_nodes, {dim}) is needed")
    if cells.ndim != 2 or cells.shape[1] != 2**dim or not len(cells):
        raise ValueError(f"cells has shape {cells.shape}; (n_cells > 0, {2**dim}) is needed")
    if not np.isfinite(points).all():
        raise ValueError("points holds values that are not finite; check the mesh")
    if cells.min() < 0 or cells.max() >= len(points):
        raise ValueError(
            f"cells names nodes {cells.min()}..{cells.max()}; only 0..{len(points) - 1} exist"
        )
    return points, cells


@dataclass(frozen=True, eq=False)
class Geometry:
    """Some elements at their 2^dim Gauss points, point q the one nearest to corner q.

    cells : which elements
    weights : (n, q) volumes of the points, m^3; m^2 of a sheet without a thickness
    jacobian : (n, q, dim, dim) dX_i/dxi_k, m
    gradients : (n, q, a, dim) shape gradients, 1/m, corners a in VTK's order
    centre_gradients : (n, a, dim) the same at the centre
    shape : (q, a) shape functions at the points
    """

    cells: slice
    weights: Array
    jacobian: Array
    gradients: Array
    centre_gradients: Array
    shape: Array

    @property
    def volume(self) -> Array:
        """Volume of each element, (n,)."""
        return self.weights.sum(axis=1)

    @property
    def corner_volumes(self) -> Array:
        """Integrals of the shape functions, (n, a)."""
        return self.weights @ self.shape

    def rows_of_points(self) -> Array:
        """`triangular_inverse` and volume of each point in a row, (n, q (dim (dim + 1)/2 + 1))."""
        rows = np.dstack((triangular_inverse(self.jacobian), self.weights))
        return rows.reshape(len(rows), -1)


@dataclass(frozen=True, eq=False)
class ReferenceElement:
    """The linear square or cube [0, 1]^dim; its Gauss points, the q-th the nearest to corner q.

    place : VTK's number of each of scikit-fem's corners
    points : (dim, q + 1), the last is the centre
    weights : (q,)
    shape : (q, a) shape functions at the Gauss points, corners a in VTK's order
    slopes : (a, dim, q + 1) dN_a/dxi_k at all points
    """

    place: list[int]
    points: Array
    weights: Array
    shape: Array
    slopes: Array


def reference_element(dim: int) -> ReferenceElement:
    """The reference element, from scikit-fem."""
    element = ElementHex1() if dim == 3 else ElementQuad1()
    place = [int(np.flatnonzero((CORNERS[dim] == c).all(axis=1))[0]) for c in element.doflocs]
    x, w = get_quadrature(element, 3)
    nearest = (CORNERS[dim][:, :, None] == np.round(x)).all(axis=1)  # (corner, point)
    order = nearest.argmax(axis=1)
    points = np.hstack((x[:, order], np.full((dim, 1), 0.5)))
    values = [element.lbasis(points, i) for i in np.argsort(place)]
    shape = np.stack([value[:-1] for value, _ in values], axis=1)
    slopes = np.stack([slope for _, slope in values])
    return ReferenceElement(place, points, w[order], shape, slopes)


def geometries(points: Array, cells: Index, thickness: Array | None = None) -> Iterator[Geometry]:
    """Geometry of all elements, CHUNK at a time, so that set-up needs little memory.

    points, cells : (n_nodes, dim), m, and (n_cells, 2^dim) in VTK's order.
    thickness : (n_cells, 4), m, of a sheet at its points.

    Raises ValueError: an element's Jacobian is not positive at one of its points.
    """
    dim = points.shape[1]
    reference, kind = reference_element(dim), MeshHex if dim == 3 else MeshQuad
    # Handing scikit-fem each VTK corner as the same reference corner keeps the Jacobian of a
    # well-formed element positive.
    place = reference.place
    for start in range(0, len(cells), CHUNK):
        some = slice(start, min(start + CHUNK, len(cells)))
        used, local = np.unique(cells[some], return_inverse=True)
        local = local.reshape(-1, len(place))
        mapping = kind(
            np.ascontiguousarray(points[used].T), np.ascontiguousarray(local[:, place].T)
        ).mapping()
        jacobian = mapping.DF(reference.points).transpose(2, 3, 0, 1)
        det = np.linalg.det(jacobian)
        if not (det > 0.0).all():
            wrong = np.flatnonzero(~(det > 0.0).all(axis=1)) + start
            raise ValueError(
                f"{len(wrong)} elements (the first is cell {wrong[0]}) have a Jacobian that is not "
                "positive: inverted, degenerate or not in VTK's node order; fix the mesh"
            )
        inverse = mapping.invDF(reference.points)  # (k reference, i space, n, q)
        gradients = np.empty((len(local), reference.points.shape[1], len(place), dim))
        for a, slope in enumerate(reference.slopes):
            gradients[:, :, a, :] = np.einsum("kq,kinq->nqi", slope, inverse)
        weights = det[:, :-1] * reference.weights
        yield Geometry(
            cells=some,
            weights=weights if thickness is None else weights * thickness[some],
            jacobian=jacobian[:, :-1],
            gradients=gradients[:, :-1],
            centre_gradients=gradients[:, -1],
            shape=reference.shape,
        )


def by_element(
    chunks: Iterator[Geometry], values: Callable[[Geometry], tuple[Array, ...]]
) -> list[Array]:
    """Each of the `values` of all chunks in one array, (n_cells, ...)."""
    return [np.concatenate(parts) for parts in zip(*map(values, chunks), strict=True)]


def triangular_inverse(jacobian: Array) -> Array:
    """R^-1 of J = Q R with Q a rotation and R upper triangular with a positive diagonal.

    Modified Gram-Schmidt on the columns of J, whose R is backward stable.

    jacobian : (n, q, dim, dim), m, positive determinants.

    Returns (n, q, dim (dim + 1)/2), rows of the upper triangle (11, 12, 13, 22, 23, 33 or
    11, 12, 22), 1/m.
    """
    dim = jacobian.shape[-1]
    columns = [jacobian[..., k] for k in range(dim)]
    r = np.zeros(jacobian.shape)
    for k in range(dim):
        r[..., k, k] = np.linalg.norm(columns[k], axis=-1)
        q = columns[k] / r[..., k, k, None]
        for j in range(k + 1, dim):
            r[..., k, j] = np.einsum("nqi,nqi->nq", q, columns[j])
            columns[j] = columns[j] - r[..., k, j, None] * q
    upper = np.triu_indices(dim)
    inverse = np.asarray(np.linalg.inv(r), dtype=np.float64)
    return inverse[..., upper[0], upper[1]]
