"""Cells halved where it touches: what hangs, what stays whole, and the body's volume."""

import math
from dataclasses import replace

import numpy as np
import pytest

import meshes
from meshes.halving import halve
from meshes.mesh import PhalanxMesh
from meshes.quality import scaled_jacobians, volumes
from meshes.topology import local_facets, outer_facets, structured
from tests.meshes.fingers import BUILD, PAPER, L, R
from tests.meshes.lengths import edge_lengths

HALVED = meshes.Sizing(3e-3, 3e-3, 3e-4, growth=1.4, patch_size=1e-3, halvings=3)
FULL = replace(HALVED, full_volume=True)


@pytest.mark.parametrize("angle", [-52.0, 0.0, 20.0, 52.0, 75.0, 87.0])
@pytest.mark.parametrize("dim", [3, 2])
def test_hanging_nodes_lie_between_free_ones_and_sides_close(dim: int, angle: float) -> None:
    mesh = BUILD[dim](PAPER, replace(FULL, contact_angle=math.radians(angle)))
    hanging, masters = mesh.ties[:, 0], mesh.ties[:, 1:]
    nodes = np.unique(mesh.cells[mesh.cell_sets["phalanx_3"]])
    assert len(np.unique(mesh.points[nodes].round(9), axis=0)) == len(nodes)  # one node a place
    assert len(hanging)
    assert not np.isin(masters, hanging).any()
    assert mesh.points[hanging] == pytest.approx(mesh.points[masters].mean(axis=1), abs=1e-16)
    # Areas of all sides, as vectors: those of whole cells cancel those of the halved ones.
    sides = mesh.points[mesh.cells[:, local_facets(dim)]].reshape(-1, 2 ** (dim - 1), dim)
    if dim == 3:
        sides = 0.5 * np.cross(sides[:, 2] - sides[:, 0], sides[:, 3] - sides[:, 1])
    else:
        sides = sides[:, 1] - sides[:, 0]
    assert np.abs(sides.sum(axis=0)).max() < 1e-12 * np.abs(sides).sum()
    assert scaled_jacobians(mesh.points, mesh.cells).min() > 0.6


@pytest.mark.parametrize("dim", [3, 2])
def test_a_neighbour_that_is_cut_later_sets_its_hanging_nodes_free(dim: int) -> None:
    """Two cells in a row, one after the other: the lattice of 5 x 3 x 3 nodes, none twice."""
    axes = np.meshgrid(np.arange(3.0), *[np.arange(2.0)] * (dim - 1), indexing="ij")
    points = np.stack(axes, axis=-1).reshape(-1, dim)
    cells = structured(np.arange(len(points)).reshape(3, *[2] * (dim - 1)))
    outer, none = outer_facets(cells), np.empty((0, 1 + 2 ** (dim - 1)), dtype=np.int64)
    one = halve(
        PhalanxMesh(points, cells, {"all": np.arange(len(points))}, outer, none), np.array([0])
    )
    assert len(one.ties) == (5 if dim == 3 else 1)
    assert (one.points[one.ties[:, 0], 0] == 1.0).all()
    both = halve(one, np.array([0]))
    assert not both.ties.size
    assert len(both.points) == len(np.unique(both.points, axis=0)) == 5 * 3 ** (dim - 1)
    assert volumes(both.points, both.cells) == pytest.approx(0.5**dim)
    assert len(both.facets) == len(outer) * 2 ** (dim - 1) == len(outer_facets(both.cells))
    inner = (both.points[:, 1:] == 0.5).all(axis=1) & (both.points[:, 0] % 2 > 0)
    assert np.array_equal(both.roles["all"], np.flatnonzero(~inner))


@pytest.mark.parametrize("patch", [1e-3, 3e-3])
@pytest.mark.parametrize("dim", [3, 2])
def test_edges_are_fine_on_the_patch_and_few_elsewhere(dim: int, patch: float) -> None:
    """On a large patch they had grown by 1.6, as the ball recedes from its plane of contact."""
    sizing = replace(HALVED, patch_size=patch)
    mesh, blocks = (BUILD[dim](PAPER, replace(sizing, halvings=n)) for n in (3, 0))
    contact = np.zeros(dim)
    angle = HALVED.contact_angle
    contact[:2] = R - 3 * L - R * math.cos(angle), -R * math.sin(angle)
    facets = mesh.points[mesh.facet_sets["surface"]]
    near = (np.linalg.norm(facets - contact, axis=2) < patch).all(axis=1)
    edges = np.linalg.norm(facets[near] - np.roll(facets[near], 1, axis=1), axis=2)
    assert edges.max() < 1.4 * HALVED.tip_size
    assert edge_lengths(mesh.points, mesh.cells).min() > 0.5 * HALVED.tip_size
    assert len(mesh.cells) < len(blocks.cells) / (4 if dim == 3 else 1.5)
    assert not np.isin(mesh.ties[:, 0], mesh.node_sets["hinge_3_proximal"]).any()


@pytest.mark.parametrize("halvings", [0, 3])
def test_full_volume_has_the_masses_and_second_moments_of_round_bodies(halvings: int) -> None:
    true = math.pi * R**2 * L / 2, math.pi * R**2 * (L - R) / 2 + math.pi * R**3 / 3
    for full, least, most in ((True, -2e-3, 2e-3), (False, -0.026, -0.001)):
        mesh = BUILD[3](PAPER, replace(FULL, halvings=halvings, full_volume=full))
        for w, volume in ((1, true[0]), (3, true[1])):
            cells = mesh.cells[mesh.cell_sets[f"phalanx_{w}"]]
            assert least < volumes(mesh.points, cells).sum() / volume - 1 < most
    # an equal-area polygon of 16 sides: its second moment is right to 1e-3
    face = mesh.node_sets["proximal_face_1"]
    outer = np.linalg.norm(mesh.points[face, 1:], axis=1).max()
    assert outer == pytest.approx(R, rel=1e-12)  # of the mesh that is not full
    mesh = BUILD[3](PAPER, replace(FULL, halvings=halvings))
    outer = np.linalg.norm(mesh.points[face, 1:], axis=1).max()
    sector = 2 * math.pi / 16
    assert outer == pytest.approx(R * math.sqrt(sector / math.sin(sector)), rel=2e-3)


def test_a_flat_shaft_does_not_stand_out_towards_the_surface() -> None:
    sizing = replace(FULL, contact_angle=0.5 * math.pi)
    mesh = BUILD[3](PAPER, sizing)
    points = mesh.points[mesh.cells[mesh.cell_sets["phalanx_3"]]].reshape(-1, 3)
    assert points[:, 1].min() >= -R * (1 + 1e-12)


def test_mirrored_halves_share_what_hangs_in_the_plane() -> None:
    half = BUILD[3](PAPER, FULL)
    whole = meshes.mirrored(half)
    in_plane = np.isin(half.ties[:, 0], half.node_sets["symmetry"]).sum()
    assert len(whole.ties) == 2 * len(half.ties) - in_plane
    hanging, masters = whole.ties[:, 0], whole.ties[:, 1:]
    assert whole.points[hanging] == pytest.approx(whole.points[masters].mean(axis=1), abs=1e-16)


def test_no_file_has_hanging_nodes(tmp_path: object) -> None:
    with pytest.raises(meshes.MeshError, match="a file cannot hold hanging nodes"):
        meshes.write(BUILD[2](PAPER, FULL), f"{tmp_path}/mesh.vtu")


def test_halves_count_too() -> None:
    """1216 elements are planned; halved five times they are 12,521."""
    finger = meshes.FingerGeometry((0.04,), (0.015,))
    sizing = meshes.Sizing(
        3e-3, 3e-3, 1e-4, patch_size=3e-3, halvings=5, max_elements=2000, contact_angle=0.9
    )
    assert meshes.count_elements(finger, sizing) < 2000
    with pytest.raises(meshes.MeshError, match=r"elements .* above max_elements = 2000"):
        meshes.finger_hexahedra(finger, sizing)
