"""The full body made of a half model: its volume, its sets, its shared plane, its orientation."""

import math
from dataclasses import replace

import numpy as np
import pytest

import meshes
from meshes.quality import scaled_jacobians, volumes
from meshes.topology import outer_facets
from tests.meshes.fingers import BUILD

GEOMETRY = meshes.FingerGeometry((0.04, 0.04), (0.015, 0.015))
HALF = meshes.finger_hexahedra(GEOMETRY, meshes.Sizing(2.5e-3, 4e-3, 1.5e-3))
FULL = meshes.mirrored(HALF)


def volume(mesh: meshes.FingerMesh) -> float:
    """By the divergence theorem over the outer facets: outward, or the sum is wrong.

    Each facet as the mean of both its splits into triangles, so that a warped one and its mirror
    image count the same.
    """
    corner = mesh.points[outer_facets(mesh.cells)]
    splits = ([0, 1, 2], [0, 2, 3], [1, 2, 3], [1, 3, 0])
    return float(sum(np.linalg.det(corner[:, split]).sum() for split in splits) / 12.0)


def outwards(corner: np.ndarray) -> np.ndarray:
    """Normals of facets (k, 4, 3) or (k, 2, 2) times the way from the axis or the ball's centre."""
    dim = corner.shape[2]
    if dim == 3:
        normal = np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])
    else:
        normal = (corner[:, 1] - corner[:, 0])[:, ::-1] * [1.0, -1.0]
    way = corner.mean(axis=1) - np.array([-sum(GEOMETRY.lengths) + 7.5e-3, 0.0, 0.0])[:dim]
    way[:, 0] = np.minimum(way[:, 0], 0.0)
    return np.einsum("ij,ij->i", normal, way)


def test_full_body_is_twice_the_half_with_the_plane_shared() -> None:
    assert len(FULL.cells) == 2 * len(HALF.cells)
    assert len(FULL.points) == 2 * len(HALF.points) - len(HALF.node_sets["symmetry"])
    assert volume(FULL) == pytest.approx(2 * volume(HALF), rel=1e-12)
    full, half = (scaled_jacobians(mesh.points, mesh.cells).min() for mesh in (FULL, HALF))
    assert full == pytest.approx(half, rel=1e-9)
    assert full > 0.0


def test_points_and_sets_are_their_own_mirror_images() -> None:
    flip = [1.0, 1.0, -1.0]

    def places(points: np.ndarray) -> set[tuple[float, ...]]:
        return {tuple(row) for row in (points + 0.0).tolist()}

    assert places(FULL.points) == places(FULL.points * flip)
    assert len(places(FULL.points)) < len(FULL.points)  # phalanges meet without sharing nodes
    assert "symmetry" not in FULL.node_sets
    assert set(FULL.node_sets) | {"symmetry"} == set(HALF.node_sets)
    for name, nodes in FULL.node_sets.items():
        half = HALF.points[HALF.node_sets[name]]
        assert places(FULL.points[nodes]) == places(half) | places(half * flip), name
    assert len(FULL.node_sets["pole"]) == 1


@pytest.mark.parametrize("name", ["surface", "tip"])
def test_facets_point_outwards_and_close_on_the_plane(name: str) -> None:
    sides = FULL.facet_sets[name]
    assert len(sides) == 2 * len(HALF.facet_sets[name])
    outer = {tuple(side) for side in np.sort(outer_facets(FULL.cells), axis=1).tolist()}
    assert {tuple(side) for side in np.sort(sides, axis=1).tolist()} <= outer
    assert (outwards(FULL.points[sides]) > 0).all()


def test_each_phalanx_owns_its_cells_and_nodes() -> None:
    bodies = [np.unique(FULL.cells[cells]) for cells in FULL.cell_sets.values()]
    assert not np.intersect1d(*bodies).size
    assert sum(map(len, bodies)) == len(FULL.points)
    spans = [np.ptp(FULL.points[body, 0]) for body in bodies]
    assert spans == pytest.approx([0.04, 0.04])
    radius = [math.hypot(*row[1:]) for row in FULL.points.tolist()]
    assert max(radius) == pytest.approx(7.5e-3)


def test_sets_of_ones_own_are_mirrored() -> None:
    end = 0.9 * HALF.points[:, 0].min()
    near = np.flatnonzero(HALF.points[HALF.cells].mean(axis=1)[:, 0] < end)
    mesh = meshes.mirrored(replace(HALF, cell_sets={**HALF.cell_sets, "relaxing": near}))
    wanted = np.flatnonzero(mesh.points[mesh.cells].mean(axis=1)[:, 0] < end)
    assert 0 < near.size < len(HALF.cells)
    assert np.array_equal(mesh.cell_sets["relaxing"], wanted)


def test_a_full_body_or_a_plane_has_no_mirror_image() -> None:
    plane = meshes.finger_quadrilaterals(GEOMETRY, meshes.Sizing(2.5e-3, 4e-3, 1.5e-3))
    for mesh in (FULL, plane):
        with pytest.raises(meshes.MeshError, match="only a half model"):
            meshes.mirrored(mesh)


@pytest.mark.parametrize("dim", [3, 2])
def test_a_finger_that_swung_over_has_the_mirrored_mesh(dim: int) -> None:
    """Bit for bit, with halved cells and full volume, wound outwards, fine on the upper side."""
    sizes = {"growth": 1.4, "patch_size": 1e-3, "halvings": 2, "full_volume": True}
    lower, upper = (
        BUILD[dim](GEOMETRY, meshes.Sizing(3e-3, 3e-3, 3e-4, contact_angle=a, **sizes))
        for a in (0.7, -0.7)
    )
    assert np.array_equal(upper.points, lower.points * [1.0, -1.0, 1.0][:dim])
    assert np.array_equal(upper.ties, lower.ties)
    assert np.array_equal(np.sort(upper.cells), np.sort(lower.cells))
    assert volumes(upper.points, upper.cells) == pytest.approx(volumes(lower.points, lower.cells))
    for kind in ("node_sets", "cell_sets"):
        own, other = getattr(upper, kind), getattr(lower, kind)
        assert all(np.array_equal(own[name], other[name]) for name in other)
    sides = upper.facet_sets["surface"]
    assert np.array_equal(np.sort(sides), np.sort(lower.facet_sets["surface"]))
    assert (outwards(upper.points[sides]) > 0).all()
    whole = meshes.Sizing(2.5e-3, 4e-3, 5e-4, contact_angle=-0.7)
    meshes.check_finger(BUILD[dim](GEOMETRY, whole), GEOMETRY)
