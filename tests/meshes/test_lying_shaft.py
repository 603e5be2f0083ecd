"""A shaft that lies on the surface or points up: fine at both its ends, its hinge on the axis."""

import math

import numpy as np
import pytest

import meshes
from meshes.full_volume import from_contact
from meshes.plan import plan_finger
from meshes.quality import scaled_jacobians, volumes
from reference_fem.joints.hinges import mean_weights
from tests.meshes.fingers import BUILD, PAPER, L, R
from tests.meshes.lengths import edge_lengths

FINE, PATCH, GROWTH = 2e-4, 0.9e-3, 1.25


def lying(degrees: float, **more: float | bool) -> meshes.Sizing:
    return meshes.Sizing(
        1.5e-3, 2e-3, FINE, contact_angle=math.radians(degrees), patch_size=PATCH, **more
    )


@pytest.mark.parametrize("angle", [-100.0, 89.0, 91.0, 97.0, 130.0, 180.0])
@pytest.mark.parametrize("dim", [3, 2])
def test_both_ends_of_the_shaft_are_fine(dim: int, angle: float) -> None:
    sizing = lying(angle, halvings=2)
    mesh = BUILD[dim](PAPER, sizing)
    meshes.check_finger(mesh, PAPER)
    assert not mesh.ties.size
    assert meshes.count_elements(PAPER, sizing, dim) == len(mesh.cells)
    facets = mesh.points[mesh.facet_sets["surface"]]
    side = math.copysign(R, -angle)
    for x, least in ((-2 * L, 1), (R - 3 * L, 2)):  # the hinge's rim, and the ball's lowest point
        place = np.array([x, side, 0.0])[:dim]
        inside = facets[(np.linalg.norm(facets - place, axis=2) < PATCH).all(axis=1)]
        edges = np.linalg.norm(inside - np.roll(inside, 1, axis=1), axis=2)
        # half of half a disc has the area of 16 squares, its radius is 4.5 edges
        assert len(inside) >= least * (8 if dim == 3 else 3)
        assert edges.max() < 1.22 * FINE
    assert scaled_jacobians(mesh.points, mesh.cells).min() > 0.6
    others = mesh.cells[: mesh.cell_sets["phalanx_3"][0]]
    assert edge_lengths(mesh.points, others).min() > 3e-4


@pytest.mark.parametrize("full", [False, True])
def test_a_graded_hinge_keeps_its_mean_on_the_axis(full: bool) -> None:
    """By area, as a hinge takes it; nodes of the face are images of each other in pairs."""
    mesh = BUILD[3](PAPER, lying(97.0, full_volume=full))
    nodes, weights = mean_weights(mesh.points, mesh.cells, mesh.node_sets["hinge_3_proximal"], R)
    y, z = mesh.points[nodes, 1], mesh.points[nodes, 2]
    assert abs(weights @ y) < 1e-12 * R
    own, image = (sorted(zip(s * y.round(12) + 0.0, z.round(12), strict=True)) for s in (1, -1))
    assert own == image


def test_edges_grow_by_no_more_than_asked_from_either_end() -> None:
    mesh = meshes.finger_quadrilaterals(PAPER, lying(97.0))
    outline = mesh.points[np.unique(mesh.facet_sets["surface"])]
    edges = np.diff(np.sort(outline[np.isclose(outline[:, 1], -R), 0]))
    ratio = edges[1:] / edges[:-1]
    assert np.maximum(ratio, 1 / ratio).max() < GROWTH + 1e-6
    assert edges == pytest.approx(edges[::-1])
    assert edges.max() < 2e-3 * (1 + 1e-9)


@pytest.mark.parametrize("angle", [89.0, 97.0])
def test_a_lying_shaft_holds_its_whole_volume_but_where_it_touches(angle: float) -> None:
    """Depths are counted from the rim at the hinge, or from the ball's lowest point, in mm."""
    true = math.pi * R**2 * (L - R) / 2 + math.pi * R**3 / 3
    sizing = lying(angle, full_volume=True)
    mesh = BUILD[3](PAPER, sizing)
    cells = mesh.cells[mesh.cell_sets["phalanx_3"]]
    assert volumes(mesh.points, cells).sum() == pytest.approx(true, rel=2e-3)
    plan = plan_finger(PAPER, sizing, 3)[-1]
    down = -np.array([math.cos(math.radians(angle)), math.sin(math.radians(angle)), 0.0])
    ball = np.array([-plan.shaft, 0.0, 0.0]) + plan.radius * down
    lowest = np.array([0.0, -plan.radius, 0.0]) if angle > 90.0 else ball
    depth, beside = from_contact(
        np.array([lowest, lowest + down, lowest + np.array([0, 0, 2.0])]), plan
    )
    assert depth == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)
    assert beside == pytest.approx([0.0, 0.0, 2.0], abs=1e-12)


def test_what_lies_is_within_two_degrees_of_the_surface_or_points_up() -> None:
    assert [lying(a).lies for a in (-91.0, -52.0, 87.9, 88.1, 180.0)] == [1, 0, 0, 1, 1]
