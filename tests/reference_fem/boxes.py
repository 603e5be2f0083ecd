"""Small meshes for the reference's tests: bricks and rectangles, free or hinged in a row."""

import numpy as np

from meshes import FingerMesh
from meshes.topology import structured
from tests.reference_fem.conftest import one_thread  # noqa: F401 - tests import it from here too


def boxes(
    lengths: tuple[float, ...],
    section: tuple[float, ...],
    divisions: tuple[int, ...],
    hinged: bool = True,
    half: bool = False,
) -> FingerMesh:
    """Boxes along -X from the origin; section (height,) in 2D, (height, width) in 3D.

    `half` keeps Z >= 0. `surface` is the lower side (Y = -height/2) of the last box.
    """
    dim = 1 + len(section)
    points, cells, nodes, cell_sets = [], [], {}, {}

    start, offset, first_cell = 0.0, 0, 0
    for w, length in enumerate(lengths, start=1):
        axes = [np.linspace(-start - length, -start, divisions[0] + 1)]
        axes.append(np.linspace(-section[0] / 2, section[0] / 2, divisions[1] + 1))
        if dim == 3:
            low = 0.0 if half else -section[1] / 2
            axes.append(np.linspace(low, section[1] / 2, divisions[2] + 1))
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        number = np.arange(grid[..., 0].size).reshape(grid.shape[:-1]) + offset
        cell, surface = structured(number), structured(number[:, 0])
        points.append(grid.reshape(-1, dim))
        cells.append(cell)
        cell_sets[f"phalanx_{w}"] = np.arange(first_cell, first_cell + len(cell))
        nodes[f"proximal_face_{w}"] = number[-1].ravel()
        if hinged:
            nodes[f"hinge_{w}_proximal"] = number[-1].ravel()
            if w < len(lengths):
                nodes[f"hinge_{w}_distal"] = number[0].ravel()
        if w < len(lengths):
            nodes[f"distal_face_{w}"] = number[0].ravel()
        start, offset, first_cell = start + length, offset + number.size, first_cell + len(cell)
    all_points = np.concatenate(points)
    if half:
        nodes["symmetry"] = np.flatnonzero(all_points[:, 2] == 0.0)
    end = np.zeros(dim)
    end[0] = -start
    nodes["pole"] = np.array([np.argmin(np.linalg.norm(all_points - end, axis=1))])
    return FingerMesh(all_points, np.concatenate(cells), nodes, {"surface": surface}, cell_sets)
