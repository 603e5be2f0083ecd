"""The whole finger: phalanges meshed one by one, snapped, numbered and put in a row."""

from __future__ import annotations

from types import MappingProxyType

import numpy as np

from meshes.arrays import Floats, Ints
from meshes.facets import orient, outer_facets
from meshes.geometry import FingerGeometry
from meshes.mesh import FingerMesh
from meshes.numbering import renumber
from meshes.phalanx import PhalanxBlocks, mesh_phalanx
from meshes.plan import PhalanxPlan, plan_finger
from meshes.sizing import Sizing
from meshes.snap import snap

_METRES_PER_MM = 1e-3


def finger_hexahedra(geometry: FingerGeometry, sizing: Sizing) -> FingerMesh:
    """Half model (Z >= 0) of the finger in hexahedra.

    Phalanges share no nodes. The same parameters give the same mesh, bit for bit.

    Raises
    ------
    MeshError
        If a size exceeds the body, the mesh would be too large, or gmsh is missing or fails.
    """
    return _assemble(geometry, plan_finger(geometry, sizing, 3), 3)


def finger_quadrilaterals(geometry: FingerGeometry, sizing: Sizing) -> FingerMesh:
    """The finger's outline in the plane of motion in quadrilaterals: the 3D mesh's trace on Z = 0.

    Raises
    ------
    MeshError
        As `finger_hexahedra`.
    """
    return _assemble(geometry, plan_finger(geometry, sizing, 2), 2)


def _assemble(geometry: FingerGeometry, plans: tuple[PhalanxPlan, ...], dim: int) -> FingerMesh:
    built: dict[PhalanxPlan, PhalanxBlocks] = {}
    points: list[Floats] = []
    cells: list[Ints] = []
    node_sets: dict[str, Ints] = {}
    cell_sets: dict[str, Ints] = {}
    symmetry: list[Ints] = []
    n_points = n_cells = 0
    ends = (*geometry.hinges, geometry.end)
    for w, plan in enumerate(plans, start=1):
        if plan not in built:
            built[plan] = _prepare(mesh_phalanx(plan, dim), plan)
        phalanx = built[plan]
        roles = {role: nodes + n_points for role, nodes in phalanx.roles.items()}
        x = phalanx.points * _METRES_PER_MM
        x[:, 0] += ends[w - 1]
        # Neighbours meet at the same floating-point number, whatever the sum before it.
        x[phalanx.roles["proximal_face"], 0] = ends[w - 1]
        x[phalanx.roles["distal_face" if "distal_face" in roles else "pole"], 0] = ends[w]
        node_sets[f"hinge_{w}_proximal"] = roles["proximal_core"]
        node_sets[f"proximal_face_{w}"] = roles["proximal_face"]
        if "distal_face" in roles:
            node_sets[f"distal_face_{w}"] = roles["distal_face"]
            if w < geometry.phalanges:
                node_sets[f"hinge_{w}_distal"] = roles["distal_core"]
        if dim == 3:
            symmetry.append(roles["symmetry"])
        cell_sets[f"phalanx_{w}"] = np.arange(n_cells, n_cells + len(phalanx.cells))
        points.append(x)
        cells.append(phalanx.cells + n_points)
        n_points += len(x)
        n_cells += len(phalanx.cells)
    all_points = np.vstack(points)
    surface, tip = _touching(phalanx, plan, n_points - len(x))
    node_sets["tip"] = np.unique(tip)
    node_sets["pole"] = roles["pole"]
    if dim == 3:
        node_sets["symmetry"] = np.concatenate(symmetry)
    return FingerMesh(
        all_points,
        np.vstack(cells),
        MappingProxyType(node_sets),
        MappingProxyType({"surface": surface, "tip": tip}),
        MappingProxyType(cell_sets),
    )


def _prepare(phalanx: PhalanxBlocks, plan: PhalanxPlan) -> PhalanxBlocks:
    """Snap to the analytic surfaces, orient the elements and number for locality."""
    points = snap(phalanx, plan)
    order, cells = renumber(orient(points, phalanx.cells), len(points))
    new = np.empty_like(order)
    new[order] = np.arange(len(order))
    roles = {role: np.sort(new[nodes]) for role, nodes in phalanx.roles.items()}
    return PhalanxBlocks(points[order], cells, roles)


def _touching(phalanx: PhalanxBlocks, plan: PhalanxPlan, offset: int) -> tuple[Ints, Ints]:
    """Facets of the last phalanx that can touch, and those within a radius of its end."""
    facets = outer_facets(phalanx.cells)
    outside = np.zeros(len(phalanx.points), dtype=bool)
    kept = np.ones(len(facets), dtype=bool)
    for role in ("proximal_face", "proximal_hole", "symmetry"):
        if role in phalanx.roles:
            outside[:] = False
            outside[phalanx.roles[role]] = True
            kept &= ~outside[facets].all(axis=1)
    surface = facets[kept]
    length = plan.shaft + (plan.radius if plan.rounded else 0.0)
    limit = -length + plan.radius * (1.0 + 1e-9)
    tip = surface[(phalanx.points[surface, 0] <= limit).all(axis=1)]
    return surface + offset, tip + offset
