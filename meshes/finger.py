"""Mesh the whole finger: phalanges are meshed one by one, snapped, numbered and put in a row."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from meshes.errors import MeshError
from meshes.full_volume import from_contact, with_full_volume
from meshes.geometry import FingerGeometry
from meshes.halving import halve
from meshes.mesh import FingerMesh, Floats, Ints, PhalanxMesh
from meshes.mirror import turned_over
from meshes.phalanx import mesh_phalanx
from meshes.plan import PhalanxPlan, plan_finger
from meshes.quality import volumes
from meshes.sizing import Sizing, require_bearable
from meshes.topology import orient, outer_facets, renumber

_METRES_PER_MM = 1e-3

LONG = 1.2
"""Ratio of a cell's size to the requested one above which it is halved; halves then have 0.6."""
_TOLERANCE = 1e-6
"""Largest |y| over the radius at which a node counts as lying on y = 0."""


def finger_hexahedra(geometry: FingerGeometry, sizing: Sizing) -> FingerMesh:
    """Half model (Z >= 0) of the finger in hexahedra.

    Phalanges share no nodes. The same parameters give the same mesh, bit for bit.

    Raises
    ------
    MeshError
        If a size exceeds the body, the mesh would be too large, or gmsh is missing or fails.
    """
    return _assemble(geometry, sizing, 3)


def finger_quadrilaterals(geometry: FingerGeometry, sizing: Sizing) -> FingerMesh:
    """The finger's outline in the plane of motion in quadrilaterals: the 3D mesh's trace on Z = 0.

    Raises MeshError: as `finger_hexahedra`.
    """
    return _assemble(geometry, sizing, 2)


def _assemble(geometry: FingerGeometry, sizing: Sizing, dim: int) -> FingerMesh:
    """Put the phalanges in a row, number them consecutively, and gather their sets."""
    plans = plan_finger(geometry, sizing, dim)
    check = partial(require_bearable, geometry, sizing)
    built = {plan: _prepare(mesh_phalanx(plan, dim), plan, check) for plan in dict.fromkeys(plans)}
    check(sum(len(built[plan].cells) for plan in plans))
    points: list[Floats] = []
    cells: list[Ints] = []
    node_sets: dict[str, Ints] = {}
    facet_sets: dict[str, Ints] = {}
    cell_sets: dict[str, Ints] = {}
    symmetry: list[Ints] = []
    ties: list[Ints] = []
    n_points = n_cells = 0
    ends = (*geometry.hinges, geometry.end)
    for w, plan in enumerate(plans, start=1):
        phalanx = built[plan]
        roles = {role: nodes + n_points for role, nodes in phalanx.roles.items()}
        x = phalanx.points * _METRES_PER_MM
        x[:, 0] += ends[w - 1]
        # Neighbours meet at the same floating-point number, whatever the sum before it.
        x[phalanx.roles["proximal_face"], 0] = ends[w - 1]
        x[phalanx.roles["distal_face" if "distal_face" in roles else "pole"], 0] = ends[w]
        node_sets[f"hinge_{w}_proximal"] = roles.get("proximal_edges", roles["proximal_face"])
        node_sets[f"proximal_face_{w}"] = roles["proximal_face"]
        if "distal_face" in roles:
            node_sets[f"distal_face_{w}"] = roles["distal_face"]
        if w < geometry.phalanges:
            node_sets[f"hinge_{w}_distal"] = roles.get("distal_edges", roles["distal_face"])
        else:
            surface, tip = _touching_facets(phalanx, plan)
            facet_sets = {"surface": surface + n_points, "tip": tip + n_points}
            node_sets["tip"] = np.unique(facet_sets["tip"])
            node_sets["pole"] = roles["pole"]
        symmetry.append(roles.get("symmetry", np.empty(0, dtype=np.int64)))
        cell_sets[f"phalanx_{w}"] = np.arange(n_cells, n_cells + len(phalanx.cells))
        ties.append(phalanx.ties + n_points)
        points.append(x)
        cells.append(phalanx.cells + n_points)
        n_points += len(x)
        n_cells += len(phalanx.cells)
    if dim == 3:
        node_sets["symmetry"] = np.concatenate(symmetry)
    nodes, elements = np.vstack(points), np.vstack(cells)
    sets = node_sets, facet_sets, cell_sets
    mesh = FingerMesh(nodes, elements, *sets, geometry, np.vstack(ties))
    return mesh if sizing.contact_angle >= 0.0 else turned_over(mesh)


def _prepare(phalanx: PhalanxMesh, plan: PhalanxPlan, check: Callable[[int], None]) -> PhalanxMesh:
    """Snap to the analytic surfaces, orient the elements and number for locality.

    check : refuses a number of elements; halving may multiply them by 2^dim each time.
    """
    points = snap(phalanx, plan)
    cells = orient(points, phalanx.cells)
    cut = replace(phalanx, points=points, cells=cells, facets=outer_facets(cells))
    for _ in range(plan.halvings):
        cut = _cut_long(cut, plan)
        check(len(cut.cells))
    if plan.full_volume:
        cut = with_full_volume(cut, plan)
        for role in ("proximal_face", "distal_face"):
            if role in cut.roles:
                _make_symmetric(cut.points, cut.roles[role], 0.01 * plan.radius)
    order, cells, _ = renumber(cut.cells, len(cut.points))
    new = np.argsort(order)  # a permutation's inverse
    roles = {role: np.sort(new[nodes]) for role, nodes in cut.roles.items()}
    return PhalanxMesh(cut.points[order], cells, roles, new[cut.facets], new[cut.ties])


def _cut_long(mesh: PhalanxMesh, plan: PhalanxPlan) -> PhalanxMesh:
    """Halve cells that are larger than asked; the outside stays round, cells at hinges whole."""
    ends = [mesh.roles[role] for role in ("proximal_face", "distal_face") if role in mesh.roles]
    assert plan.fine is not None
    size = volumes(mesh.points, mesh.cells) ** (1.0 / mesh.points.shape[1])
    below, beside = from_contact(mesh.points, plan)
    # edges grow from the round surface on, which within the patch lies this far above the touch
    within = np.minimum(beside, min(plan.fine.even, plan.radius))
    depth = np.maximum(np.sqrt(plan.radius**2 - within**2) - plan.radius - below, 0.0)
    apart = np.hypot(depth, np.maximum(beside - plan.fine.even, 0.0))[mesh.cells].min(axis=1)
    asked = plan.fine.fine + (plan.fine.growth - 1.0) * apart
    long = (size > LONG * asked) & ~np.isin(mesh.cells, np.concatenate(ends)).any(axis=1)
    cut = halve(mesh, np.flatnonzero(long))
    hanging = cut.ties[:, 0]
    still = {role: np.setdiff1d(cut.roles[role], hanging) for role in ("shaft", "sphere")}
    cut = replace(cut, roles={**cut.roles, **still})
    points = snap(cut, plan)
    points[hanging] = points[cut.ties[:, 1:]].mean(axis=1)
    return replace(cut, points=points)


def _touching_facets(phalanx: PhalanxMesh, plan: PhalanxPlan) -> tuple[Ints, Ints]:
    """Facets of the last phalanx that can touch, and those within a radius of its end."""
    facets = phalanx.facets if phalanx.ties.size else outer_facets(phalanx.cells)
    touching = np.ones(len(facets), dtype=bool)
    for role in ("proximal_face", "proximal_hole", "symmetry"):
        if role in phalanx.roles:
            touching &= ~np.isin(facets, phalanx.roles[role]).all(axis=1)
    surface = facets[touching]
    length = plan.shaft + (plan.radius if plan.rounded else 0.0)
    limit = -length + plan.radius * (1.0 + 1e-9)
    return surface, surface[(phalanx.points[surface, 0] <= limit).all(axis=1)]


def snap(phalanx: PhalanxMesh, plan: PhalanxPlan) -> Floats:
    """Positions (n, dim) in mm with gmsh's rounding removed: nodes lie on their analytic surfaces.

    Nodes of holes go to the shafts' cylinders, lateral nodes to the phalanx's, tip nodes to the
    sphere, end faces to their planes, the symmetry plane to z = 0; the end faces are made mirror
    images about y = 0, so that a hinge's mean lies on its axis; the pole goes to the axis.
    """
    points = phalanx.points.copy()
    roles = phalanx.roles
    points[np.abs(points[:, 1]) < _TOLERANCE * plan.radius, 1] = 0.0
    if "symmetry" in roles:
        points[roles["symmetry"], 2] = 0.0
    for hole, x in (("proximal_hole", 0.0), ("distal_hole", -plan.shaft)):
        if hole in roles:
            points[roles[hole], :2] = _pushed(points[roles[hole], :2], x, plan.hole)
    points[roles["proximal_face"], 0] = 0.0
    _make_symmetric(points, roles["proximal_face"], _TOLERANCE * plan.radius)
    if plan.rounded:
        end = -plan.shaft - plan.radius
    else:
        points[roles["distal_face"], 0] = end = -plan.shaft
        _make_symmetric(points, roles["distal_face"], _TOLERANCE * plan.radius)
    holes = [roles[name] for name in ("proximal_hole", "distal_hole") if name in roles]
    in_hole = np.isin(roles["shaft"], np.concatenate([*holes, np.empty(0, np.int64)]))
    shaft, rim = roles["shaft"][~in_hole], roles["shaft"][in_hole]
    points[shaft, 1:] *= plan.radius / np.linalg.norm(points[shaft, 1:], axis=1, keepdims=True)
    if rim.size:  # on both cylinders: the hole fixes x and y
        points[rim, 2] = np.sqrt(plan.radius**2 - points[rim, 1] ** 2)
    if plan.rounded:
        points[roles["sphere"]] = _pushed(points[roles["sphere"]], -plan.shaft, plan.radius)
    if "pole" in roles:
        points[roles["pole"]] = 0.0
        points[roles["pole"], 0] = end
    return points


def _pushed(points: Floats, x: float, radius: float) -> Floats:
    """Points pushed along rays onto the circle or sphere of `radius` about `x` on the axis."""
    centre = np.eye(1, points.shape[1])[0] * x
    arm = points - centre
    return centre + arm * (radius / np.linalg.norm(arm, axis=1, keepdims=True))


def _make_symmetric(points: Floats, face: Ints, tolerance: float) -> None:
    """Make the nodes of an end face mirror images about y = 0, in place."""
    upper = face[points[face, 1] > 0.0]
    lower = face[points[face, 1] < 0.0]
    reflected = points[lower] * np.where(np.arange(points.shape[1]) == 1, -1.0, 1.0)
    distance, nearest = cKDTree(reflected).query(points[upper])
    if len(upper) != len(lower) or distance.max() > tolerance:
        raise MeshError("gmsh returned an end face that is not symmetric about the hinge axis")
    mean = 0.5 * (points[upper] + reflected[nearest])
    points[upper] = mean
    mean[:, 1] *= -1.0
    points[lower[nearest]] = mean
