"""Where a mesh is fine, how it coarsens, and that snapping its nodes changes neither."""

from __future__ import annotations

import math

import numpy as np
import pytest

import meshes
from meshes.finger import snap
from meshes.phalanx import mesh_phalanx
from meshes.plan import plan_finger
from meshes.quality import edge_lengths
from tests.meshes.fingers import BUILD, FINE_TIP, PAPER, L, R


@pytest.mark.parametrize("angle", [45.0, 52.0])
@pytest.mark.parametrize("dim", [3, 2])
def test_refinement_is_at_the_contact_point(dim: int, angle: float) -> None:
    sizing = meshes.Sizing(1.5e-3, 2e-3, 1e-4, contact_angle=math.radians(angle))
    mesh = BUILD[dim](PAPER, sizing)
    contact = np.zeros(dim)
    contact[:2] = (
        R - 3 * L - R * math.cos(sizing.contact_angle),
        -R * math.sin(sizing.contact_angle),
    )
    distance = np.linalg.norm(mesh.points - contact, axis=1)
    node = int(distance.argmin())
    assert distance[node] < 1e-12
    here = edge_lengths(mesh.points, mesh.cells[(mesh.cells == node).any(axis=1)])
    # The second edge of a neighbouring side is not longer than growth times the first.
    assert here.min() > 0.9e-4
    assert here.max() < 1.25e-4
    shaft = mesh.cells[mesh.cell_sets["phalanx_1"]]
    assert edge_lengths(mesh.points, shaft).min() > 3e-4


def test_refinement_fades_over_the_equator_to_the_hinge() -> None:
    mesh = meshes.finger_hexahedra(PAPER, FINE_TIP)
    surface = np.unique(mesh.facet_sets["surface"])
    first = []
    for x in (R - 3 * L, -2 * L):  # the equator, the last hinge
        ring = mesh.points[surface[np.abs(mesh.points[surface, 0] - x) < 1e-12]]
        lowest = np.sort(np.arctan2(ring[:, 2], -ring[:, 1]))
        first.append(lowest[1] - lowest[0])
    even = math.pi / 4 / 13  # 13 edges an eighth turn
    # gmsh integrates along curves to 1e-9 of their length, here 13 edges.
    assert first[1] == pytest.approx(even, rel=2e-8)
    # Half the power of the tip: 13 edges growing by sqrt(1.2045) start at 0.539 of the even one.
    assert first[0] == pytest.approx(0.539 * even, rel=1e-3)


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
