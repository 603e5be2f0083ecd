"""Mirror images: about the plane of motion, joined to the half model, and about that of hinges."""

from dataclasses import replace

import numpy as np

from meshes.errors import MeshError
from meshes.mesh import FingerMesh, Ints
from meshes.topology import orient, renumber


def mirrored(half: FingerMesh) -> FingerMesh:
    """Both halves as one mesh, without a node set ``symmetry``; the plane's nodes are shared.

    Node sets, facet sets and phalanges include the images of their members; the pole stays one
    node. Nodes and elements are numbered for locality again, phalanx by phalanx.

    Raises
    ------
    MeshError
        If the mesh is not a half model: it has no node set ``symmetry``.
    """
    plane = np.asarray(half.node_sets.get("symmetry", ()), dtype=np.int64)
    if half.dim != 3 or not plane.size:
        raise MeshError("mesh: only a half model, with a node set 'symmetry', has a mirror image")
    count, cells = len(half.points), len(half.cells)
    image = np.empty(count, dtype=np.int64)  # the number of each node's image
    off = np.ones(count, dtype=bool)
    off[plane] = False
    image[plane] = plane
    image[off] = count + np.arange(np.count_nonzero(off))
    points = np.vstack([half.points, half.points[off] * [1.0, 1.0, -1.0]])
    both = np.vstack([half.cells, orient(points, image[half.cells])])

    node_order: list[Ints] = []
    ordered: list[Ints] = []
    cell_order: list[Ints] = []
    first_node = 0
    for name in (f"phalanx_{w}" for w in range(1, half.phalanges + 1)):
        own = half.cell_sets[name]
        pairs = np.concatenate([own, own + cells])
        body = both[pairs]
        nodes, local = np.unique(body, return_inverse=True)
        order, local_cells, by_mean = renumber(local.reshape(body.shape), len(nodes))
        node_order.append(nodes[order])
        ordered.append(local_cells + first_node)
        cell_order.append(pairs[by_mean])
        first_node += len(nodes)
    old = np.concatenate(node_order)
    new = np.argsort(old)  # a permutation's inverse

    def with_image(nodes: Ints) -> Ints:
        return np.unique(new[np.concatenate([nodes, image[nodes]])])

    kept = {name: with_image(nodes) for name, nodes in half.node_sets.items() if name != "symmetry"}
    of_half = np.concatenate(cell_order) % cells
    cell_sets = {n: np.flatnonzero(np.isin(of_half, v)) for n, v in half.cell_sets.items()}
    facets = {
        # a mirror image is wound the other way round
        name: new[np.vstack([sides, image[sides][:, ::-1]])]
        for name, sides in half.facet_sets.items()
    }
    ties = np.unique(new[np.vstack([half.ties, image[half.ties]])], axis=0)
    sets = kept, facets, cell_sets
    return FingerMesh(points[old], np.vstack(ordered), *sets, half.shape, ties)


def turned_over(mesh: FingerMesh) -> FingerMesh:
    """The mesh's mirror image about y = 0: the same numbers and sets, wound outwards."""
    points = mesh.points.copy()
    points[:, 1] = 0.0 - points[:, 1]
    facets = {name: sides[:, ::-1] for name, sides in mesh.facet_sets.items()}
    return replace(mesh, points=points, cells=orient(points, mesh.cells), facet_sets=facets)
