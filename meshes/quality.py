"""Element quality: scaled Jacobian, edge lengths, characteristic length, critical step."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from meshes.mesh import FingerMesh, Floats, Ints, MeshError
from meshes.topology import local_facets

# Each corner with its neighbours along the three (two) local axes, right-handed.
_CORNERS_3D = np.array([
    [0, 1, 3, 4], [1, 2, 0, 5], [2, 3, 1, 6], [3, 0, 2, 7],
    [4, 7, 5, 0], [5, 4, 6, 1], [6, 5, 7, 2], [7, 6, 4, 3],
])  # fmt: skip
_CORNERS_2D = np.array([[0, 1, 3], [1, 2, 0], [2, 3, 1], [3, 0, 2]])
_EDGES_3D = np.array(
    [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]]
)


@dataclass(frozen=True)
class Quality:
    """Figures of one mesh; `inverted` counts elements with a Jacobian <= 0 at some corner."""

    min_scaled_jacobian: float
    mean_scaled_jacobian: float
    min_edge_m: float
    max_edge_m: float
    inverted: int
    elements: int
    min_characteristic_length_m: float


def scaled_jacobians(points: Floats, cells: Ints) -> Floats:
    """Scaled Jacobian of each element, (n_cells,): 1 for a brick, <= 0 if inverted.

    The smallest over the corners of ``det(e1, e2, e3) / (|e1| |e2| |e3|)``, e the edges that leave
    the corner (Knupp, SIAM J. Sci. Comput. 23 (2001) 193); 0 where an edge has no length.
    """
    table = _CORNERS_3D if points.shape[1] == 3 else _CORNERS_2D
    nodes = points[cells]
    worst = np.full(cells.shape[0], np.inf)
    for corner, *neighbours in table:
        edges = nodes[:, neighbours] - nodes[:, [corner]]
        lengths = np.linalg.norm(edges, axis=2).prod(axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            scaled = np.where(lengths > 0.0, np.linalg.det(edges) / lengths, 0.0)
        worst = np.minimum(worst, scaled)
    return worst


def edge_lengths(points: Floats, cells: Ints) -> Floats:
    """Lengths of each element's edges, (n_cells, 12 or 4), m."""
    table = _EDGES_3D if points.shape[1] == 3 else local_facets(2)
    ends = points[cells[:, table]]
    return np.asarray(np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2))


def volumes(points: Floats, cells: Ints) -> Floats:
    """Volume (area in 2D) of each element, (n_cells,), m^3 or m^2.

    Exact for the trilinear map: the integral of its Jacobian, of degree 2 in each coordinate, by
    two Gauss points a direction.
    """
    dim = points.shape[1]
    signs = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1]], dtype=float)
    signs = np.vstack([signs, signs * [1, 1, -1]]) if dim == 3 else signs[:, :2]
    nodes = points[cells]
    total = np.zeros(cells.shape[0])
    for point in signs / math.sqrt(3.0):
        factors = 1.0 + signs * point
        gradient = np.empty((signs.shape[0], dim))
        for axis in range(dim):
            others = [a for a in range(dim) if a != axis]
            gradient[:, axis] = signs[:, axis] * factors[:, others].prod(axis=1) / 2**dim
        total += np.linalg.det(np.einsum("eni,nj->eij", nodes, gradient))
    return total


def characteristic_lengths(points: Floats, cells: Ints) -> Floats:
    """Volume over the largest face (in 2D: area over the longest edge), (n_cells,), m.

    The length that LS-DYNA's theory manual takes for solid elements in ``dt = L/c``.
    """
    if points.shape[1] == 2:
        return np.asarray(volumes(points, cells) / edge_lengths(points, cells).max(axis=1))
    faces = points[cells[:, local_facets(3)]]
    diagonals = np.cross(faces[:, :, 2] - faces[:, :, 0], faces[:, :, 3] - faces[:, :, 1])
    areas = 0.5 * np.linalg.norm(diagonals, axis=2)
    return np.asarray(volumes(points, cells) / areas.max(axis=1))


def quality(mesh: FingerMesh) -> Quality:
    """Quality figures of a mesh (lengths in m)."""
    scaled = scaled_jacobians(mesh.points, mesh.cells)
    edges = edge_lengths(mesh.points, mesh.cells)
    return Quality(
        min_scaled_jacobian=float(scaled.min()),
        mean_scaled_jacobian=float(scaled.mean()),
        min_edge_m=float(edges.min()),
        max_edge_m=float(edges.max()),
        inverted=int(np.count_nonzero(scaled <= 0.0)),
        elements=int(mesh.cells.shape[0]),
        min_characteristic_length_m=float(characteristic_lengths(mesh.points, mesh.cells).min()),
    )


def critical_step(mesh: FingerMesh, wave_speed_m_per_s: float) -> float:
    """Courant step in s: the smallest characteristic length over the wave speed.

    Raises
    ------
    MeshError
        If the wave speed is not positive and finite.
    """
    if not (math.isfinite(wave_speed_m_per_s) and wave_speed_m_per_s > 0.0):
        raise MeshError(
            f"wave_speed_m_per_s = {wave_speed_m_per_s!r}: must be a positive finite number"
        )
    lengths = characteristic_lengths(mesh.points, mesh.cells)
    return float(lengths.min()) / wave_speed_m_per_s
