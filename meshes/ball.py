"""A half ball (Z >= 0) of hexahedra, refined towards its lowest point, for Hertz's problem."""

import math

import numpy as np

from meshes.grading import Grading
from meshes.mesh import FingerMesh, Floats, Ints
from meshes.topology import outer_facets, structured

CORE = 0.5  # half side of the inner cube over the radius
BULGE = 0.3  # how far the cube is blown up towards a ball: 0 not at all, 1 entirely


def graded(first: float, growth: float, even: float) -> Floats:
    """Positions from 0 to 1: edges `first` up to `even`, then growing, scaled to fit."""
    grading = Grading(first, growth, even, 1.0)
    nodes = grading.divide(0.0, 1.0, least=2).nodes
    return np.array([0.0, *nodes, 1.0])


def half_ball(radius: float, tip_size: float, growth: float, patch_size: float = 0.0) -> FingerMesh:
    """Cubed ball about the origin: an inner cube and blocks out to the sphere.

    Edges grow by `growth` from `tip_size` at the lowest point, in all directions; within
    `patch_size` on the surface they do not grow. `surface` is the lower half of the sphere, `tip`
    all of it.
    """
    tip = tip_size / radius
    # Tangential coordinate: the angle over 45 degrees; radial: from the sphere inwards.
    right = graded(tip / (math.pi / 4), growth, patch_size / radius / (math.pi / 4))
    across = np.concatenate([-right[:0:-1], right])
    inwards = 1.0 - graded(tip / (1.0 - CORE), growth, 0.0)[::-1]
    # The cube's own vertical edges: as long as the widest on its sides.
    upwards = np.linspace(-1.0, 1.0, 2 * max(2, round(0.6 / (right[-1] - right[-2])) // 2) + 1)
    patches = {  # direction, first and second tangential axis (right-handed), their coordinates
        "-y": ((0, -1, 0), (1, 0, 0), (0, 0, 1), across, right),
        "+y": ((0, 1, 0), (0, 0, 1), (1, 0, 0), right, across),
        "-x": ((-1, 0, 0), (0, 0, 1), (0, 1, 0), right, upwards),
        "+x": ((1, 0, 0), (0, 1, 0), (0, 0, 1), upwards, right),
        "+z": ((0, 0, 1), (1, 0, 0), (0, 1, 0), across, upwards),
    }
    blocks = []
    for normal, first, second, along, beside in patches.values():
        a, b, c = np.meshgrid(along, beside, inwards, indexing="ij")
        n, s, t = (np.array(axis, dtype=float) for axis in (normal, first, second))
        inner = _blown_up(n + a[..., None] * s + b[..., None] * t)
        flat = n + _bent(a)[..., None] * s + _bent(b)[..., None] * t
        outer = flat / np.linalg.norm(flat, axis=-1, keepdims=True)
        blocks.append(inner + c[..., None] * (outer - inner))
    cube = np.stack(np.meshgrid(across, upwards, right, indexing="ij"), axis=-1)
    blocks.append(_blown_up(cube))
    points, cells = _merged(blocks)
    points *= radius
    facets = outer_facets(cells)
    middle = points[facets].mean(axis=1)
    on_sphere = np.linalg.norm(points[facets], axis=2).min(axis=1) > (1 - 1e-9) * radius
    return FingerMesh(
        points,
        cells,
        {
            "symmetry": np.flatnonzero(points[:, 2] == 0.0),
            "pole": np.array([np.argmin(points[:, 1])]),
        },
        {"surface": facets[on_sphere & (middle[:, 1] < 0.0)], "tip": facets[on_sphere]},
        {"phalanx_1": np.arange(len(cells))},
    )


def _bent(a: Floats) -> Floats:
    return np.tan(0.25 * math.pi * a)


def _blown_up(cube: Floats) -> Floats:
    """Points of the cube [-1, 1]^3, shrunk to the core and blown up a little."""
    reach = np.abs(cube).max(axis=-1, keepdims=True)
    length = np.linalg.norm(_bent(cube), axis=-1, keepdims=True)
    ball = _bent(cube) * reach / np.where(length > 0.0, length, 1.0)
    return CORE * ((1 - BULGE) * cube + BULGE * math.sqrt(2.0) * ball)


def _merged(blocks: list[Floats]) -> tuple[Floats, Ints]:
    """Nodes and cells of structured blocks (i, j, k, 3) whose common faces coincide."""
    cells, offset = [], 0
    for block in blocks:
        n = np.arange(block[..., 0].size).reshape(block.shape[:3]) + offset
        cells.append(structured(n))
        offset += n.size
    every = np.concatenate([block.reshape(-1, 3) for block in blocks])
    every[np.abs(every) < 1e-12] = 0.0
    _, first, place = np.unique(
        np.round(every, 10) + 0.0, axis=0, return_index=True, return_inverse=True
    )
    return every[first], place.ravel()[np.concatenate(cells)]
