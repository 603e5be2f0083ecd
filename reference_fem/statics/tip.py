"""Compliance of a meshed fingertip under forces near the point where it touches: linear statics.

Small strain, small rotation, the 8-point hexahedron of the explicit runs, one sparse factorization.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

import meshes
from reference_fem.arrays import Array, Flags, Index
from reference_fem.elements.base import lame_constants
from reference_fem.elements.geometry import Geometry, geometries
from reference_fem.settings import Material

# Candidates whose three loads are solved for at once.
COLUMNS = 16


@dataclass(frozen=True)
class TipCompliance:
    """Displacements per unit force at k candidate nodes, of the mesh as given.

    Motion is relative to a frame that moves with a section behind the contact (its best-fit rigid
    motion, read at the contact point): the beam's share of the compliance is left out.

    nodes : (k,), candidates: the nodes of the surface's facets near the contact point
    facets : (m, 4), those facets, by candidate
    points : (k, 3), the candidates' undeformed positions: along the plane of motion, along Z, and
        the distance from the plane that touches the undeformed tip, m
    radius : of the sphere, m
    normal : (k, k), displacement of node i into the body per unit force on node j into the body,
        m/N
    tangential : (k, k, 2, 2), [i, j, a, b]: displacement of i along a per force on j along b; 0:
        the plane's direction in the plane of motion, 1: Z.
    held : (k,), nodes on the symmetry plane, which do not move along Z
    symmetry_factor : 2 for a half model, else 1
    material : of the last phalanx
    """

    nodes: Index
    facets: Index
    points: Array
    radius: float
    normal: Array
    tangential: Array
    held: Flags
    symmetry_factor: int
    material: Material


def tip_compliance(
    mesh: meshes.FingerMesh, material: Material, angle: float, reach: float, behind: float = 0.0
) -> TipCompliance:
    """Compliance of the last phalanx, its first face held, at the nodes that may touch.

    mesh : 3D with a hemispherical end; only the last phalanx takes part.
    angle : between the axis (towards the tip) and the direction to the plane, towards -Y, rad.
    reach : facets with a node within this distance of the contact point may touch, m.
    behind : distance of the reference section behind the hemisphere's centre, m; the mesh's nearest
        section is taken.

    Raises ValueError: the mesh is planar, or no candidate lies within reach.
    """
    if mesh.dim != 3:
        raise ValueError(f"mesh: {mesh.dim}-dimensional; the indentation needs a 3D mesh")
    nodes, body = last_phalanx(mesh)
    points, surface, symmetry = body.points, body.facet_sets["surface"], body.node_sets["symmetry"]
    radius, centre, contact, directions = touch_frame(body, angle)
    outward, along = -directions[0], directions[1]
    near = np.linalg.norm(points[surface] - contact, axis=2).min(axis=1) < reach
    candidates, facets = np.unique(surface[near], return_inverse=True)
    if candidates.size < 9:
        raise ValueError(
            f"tip: {candidates.size} surface nodes within {reach:.3g} m of the contact point; "
            "reduce tip_size or press harder"
        )
    force = np.zeros((3 * len(points), candidates.size, 3))
    for j, node in enumerate(candidates):
        force[3 * node : 3 * node + 3, j] = directions.T
    displacement = displacements(body, material, force)
    section = section_at(points, centre[0] + behind)
    matrix = np.einsum("idjb,ad->ijab", displacement[candidates], directions)
    for j in range(candidates.size):
        for b in range(3):
            rigid = rigid_motion(body, section, displacement[..., j, b], contact)
            matrix[:, j, :, b] -= directions @ rigid
    offset = points[candidates] - contact
    return TipCompliance(
        nodes=nodes[candidates],
        facets=facets.reshape(-1, 4),
        points=np.stack([offset @ along, offset[:, 2], -offset @ outward], axis=1),
        radius=radius,
        normal=0.5 * (matrix[..., 0, 0] + matrix[..., 0, 0].T),
        tangential=matrix[..., 1:, 1:],
        held=np.isin(candidates, symmetry),
        symmetry_factor=2 if symmetry.size else 1,
        material=material,
    )


def touch_frame(body: meshes.FingerMesh, angle: float) -> tuple[float, Array, Array, Array]:
    """Radius and centre of the sphere, the contact point, and three directions (rows): into the
    body, along the plane in the plane of motion, and Z.
    """
    radius = float(np.abs(body.points[:, 1]).max())
    centre = np.array([body.points[:, 0].min() + radius, 0.0, 0.0])
    inward = np.array([np.cos(angle), np.sin(angle), 0.0])
    directions = np.array([inward, [inward[1], -inward[0], 0.0], [0.0, 0.0, 1.0]])
    return radius, centre, centre - radius * inward, directions


def last_phalanx(mesh: meshes.FingerMesh) -> tuple[Index, meshes.FingerMesh]:
    """Node numbers of the last phalanx in the given mesh, and the phalanx as a mesh of its own.

    Raises ValueError: it has hanging nodes.
    """
    if mesh.ties.size:
        raise ValueError(
            "mesh: has hanging nodes, which statics leaves out; mesh the finger with halvings = 0"
        )
    cells = mesh.cells[mesh.cell_sets[f"phalanx_{mesh.phalanges}"]]
    nodes, local = np.unique(cells, return_inverse=True)
    place = np.full(len(mesh.points), -1)
    place[nodes] = np.arange(nodes.size)
    symmetry = place[mesh.node_sets.get("symmetry", np.empty(0, np.int64))]
    face = place[mesh.node_sets[f"proximal_face_{mesh.phalanges}"]]
    return nodes, meshes.FingerMesh(
        mesh.points[nodes],
        local.reshape(cells.shape),
        {"proximal_face_1": face, "symmetry": symmetry[symmetry >= 0]},
        {"surface": place[mesh.facet_sets["surface"]]},
        {"phalanx_1": np.arange(len(cells))},
    )


def displacements(body: meshes.FingerMesh, material: Material, force: Array) -> Array:
    """Displacements (n_points, 3, k, m) under nodal forces (3 n_points, k, m), first face held."""
    from scipy.sparse.linalg import splu

    stiffness = _stiffness(body.points, body.cells, material)
    size = stiffness.shape[0]
    clamped = (3 * body.node_sets["proximal_face_1"][:, None] + np.arange(3)).ravel()
    free = np.setdiff1d(
        np.arange(size), np.concatenate([clamped, 3 * body.node_sets["symmetry"] + 2])
    )
    solver = splu(
        stiffness[free][:, free].tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        relax=20,
        panel_size=20,
        options={"SymmetricMode": True},
    )
    result = np.zeros_like(force)
    for start in range(0, force.shape[1], COLUMNS):
        some = slice(start, start + COLUMNS)
        load = force[free][:, some]
        result[free, some] = solver.solve(load.reshape(free.size, -1)).reshape(load.shape)
    return result.reshape(-1, 3, *force.shape[1:])


def _stiffness(points: Array, cells: Index, material: Material) -> Any:
    """Stiffness of the elements `hex8`, numbered node by node."""
    from scipy.sparse import coo_matrix

    mu, lame = lame_constants(*np.array([[material.youngs_modulus], [material.poisson_ratio]]))
    element = np.concatenate([element_stiffness(g, mu, lame) for g in geometries(points, cells)])
    dofs = (3 * cells[:, :, None] + np.arange(3)).reshape(len(cells), 24)
    rows, columns = np.repeat(dofs, 24, axis=1).ravel(), np.tile(dofs, (1, 24)).ravel()
    size = 3 * len(points)
    return coo_matrix((element.ravel(), (rows, columns)), shape=(size, size)).tocsr()


def element_stiffness(g: Geometry, mu: Array, lame: Array) -> Array:
    """Stiffness of `hex8` at the reference configuration, (n, 24, 24), N/m.

    K_ai,bj = Σ_q w [μ (δ_ij ∇N_a·∇N_b + N_a,j N_b,i)] + λ V mean(N_a,i) mean(N_b,j); μ, λ (1,), Pa
    """
    n, q, a, dim = g.gradients.shape
    flat = g.gradients.reshape(n, q, a * dim)
    products = np.matmul((g.weights[:, :, None] * flat).transpose(0, 2, 1), flat)
    t = products.reshape(n, a, dim, a, dim)
    shear = t.transpose(0, 1, 4, 3, 2) + np.einsum("nakbk,ij->naibj", t, np.eye(dim))
    total = np.einsum("nq,nqk->nk", g.weights, flat)
    mean = total[:, :, None] * total[:, None, :] / g.volume[:, None, None]
    return mu[:, None, None] * shear.reshape(mean.shape) + lame[:, None, None] * mean


def section_at(points: Array, x: float) -> Index:
    """Nodes of the mesh's plane section nearest to x."""
    size = np.ptp(points[:, 0])
    planes = np.round(points[:, 0] / (1e-6 * size)).astype(np.int64)
    values, counts = np.unique(planes, return_counts=True)
    # A section of the shaft holds as many nodes as the end face; elsewhere planes are coincidences.
    whole = values[counts >= counts[np.argmax(values)]]
    nearest = whole[np.argmin(np.abs(whole * (1e-6 * size) - x))]
    return np.flatnonzero(planes == nearest)


def rigid_motion(body: meshes.FingerMesh, section: Index, displacement: Array, at: Array) -> Array:
    """Best-fit rigid motion (u, v, 0) of a section's nodes at a point `at`, small rotation.

    By least squares in which nodes on the symmetry plane count half.
    """
    weights = np.where(np.isin(section, body.node_sets["symmetry"]), 1.0, 2.0)
    arms, moved = body.points[section, :2], displacement[section, :2]
    middle = weights @ arms / weights.sum()
    shift = weights @ moved / weights.sum()
    r = arms - middle
    turn = weights @ (r[:, 0] * moved[:, 1] - r[:, 1] * moved[:, 0])
    turn /= weights @ (r**2).sum(axis=1)
    lever = at[:2] - middle
    return np.array([shift[0] - turn * lever[1], shift[1] + turn * lever[0], 0.0])
