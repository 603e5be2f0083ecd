"""Small bodies for the reference's stability maps: a block, even or distorted, a short finger."""

from functools import lru_cache

import numpy as np

import meshes
from meshes.topology import outer_facets, structured

SIDE = 0.02  # m, of the block
FINGER_LENGTH, FINGER_DIAMETER = 0.03, 0.015  # m
# The coarsest finger whose section and tip still have a core and a ring.
FINGER_SIZES = meshes.Sizing(section_size=5e-3, axial_size=5e-3, tip_size=5e-3)


@lru_cache(maxsize=64)
def block(dim: int, divisions: int, distortion: float = 0.0, seed: int = 0) -> meshes.FingerMesh:
    """A cube (half of it, Z >= 0) or a square plate about the origin; all of its outside may touch.

    Interior nodes are moved in each direction by up to the share `distortion` of an edge, evenly
    distributed; those on the outside stay.
    """
    axes = [np.linspace(-SIDE / 2, SIDE / 2, divisions + 1)] * 2
    if dim == 3:
        axes = [*axes, np.linspace(0.0, SIDE / 2, divisions // 2 + 1)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    number = np.arange(grid[..., 0].size).reshape(grid.shape[:-1])
    cells = structured(number)
    points = grid.reshape(-1, dim)
    limits = [(axis[0], axis[-1]) for axis in axes]
    inside = np.all(
        [(x > a + 1e-9) & (x < b - 1e-9) for x, (a, b) in zip(points.T, limits, strict=True)],
        axis=0,
    )
    moves = np.random.default_rng(seed).uniform(-1.0, 1.0, points.shape) * SIDE / divisions
    points = points + distortion * moves * inside[:, None]
    sets = {"pole": np.array([number[0, divisions // 2].flat[0]])}
    skin = outer_facets(cells)
    skin = skin[np.lexsort(np.sort(skin, axis=1).T[::-1])]
    if dim == 3:
        sets["symmetry"] = np.flatnonzero(points[:, 2] == 0.0)
        skin = skin[~(points[skin][..., 2] == 0.0).all(axis=1)]
    return meshes.FingerMesh(
        points, cells, sets, {"surface": skin}, {"phalanx_1": np.arange(len(cells))}
    )


@lru_cache(maxsize=4)
def finger(dim: int) -> meshes.FingerMesh:
    """One phalanx with a round end, hinged at the origin."""
    geometry = meshes.FingerGeometry((FINGER_LENGTH,), (FINGER_DIAMETER,))
    build = meshes.finger_hexahedra if dim == 3 else meshes.finger_quadrilaterals
    return build(geometry, FINGER_SIZES)
