"""Where a mesh is fine, how it coarsens, and that snapping its nodes changes neither."""

import math

import numpy as np
import pytest

import meshes
from meshes.finger import snap
from meshes.phalanx import mesh_phalanx
from meshes.plan import plan_finger
from meshes.quality import scaled_jacobians
from tests.meshes.fingers import BUILD, FINE_TIP, PAPER, L, R
from tests.meshes.lengths import edge_lengths


@pytest.mark.parametrize(
    "angle", [-70.0, -30.0, 0.0, 5.0, 20.0, 39.0, 45.0, 52.0, 60.0, 75.0, 83.0, 90.0]
)
@pytest.mark.parametrize("dim", [3, 2])
def test_the_patch_is_even_wherever_the_finger_touches(dim: int, angle: float) -> None:
    patch, fine = 0.9e-3, 2e-4
    sizing = meshes.Sizing(1.5e-3, 2e-3, fine, contact_angle=math.radians(angle), patch_size=patch)
    mesh = BUILD[dim](PAPER, sizing)
    contact = np.zeros(dim)
    contact[:2] = (
        R - 3 * L - R * math.cos(sizing.contact_angle),
        -R * math.sin(sizing.contact_angle),
    )
    facets = mesh.points[mesh.facet_sets["surface"]]
    inside = facets[(np.linalg.norm(facets - contact, axis=2) < patch).all(axis=1)]
    edges = np.linalg.norm(inside - np.roll(inside, 1, axis=1), axis=2)
    # Half a disc of radius 0.9 mm has the area of 32 squares of 0.2 mm, its diameter is 9 edges.
    assert len(inside) >= (16 if dim == 3 else 7)
    # Inside a block arcs are up to a fifth longer than on its edges, which share their divisions.
    assert edges.max() < 1.22 * fine
    shaft = mesh.cells[mesh.cell_sets["phalanx_1"]]
    assert edge_lengths(mesh.points, shaft).min() > 3e-4
    assert scaled_jacobians(mesh.points, mesh.cells).min() > 0.6


def test_refinement_fades_over_the_equator_to_the_hinge() -> None:
    mesh = meshes.finger_hexahedra(PAPER, FINE_TIP)
    surface = np.unique(mesh.facet_sets["surface"])
    first = []
    for x in (R - 3 * L, -2 * L):  # the equator, the last hinge
        ring = mesh.points[surface[np.abs(mesh.points[surface, 0] - x) < 1e-12]]
        lowest = np.sort(np.arctan2(ring[:, 2], -ring[:, 1]))
        first.append((lowest[1] - lowest[0]) / (math.pi / 4))
    # 11.7 edges growing by 1.25 from 0.1 mm fill the cube's edge: 12 are taken.
    arc = R * math.atan(math.sin(FINE_TIP.contact_angle))
    edges = math.log1p(0.25 * arc / 1e-4) / math.log(1.25)
    fine = 1e-4 / 0.25 * math.expm1(edges / 12 * math.log(1.25)) / arc
    # gmsh integrates along curves to 1e-9 of their length, here 12 edges.
    assert first[1] == pytest.approx(1 / 12, rel=2e-8)
    assert first[0] == pytest.approx(0.5 * (fine + 1 / 12), rel=1e-6)


@pytest.mark.parametrize("dim", [3, 2])
def test_snapping_moves_nodes_by_rounding_only(dim: int) -> None:
    plan = plan_finger(PAPER, FINE_TIP, dim)[-1]
    raw = mesh_phalanx(plan, dim)
    assert np.abs(snap(raw, plan) - raw.points).max() < 1e-12 * plan.shaft


def test_edges_grow_by_no_more_than_asked_along_the_lower_outline() -> None:
    sizing = meshes.Sizing(1.5e-3, 2e-3, 1e-4, growth=1.2)
    mesh = meshes.finger_quadrilaterals(PAPER, sizing)
    outline = np.unique(mesh.facet_sets["surface"])
    lower = outline[mesh.points[outline, 1] <= 0.0]
    tip = lower[mesh.points[lower, 0] <= R - 3 * L + 1e-12]
    x = mesh.points[tip]
    angle = np.sort(np.arctan2(-x[:, 1], (R - 3 * L) - x[:, 0]))
    edges = np.diff(angle)
    ratio = edges[1:] / edges[:-1]
    # Chords on a curve whose nodes are spaced by arc length: the ratio is exact but for rounding.
    assert np.maximum(ratio, 1 / ratio).max() < 1.2 + 1e-6
