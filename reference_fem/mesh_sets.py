"""The named sets of a mesh that the model is built on, checked: meshes may be made by hand."""

from collections.abc import Mapping

import numpy as np

import meshes
from reference_fem.arrays import Index
from reference_fem.elements.geometry import check_mesh

# Largest |Z| over the body's width at which a node lies in the plane of symmetry.
FLAT = 1e-6


def wanted(sets: Mapping[str, Index], name: str, of: str, count: int | None = None) -> Index:
    """Members of a set. of : what they are; count : how many of these the mesh has, if they are
    numbers.

    Raises ValueError: it is missing or empty, or names what does not exist.
    """
    members = np.asarray(sets.get(name, ()), dtype=np.int64)
    if not members.size:
        raise ValueError(f"mesh: {of} set '{name}' is missing or empty; a finger mesh needs it")
    if count is not None and (members.min() < 0 or members.max() >= count):
        raise ValueError(
            f"mesh: {of} set '{name}' names {of}s {members.min()} to {members.max()}; only 0 to"
            f" {count - 1} exist"
        )
    return members


def bodies(mesh: meshes.FingerMesh) -> tuple[Index, Index, list[Index]]:
    """Phalanx of each cell and of each node, from 0, and the nodes of each phalanx.

    Raises ValueError: a cell or a node belongs to no phalanx or to several.
    """
    check_mesh(mesh.points, mesh.cells, mesh.dim)
    phalanx = np.full(len(mesh.cells), -1, dtype=np.int64)
    body_of_point = np.full(len(mesh.points), -1, dtype=np.int64)
    body_nodes = []
    for w in range(mesh.phalanges):
        body = wanted(mesh.cell_sets, f"phalanx_{w + 1}", "cell", len(mesh.cells))
        nodes = np.unique(mesh.cells[body])
        if (phalanx[body] >= 0).any() or (body_of_point[nodes] >= 0).any():
            raise ValueError(
                f"cell set phalanx_{w + 1}: shares cells or nodes with another phalanx; each needs"
                " its own, hinges join them"
            )
        body_nodes.append(nodes)
        phalanx[body], body_of_point[nodes] = w, w
    if (phalanx < 0).any() or (body_of_point < 0).any():
        raise ValueError(
            "cell sets phalanx_w: some cells or nodes belong to no phalanx; every cell needs one "
            "and every node a cell"
        )
    return phalanx, body_of_point, body_nodes


def symmetry_plane(mesh: meshes.FingerMesh) -> Index:
    """Nodes of the plane of symmetry of a half body; none of a full one, or in 2D.

    Raises ValueError: they are not the nodes at Z = 0 of a body at Z >= 0.
    """
    nodes = np.asarray(mesh.node_sets.get("symmetry", ()), dtype=np.int64)
    if not nodes.size:
        return nodes
    z = mesh.points[:, -1]
    flat = FLAT * np.ptp(z)
    if mesh.dim == 2 or z.min() < -flat or np.setxor1d(nodes, np.flatnonzero(z <= flat)).size:
        raise ValueError(
            "mesh: node set 'symmetry' must hold all nodes at Z = 0, and no others, of the half"
            " body at Z >= 0; a full body, or one in 2D, has no such set"
        )
    return nodes
