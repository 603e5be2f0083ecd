"""Checks that a mesh must pass before a solver may use it."""

import numpy as np

from meshes.errors import MeshError
from meshes.mesh import PHALANX, FingerMesh
from meshes.quality import scaled_jacobians
from meshes.topology import facets

_DEGENERATE = 1e-6
"""Scaled Jacobian at or below which an element counts as collapsed."""


def check(mesh: FingerMesh) -> None:
    """Refuse a mesh that a solver could not use.

    Raises MeshError: naming the first thing that is wrong.
    """
    _check_numbers(mesh)
    _check_sets(mesh)
    scaled = scaled_jacobians(mesh.points, mesh.cells)
    bad = np.flatnonzero(scaled <= _DEGENERATE)
    if bad.size:
        inverted = int(np.count_nonzero(scaled < -_DEGENERATE))
        raise MeshError(
            f"{bad.size} of {len(scaled)} elements cannot be used ({inverted} inverted, "
            f"{bad.size - inverted} degenerate); the first is element {bad[0]} with scaled "
            f"Jacobian {scaled[bad[0]]:.3g}; number nodes as VTK does, or mesh that place anew"
        )
    shared = int(np.count_nonzero(facets(mesh.cells)[1] > 2))
    if shared:
        raise MeshError(
            f"{shared} sides belong to three elements or more; remove duplicate elements"
        )


def _check_numbers(mesh: FingerMesh) -> None:
    if len(mesh.points) == 0 or len(mesh.cells) == 0:
        raise MeshError("holds no points or no elements")
    wrong = np.flatnonzero(~np.isfinite(mesh.points).all(axis=1))
    if wrong.size:
        raise MeshError(f"{wrong.size} points are not finite; the first is point {wrong[0]}")
    if mesh.cells.min() < 0 or mesh.cells.max() >= len(mesh.points):
        raise MeshError(
            f"elements name points {mesh.cells.min()} to {mesh.cells.max()}, but there are "
            f"{len(mesh.points)}"
        )
    alone = np.setdiff1d(np.arange(len(mesh.points)), mesh.cells)
    if alone.size:
        raise MeshError(
            f"{alone.size} points belong to no element; the first is point {alone[0]}; remove them"
        )


def required_node_sets(dim: int, phalanges: int) -> list[str]:
    """Names of the node sets that every finger mesh has."""
    names = ["tip", "pole"] + (["symmetry"] if dim == 3 else [])
    for w in range(1, phalanges + 1):
        names += [f"hinge_{w}_proximal", f"proximal_face_{w}"]
        if w < phalanges:
            names += [f"hinge_{w}_distal", f"distal_face_{w}"]
    return names


def _check_sets(mesh: FingerMesh) -> None:
    numbers = sorted(int(found[1]) for name in mesh.cell_sets if (found := PHALANX.fullmatch(name)))
    if not numbers or numbers != list(range(1, len(numbers) + 1)):
        raise MeshError(
            f"cell sets phalanx_1, phalanx_2, ... are missing: found {numbers or 'none'}; "
            "name the sets as meshes.write does"
        )
    node_names = required_node_sets(mesh.dim, len(numbers))
    missing = [f"node set {n}" for n in node_names if len(mesh.node_sets.get(n, ())) == 0]
    missing += [
        f"facet set {n}" for n in ("surface", "tip") if len(mesh.facet_sets.get(n, ())) == 0
    ]
    if mesh.dim == 3 and missing == ["node set symmetry"] and mesh.points[:, 2].min() < 0.0:
        raise MeshError(
            "node set symmetry is empty, and nodes have Z < 0: a 3D mesh must be the half Z >= 0"
        )
    if missing:
        raise MeshError(
            f"missing or empty: {', '.join(missing)}; name the sets as meshes.write does"
        )
    count = np.zeros(len(mesh.cells), dtype=np.int64)
    for w in numbers:
        count[mesh.cell_sets[f"phalanx_{w}"]] += 1
    if (count != 1).any():
        first = int(np.flatnonzero(count != 1)[0])
        raise MeshError(f"element {first} belongs to {count[first]} phalanges instead of one")
