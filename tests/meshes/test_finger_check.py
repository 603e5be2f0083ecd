"""A mesh is the finger that it should be, or is refused by the phalanx's or the set's name."""

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

import meshes
from tests.meshes.fingers import BUILD, FINE_TIP

GEOMETRY = meshes.FingerGeometry((0.04, 0.03), (0.015, 0.012))
COARSE = meshes.Sizing(5e-3, 1e-2, 5e-3)
SIZINGS = {"fast": meshes.SIZINGS["fast"], "coarse": COARSE, "fine tip": FINE_TIP}
SIZINGS |= {
    f"{name}, whole volume": dataclasses.replace(sizing, full_volume=True)
    for name, sizing in SIZINGS.items()
}
SHAPES = {
    "plain": GEOMETRY,
    "holed": dataclasses.replace(GEOMETRY, shaft_radius=2e-3),
    "flat": dataclasses.replace(GEOMETRY, tip="flat"),
}


@pytest.fixture(scope="module", params=[3, 2])
def mesh(request: pytest.FixtureRequest) -> meshes.FingerMesh:
    return BUILD[request.param](GEOMETRY, COARSE)


@pytest.mark.parametrize("dim", [3, 2])
@pytest.mark.parametrize("sizing", SIZINGS.values(), ids=SIZINGS.keys())
@pytest.mark.parametrize("geometry", SHAPES.values(), ids=SHAPES.keys())
def test_our_meshes_are_the_finger(
    geometry: meshes.FingerGeometry, sizing: meshes.Sizing, dim: int
) -> None:
    meshes.check_finger(BUILD[dim](geometry, sizing), geometry)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"lengths": (0.04, 0.031)}, r"phalanx 2 is 0.03 m long, .* is 0.031"),
        ({"lengths": (0.03, 0.04)}, r"phalanx 1 is 0.04 m long, .* is 0.03"),
        ({"diameters": (0.03, 0.012)}, r"phalanx 1 is 0.015 m thick, .* is 0.03"),
        ({"diameters": (0.015, 0.01201)}, r"phalanx 2 is 0.012 m thick, .* is 0.01201"),
        ({"lengths": (0.04,), "diameters": (0.015,)}, r"has 2 phalanges, the finger has 1"),
        ({"tip": "flat"}, r"phalanx 2 has \d+ of \d+ outer facets off .* by up to"),
        ({"shaft_radius": 2e-3}, "phalanx 1 has no holes, and the finger's shafts have"),
    ],
)
def test_another_finger(mesh: meshes.FingerMesh, change: dict, message: str) -> None:
    with pytest.raises(meshes.MeshError, match=message):
        meshes.check_finger(mesh, dataclasses.replace(GEOMETRY, **change))


def test_hanging_nodes_are_not_two_bodies() -> None:
    """A halved mesh of one body was "2 parts not joined by a facet"."""
    fine = dataclasses.replace(COARSE, tip_size=5e-4, halvings=1, patch_size=1e-3)
    with pytest.raises(meshes.MeshError, match=r"hanging nodes, .* without halvings"):
        meshes.check_finger(BUILD[3](GEOMETRY, fine), GEOMETRY)


def of_cells(mesh: meshes.FingerMesh, chosen: np.ndarray) -> meshes.FingerMesh:
    """The mesh with those of its elements alone (or again)."""
    sets = {k: np.flatnonzero(np.isin(chosen, v)) for k, v in mesh.cell_sets.items()}
    return dataclasses.replace(mesh, cells=mesh.cells[chosen], cell_sets=sets)


def placed(mesh: meshes.FingerMesh, scale: tuple, offset: tuple) -> meshes.FingerMesh:
    points = mesh.points * scale[: mesh.dim] + np.array(offset[: mesh.dim])
    return dataclasses.replace(mesh, points=points)


def two_parts(mesh: meshes.FingerMesh) -> meshes.FingerMesh:
    middle = mesh.points[mesh.cells][:, :, 0].mean(axis=1)
    cut = np.abs(middle + 0.02) == np.abs(middle + 0.02).min()
    return of_cells(mesh, np.flatnonzero(~cut))


def joined(mesh: meshes.FingerMesh) -> meshes.FingerMesh:
    """Both sides of hinge 2 have one node in common."""
    one, other = mesh.node_sets["hinge_1_distal"], mesh.node_sets["hinge_2_proximal"]
    on_axis = [
        nodes[np.argmin(np.abs(mesh.points[nodes, 1:]).sum(axis=1))] for nodes in (one, other)
    ]
    cells = np.where(mesh.cells == on_axis[1], on_axis[0], mesh.cells)
    return dataclasses.replace(mesh, cells=cells)


def dented(mesh: meshes.FingerMesh) -> meshes.FingerMesh:
    points = mesh.points.copy()
    touching = mesh.facet_sets["surface"][0]
    points[touching, 1] *= 0.99
    return dataclasses.replace(mesh, points=points)


@pytest.mark.parametrize(
    ("broken", "message"),
    [
        (lambda m: placed(m, (1, 0.5, 0.5), (0, 0, 0)), "phalanx 1 is 0.0075 m thick, .* 0.015"),
        (lambda m: placed(m, (1, 1, 1), (0.05, 0, 0)), "phalanx 1 begins at x = 0.05 m, .* at 0"),
        (lambda m: placed(m, (1, 1, 1), (0, 0.05, 0)), "phalanx 1 lies 0.05 m above the axis"),
        (dented, r"phalanx 2 has \d+ of \d+ outer facets off the finger's surface, by up to"),
        (two_parts, "cell set phalanx_1: 2 parts"),
        (joined, "cell sets phalanx_1 and phalanx_2 share 1 nodes"),
        (
            lambda m: of_cells(m, np.repeat(np.arange(len(m.cells)), 2)),
            "phalanx 1 fills .*, the finger's",
        ),
    ],
    ids=["thin", "moved", "lifted", "dented", "two parts", "joined", "twice"],
)
def test_bodies_that_are_not_the_fingers(
    mesh: meshes.FingerMesh, broken: Callable, message: str
) -> None:
    with pytest.raises(meshes.MeshError, match=message):
        meshes.check_finger(broken(mesh), GEOMETRY)


def test_half_model_is_round_and_begins_at_its_plane() -> None:
    mesh = BUILD[3](GEOMETRY, COARSE)
    for scale, lift, message in (
        (0.95, 0.0, "facets off the finger's surface"),
        (1.0, 1e-3, "phalanx 1 begins at z = 0.001 m, a half finger at 0"),
    ):
        with pytest.raises(meshes.MeshError, match=message):
            meshes.check_finger(placed(mesh, (1, 1, scale), (0, 0, lift)), GEOMETRY)


@pytest.mark.parametrize("content", ["all nodes", "one node", "swapped"])
def test_sets_hold_what_they_are_named_for(mesh: meshes.FingerMesh, content: str) -> None:
    names = sorted(mesh.node_sets)
    for name, other in zip(names, names[::-1], strict=True):
        if content == "one node" and len(mesh.node_sets[name]) == 1:
            continue
        members = {
            "all nodes": np.arange(len(mesh.points)),
            "one node": mesh.node_sets[name][:1],
            "swapped": mesh.node_sets[other],
        }[content]
        if np.array_equal(members, mesh.node_sets[name]):
            continue
        wrong = dataclasses.replace(mesh, node_sets={**mesh.node_sets, name: members})
        with pytest.raises(meshes.MeshError, match=f"^node set {name}: lacks"):
            meshes.check_finger(wrong, GEOMETRY)


@pytest.mark.parametrize("name", ["surface", "tip"])
def test_facet_sets_are_the_outer_side(mesh: meshes.FingerMesh, name: str) -> None:
    whole = mesh.facet_sets[name]
    for kept, lacks in ((whole[:1], len(whole) - 1), (whole[1:], 1)):
        facets = {**mesh.facet_sets, name: kept}
        with pytest.raises(meshes.MeshError, match=f"^facet set {name}: lacks {lacks} of"):
            meshes.check_finger(dataclasses.replace(mesh, facet_sets=facets), GEOMETRY)
    turned = {**mesh.facet_sets, name: np.concatenate([whole[::-1, ::-1], whole])}
    meshes.check_finger(dataclasses.replace(mesh, facet_sets=turned), GEOMETRY)
