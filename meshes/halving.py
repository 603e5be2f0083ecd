"""Halve cells near the contact; some new nodes then hang on their neighbours' sides.

A structured block carries its finest edges through the whole body; cells cut in place do not. A new
node on an edge or a face of a cell that stays whole hangs: it lies at the mean of that side's
corners and moves with them, which keeps the motion continuous. Cells with a hanging corner are not
cut: across a side sizes differ at most by a factor of two, and no hanging node follows another.
"""

from itertools import product

import numpy as np

from meshes.mesh import Ints, PhalanxMesh
from meshes.topology import structured


def halve(mesh: PhalanxMesh, chosen: Ints) -> PhalanxMesh:
    """Cut the chosen cells (c,) into 2^dim each, except those with a hanging corner.

    New nodes lie at the means of the corners of their edge, face or cell. A hanging node that is
    there already is used, and is freed if no cell beside it stays whole.
    """
    dim = mesh.points.shape[1]
    cut = np.zeros(len(mesh.cells), dtype=bool)
    cut[chosen] = ~np.isin(mesh.cells[chosen], mesh.ties[:, 0]).any(axis=1)
    beside = ~cut & (np.isin(mesh.cells, mesh.cells[cut]).sum(axis=1) > 1)
    sides = np.repeat(_lattice(mesh.facets), 2, axis=1)
    tied = np.repeat(np.sort(mesh.ties[:, 1:], axis=1), 2, axis=1)
    lattices = [_lattice(mesh.cells[cut]), sides, _lattice(mesh.cells[beside]), tied]
    keys, places = np.unique(np.concatenate(lattices), axis=0, return_inverse=True)
    ends = np.cumsum([len(lattice) for lattice in lattices])
    of_cut, of_facets, of_whole, of_ties = np.split(places.ravel(), ends[:-1])

    def among(members: Ints) -> np.ndarray:
        found = np.zeros(len(keys), dtype=bool)
        found[members] = True
        return found

    known = among(of_cut)
    middles = known & (keys[:, 0] != keys[:, -1])
    new = middles & ~among(of_ties)
    number = keys[:, 0].copy()
    number[of_ties] = mesh.ties[:, 0]
    number[new] = len(mesh.points) + np.arange(np.count_nonzero(new))
    hangs = middles & among(of_whole)
    of_facets = of_facets.reshape(len(mesh.facets), -1)
    split = known[of_facets[:, of_facets.shape[1] // 2]]  # the middle belongs to one cell alone
    outside = middles & among(of_facets[split].ravel())
    roles = {}
    for role, nodes in mesh.roles.items():
        more = outside & np.isin(keys, nodes).all(axis=1)
        roles[role] = np.union1d(nodes, number[more])
    ties = np.column_stack([number[hangs], keys[hangs, ::2]])
    return PhalanxMesh(
        points=np.concatenate([mesh.points, mesh.points[keys[new]].mean(axis=1)]),
        cells=np.concatenate([mesh.cells[~cut], _children(number[of_cut], dim)]),
        roles=roles,
        facets=np.concatenate(
            [mesh.facets[~split], _children(number[of_facets[split]].ravel(), dim - 1)]
        ),
        ties=np.concatenate([mesh.ties[~known[of_ties]], ties]),
    )


def _lattice(cells: Ints) -> Ints:
    """Corners (3^d m, 2^d) whose means are a cell's corners, mid-edges, .. and middle; sorted.

    A corner is repeated as often as needed to fill the row.
    """
    d = cells.shape[1].bit_length() - 1
    corner = {place: n for n, place in enumerate(_corners(d))}
    rows = [
        [
            corner[tuple(b if p == 1 else p // 2 for p, b in zip(place, bits, strict=True))]
            for bits in product((0, 1), repeat=d)
        ]
        for place in product((0, 1, 2), repeat=d)
    ]
    return np.sort(cells[:, rows].reshape(-1, 2**d), axis=1)


def _corners(d: int) -> list[tuple[int, ...]]:
    """Places of a cell's corners in VTK's order."""
    places = list(product((0, 1), repeat=d))
    return [places[n] for n in structured(np.arange(2**d).reshape((2,) * d))[0]]


def _children(lattice: Ints, d: int) -> Ints:
    """The cells (2^d m, 2^d) that lattices of 3^d nodes make."""
    local = structured(np.arange(3**d).reshape((3,) * d))
    return lattice.reshape(-1, 3**d)[:, local].reshape(-1, 2**d)
