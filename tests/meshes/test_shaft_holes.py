"""Holes for the hinges' shafts: where their nodes lie, what they remove, and that they mesh."""

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial import cKDTree

import meshes
from meshes.quality import scaled_jacobians, volumes
from meshes.topology import outer_facets

SHAFT, RADIUS = 2.5e-3, 7.5e-3
PLAIN = meshes.FingerGeometry((0.04, 0.03, 0.04), (0.015,) * 3)
HOLED = dataclasses.replace(PLAIN, shaft_radius=SHAFT)
SIZING = meshes.SIZINGS["fast"]
BUILD = {3: meshes.finger_hexahedra, 2: meshes.finger_quadrilaterals}
ENDS = 5  # of three phalanges: all but the tip


@pytest.fixture(scope="module", params=[3, 2])
def mesh(request: pytest.FixtureRequest) -> meshes.FingerMesh:
    return BUILD[request.param](HOLED, SIZING)


def to_hinge(points: np.ndarray, hinge: float) -> np.ndarray:
    return np.hypot(points[:, 0] - hinge, points[:, 1])


def test_joint_is_formed_by_nodes_on_the_holes(mesh: meshes.FingerMesh) -> None:
    for w, x in enumerate(HOLED.hinges, start=1):
        names = [f"hinge_{w}_proximal"] + ([f"hinge_{w - 1}_distal"] if w > 1 else [])
        for name in names:
            points = mesh.points[mesh.node_sets[name]]
            assert to_hinge(points, x) == pytest.approx(SHAFT, rel=1e-12)
            assert points[:, :2].mean(axis=0) == pytest.approx((x, 0.0), abs=1e-15)
            assert np.array_equal(np.unique(points[:, 1]), [-SHAFT, SHAFT])
            if mesh.dim == 3:  # from the plane of motion through to the phalanx's surface
                assert points[:, 2].min() == 0.0
                assert points[:, 2].max() == pytest.approx(np.sqrt(RADIUS**2 - SHAFT**2))


def test_nothing_is_inside_the_holes_or_outside_the_phalanges(mesh: meshes.FingerMesh) -> None:
    nodes = mesh.points
    for w, x in enumerate(HOLED.hinges, start=1):
        distance = to_hinge(nodes, x)
        assert distance.min() >= SHAFT * (1 - 1e-12)
        sides = 2 if w > 1 else 1
        # A quarter of each wall is two blocks, and each block some three edges long.
        assert np.count_nonzero(distance < SHAFT * (1 + 1e-9)) >= sides * 9
    shaft = nodes[nodes[:, 0] > HOLED.end + RADIUS]
    assert np.linalg.norm(shaft[:, 1:], axis=1).max() <= RADIUS * (1 + 1e-12)


def test_elements_are_counted_and_good(mesh: meshes.FingerMesh) -> None:
    assert len(mesh.cells) == meshes.count_elements(HOLED, SIZING, mesh.dim)
    # Where two blocks meet the shaft's O-grid at 45 degrees: sin 45 in the plane of motion; across
    # it the round surface makes it worse.
    assert scaled_jacobians(mesh.points, mesh.cells).min() > (0.45 if mesh.dim == 3 else 0.7)


def removed_by_one_end() -> float:
    """Volume of half the hole: a cylinder of radius r across one of radius R, of the full body."""

    def width_times_thickness(y: float) -> float:
        return float(np.sqrt(SHAFT**2 - y**2) * 2 * np.sqrt(RADIUS**2 - y**2))

    return float(quad(width_times_thickness, -SHAFT, SHAFT)[0])


@pytest.mark.parametrize(("size", "edges"), [(1.5e-3, 8), (0.75e-3, 15)])
def test_the_removed_volume(size: float, edges: int) -> None:
    sizing = meshes.Sizing(size, 2 * size, size)
    plain, holed = (meshes.finger_hexahedra(g, sizing) for g in (PLAIN, HOLED))
    removed = 2 * (
        volumes(plain.points, plain.cells).sum() - volumes(holed.points, holed.cells).sum()
    )
    # Chords of `edges` edges per quarter of the hole leave out 1 - sin(a)/a of its area; those of
    # the phalanx's surface have less to leave out.
    angle = np.pi / 2 / edges
    assert removed == pytest.approx(ENDS * removed_by_one_end(), rel=1 - np.sin(angle) / angle)


def test_plane_mesh_is_the_trace_of_the_solid_one() -> None:
    solid, plane = (BUILD[dim](HOLED, SIZING) for dim in (3, 2))
    trace = solid.points[solid.node_sets["symmetry"], :2]
    assert len(trace) == len(plane.points)
    distance, _ = cKDTree(trace).query(plane.points)
    # Interior nodes are placed by gmsh from the blocks' sides, in the same way in both.
    assert distance.max() < 1e-9


def test_walls_of_holes_do_not_touch_the_ground(mesh: meshes.FingerMesh) -> None:
    surface = mesh.points[mesh.facet_sets["surface"]]
    for x in HOLED.hinges:
        on_wall = np.abs(to_hinge(surface.reshape(-1, mesh.dim), x) - SHAFT) < 1e-9
        assert not on_wall.reshape(surface.shape[:2]).all(axis=1).any()
    # Faces of phalanges 1 and 2 aside, the rest of the boundary is walls, ends and symmetry.
    assert len(surface) < len(outer_facets(mesh.cells))


def test_files_hold_holed_meshes(mesh: meshes.FingerMesh, tmp_path: Path) -> None:
    path = tmp_path / "holed.vtu"
    meshes.write(mesh, path)
    assert np.array_equal(meshes.read(path).points, mesh.points)


def test_refined_tip_and_one_phalanx() -> None:
    refined = meshes.finger_hexahedra(HOLED, meshes.Sizing(1.5e-3, 2.5e-3, 5e-4))
    assert scaled_jacobians(refined.points, refined.cells).min() > 0.3
    single = meshes.FingerGeometry((0.04,), (0.015,), tip="flat", shaft_radius=SHAFT)
    mesh = meshes.finger_hexahedra(single, SIZING)
    assert len(mesh.cells) == meshes.count_elements(single, SIZING)
    assert "hinge_1_distal" not in mesh.node_sets
    assert mesh.points[mesh.node_sets["pole"]] == pytest.approx(np.array([[-0.04, 0, 0]]))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"shaft_radius": 0.0}, "shaft_radius = 0.0: must be a finite"),
        ({"shaft_radius": 4e-3}, r"shaft_radius = 0.004 m: must be at most 0.45 of .*0.0075 m"),
        ({"lengths": (0.04, 0.01, 0.04)}, r"phalanx 2 is 0.01 m long, .* take 0.0105 m"),
        ({"lengths": (0.04, 0.04, 0.0127)}, r"phalanx 3 .* and its hemisphere take 0.01275 m"),
    ],
)
def test_impossible_holes(change: dict[str, object], message: str) -> None:
    with pytest.raises(meshes.MeshError) as caught:
        meshes.finger_hexahedra(dataclasses.replace(HOLED, **change), SIZING)
    assert re.search(message, str(caught.value))
