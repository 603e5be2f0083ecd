"""Hinges' means are by area: exact for linear fields, and as compliant on any mesh."""

import dataclasses

import numpy as np
import pytest

import meshes
from meshes.quality import volumes
from meshes.topology import outer_facets
from reference_fem import Drive, Material, Settings, Surface
from reference_fem.joints.hinges import mean_weights
from reference_fem.model import build_model
from tests.reference_fem.boxes import boxes

R = 7.5e-3
GEOMETRY = meshes.FingerGeometry((0.04, 0.04), (2 * R, 2 * R))
HOLED = dataclasses.replace(GEOMETRY, shaft_radius=2e-3)
SIZINGS = {
    "coarse": meshes.Sizing(5e-3, 1e-2, 5e-3),
    "even": meshes.Sizing(1.5e-3, 4e-3, 1.5e-3),
    "graded": meshes.Sizing(1.5e-3, 4e-3, 2e-4),
}
BUILD = {3: meshes.finger_hexahedra, 2: meshes.finger_quadrilaterals}


def means(mesh: meshes.FingerMesh, name: str) -> tuple[np.ndarray, np.ndarray]:
    nodes, weights = mean_weights(mesh.points, mesh.cells, mesh.node_sets[name], R)
    return mesh.points[nodes], weights


@pytest.mark.parametrize("section", [(0.01,), (0.01, 0.02)], ids=["2D", "3D"])
def test_mean_of_a_linear_field_is_exact_on_uneven_nodes(section: tuple[float, ...]) -> None:
    # Nodes crowd at large y, so that their average is off the middle, where the mean of a linear
    # field over the face is (in 2D too, as the chord is even in y).
    mesh = boxes((0.02,), section, (2, 4, 2)[: 1 + len(section)])
    points = mesh.points.copy()
    points[np.isclose(points[:, 1], 2.5e-3), 1] = 4e-3
    x, weights = means(dataclasses.replace(mesh, points=points), "hinge_1_proximal")
    assert x[:, 1].mean() > 2e-4
    assert weights @ (3.0 - 7.0 * x[:, 1]) == pytest.approx(3.0, rel=1e-12)


@pytest.mark.parametrize("dim", [3, 2])
@pytest.mark.parametrize("sizing", SIZINGS.values(), ids=SIZINGS.keys())
def test_second_moment_is_the_discs_on_any_mesh(dim: int, sizing: meshes.Sizing) -> None:
    mesh = BUILD[dim](GEOMETRY, sizing)
    sides = outer_facets(mesh.cells)
    for name in ("hinge_1_proximal", "hinge_1_distal", "hinge_2_proximal"):
        x, weights = means(mesh, name)
        assert np.abs(weights @ x[:, :2] - [x[0, 0], 0.0]).max() < 1e-16
        # ∫ y² dA/A = R²/4; bilinear shape functions between nodes h apart add h²/6 at most, and
        # the polygon of edges h long has lost h²/12 at most.
        face = sides[np.isin(sides, mesh.node_sets[name]).all(axis=1)]
        ends = mesh.points[face], mesh.points[np.roll(face, 1, axis=1)]
        h = np.linalg.norm(ends[0] - ends[1], axis=2).max()
        assert -(h**2) / 12.0 < weights @ x[:, 1] ** 2 - 0.25 * R**2 < h**2 / 6.0


@pytest.mark.parametrize("sizing", SIZINGS.values(), ids=SIZINGS.keys())
def test_even_traction_of_a_hinge_leaves_a_bar_in_even_stress(sizing: meshes.Sizing) -> None:
    # Patch test: under u_x = e x the force of the elements on the end face is σ A times the
    # weights, and none elsewhere (ν = 0), so that a hinge adds no compliance to the bar's L/(E A).
    mesh = BUILD[3](GEOMETRY, sizing)
    material = (Material(1e9, 0.0, 1000.0),) * 2
    model = build_model(mesh, material, Surface(10.0, 0.0), Drive(), Settings())
    strain = 1e-6
    displacement = np.zeros_like(mesh.points)
    displacement[:, 0] = strain * mesh.points[:, 0]
    force = np.empty_like(displacement)
    model.kernel.internal_force(displacement, force)
    own = mesh.cells[mesh.cell_sets["phalanx_1"]]
    area = volumes(mesh.points, own).sum() / 0.04
    expected = np.zeros_like(force)
    for name, sign in (("hinge_1_proximal", 1.0), ("hinge_1_distal", -1.0)):
        nodes, weights = mean_weights(mesh.points, mesh.cells, mesh.node_sets[name], R)
        expected[nodes, 0] = sign * 1e9 * strain * area * weights
    body = np.unique(own)
    # St. Venant-Kirchhoff: P = σ (1 + 3 e/2) to first order in the strain
    assert np.abs(force[body] - expected[body]).max() < 2 * strain * np.abs(expected).max()


@pytest.mark.parametrize("dim", [3, 2])
def test_holes_edges_count_by_length(dim: int) -> None:
    mesh = BUILD[dim](HOLED, SIZINGS["even"])
    x, weights = means(mesh, "hinge_2_proximal")
    assert np.abs(weights @ x[:, :2] - [-0.04, 0.0]).max() < 1e-16
    assert weights @ x[:, 1] ** 2 == pytest.approx(2e-3**2, rel=1e-12)
    if dim == 3:  # two straight lines from the plane of motion to the round surface
        half_length = np.sqrt(R**2 - 2e-3**2)
        assert weights @ x[:, 2] == pytest.approx(half_length / 2, rel=1e-12)


def test_a_set_that_spans_no_face_is_refused() -> None:
    mesh = boxes((0.02,), (0.01, 0.01), (3, 2, 2))
    scattered = np.append(mesh.node_sets["hinge_1_proximal"], 0)
    sets = {**mesh.node_sets, "hinge_1_proximal": scattered}
    with pytest.raises(ValueError, match=r"'hinge_1_proximal': 1 of its 10 nodes lie on no facet"):
        build_model(
            dataclasses.replace(mesh, node_sets=sets),
            (Material(1e9, 0.3, 1000.0),),
            Surface(1.0, 0.0),
            Drive(),
            Settings(),
        )
