"""The round tip that facets stand for, against the sphere and the cylinder themselves."""

import math
from dataclasses import replace

import numpy as np
import pytest

import meshes
from meshes.ball import half_ball
from reference_fem.contact.law import COLUMNS, NORMAL, Memory, Motion
from reference_fem.contact.springs import SpringContact, spring_forces
from reference_fem.contact.surface import sphere, standing_out, surface_contact
from reference_fem.elements.facet_quadrature import facet_quadrature
from tests.reference_fem.boxes import boxes

R = 0.0075
BUILD = {2: meshes.finger_quadrilaterals, 3: meshes.finger_hexahedra}


@pytest.mark.parametrize("tip", ["hemisphere", "flat"])
@pytest.mark.parametrize("dim", [2, 3])
def test_facets_stand_in_a_capsule(dim: int, tip: str) -> None:
    geometry = meshes.FingerGeometry((0.03,), (2 * R,), tip)
    mesh = BUILD[dim](geometry, meshes.Sizing(2e-3, 2e-3, 2e-3))
    quadrature = facet_quadrature(mesh.points, mesh.facet_sets["surface"])
    out = standing_out(mesh, quadrature.facets, quadrature.shape)
    if tip == "flat":
        assert not out.any()
        return
    places = np.einsum("qa,fad->fqd", quadrature.shape, mesh.points[quadrature.facets])
    arm = places - np.array([R - 0.03, 0.0, 0.0][:dim])
    arm[..., 0] = np.minimum(arm[..., 0], 0.0)
    assert out == pytest.approx(R - np.linalg.norm(arm, axis=2), abs=1e-9 * R)


def test_a_patch_is_round_where_other_nodes_stand_out() -> None:
    """Nodes moved out for the whole volume leave no sphere through the tip but the patch on it."""
    geometry = meshes.FingerGeometry((0.03,), (2 * R,))
    sizing = meshes.Sizing(2e-3, 2e-3, 3e-4, patch_size=1e-3, full_volume=True)
    mesh = meshes.finger_hexahedra(geometry, sizing)
    quadrature = facet_quadrature(mesh.points, mesh.facet_sets["surface"])
    out = standing_out(mesh, quadrature.facets, quadrature.shape)
    places = np.einsum("qa,fad->fqd", quadrature.shape, mesh.points[quadrature.facets])
    arm, angle = places - [R - 0.03, 0.0, 0.0], sizing.contact_angle
    touch = R * np.array([-math.cos(angle), -math.sin(angle), 0.0])
    patch = (np.linalg.norm(arm - touch, axis=2) < 1e-3).all(axis=1)
    assert patch.sum() > 10
    assert out[patch] == pytest.approx(R - np.linalg.norm(arm[patch], axis=2), abs=1e-9 * R)


def test_a_sphere_is_found_where_there_is_one() -> None:
    ball = half_ball(R, 0.1 * R, 1.5)
    nodes = ball.points[np.unique(ball.facet_sets["tip"])]
    found = sphere(nodes + 0.3)
    assert found is not None
    assert found[0] == pytest.approx(np.full(3, 0.3), abs=1e-9)
    assert found[1] == pytest.approx(R)
    nodes[0] *= 1 + 1e-5
    assert sphere(nodes) is None
    assert sphere(boxes((0.03,), (0.01, 0.01), (3, 1, 1)).points[:4]) is None
    square = np.array([[x, 0.0, z] for x in (0.0, 1.0) for z in (0.0, 1.0, 2.0)])
    assert sphere(square) is None


def pressed(law: SpringContact, points: np.ndarray, depth: float, turn: float) -> float:
    """F_n of a rigid ball about the origin, turned about Z and pushed `depth` into the plane."""
    c, s = math.cos(turn), math.sin(turn)
    moved = points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    still = np.zeros_like(points)
    nowhere = 0.0, 0.0
    mass = np.ones(len(points))
    motion = Motion(points, moved - points, still, mass, nowhere, 1.0, R - depth, 0.0)
    row = np.zeros(COLUMNS)
    memory = Memory(
        np.zeros(law.sites, dtype=np.bool_), np.zeros((law.sites, 2)), np.zeros((law.sites, 2))
    )
    spring_forces(law.parts, motion, memory, still.copy(), row)
    return float(row[NORMAL])


def test_force_on_a_pressed_ball_converges_whatever_the_phase_of_its_mesh() -> None:
    """F = ∫ κ (δ - r²/2R) dA = κ π R δ²; half of it on half a ball.

    Seven turns within an edge put the rim between other rings of nodes. Points on the sphere
    scatter by the rule's error where p has a kink, of order 2; facets lie below by h²/8R as well,
    a share (h/b)² of δ, which the scatter follows.
    """
    depth, modulus = 0.005 * R, 1e12
    rim = math.sqrt(2 * R * depth)
    exact = 0.5 * modulus * math.pi * R * depth**2
    worst = []
    for share in (1.0, 0.5, 0.25, 0.125):  # edges over the rim's radius
        ball = half_ball(R, share * rim, 1.5, patch_size=1.3 * rim)
        quadrature = facet_quadrature(ball.points, ball.facet_sets["surface"])
        out = standing_out(ball, quadrature.facets, quadrature.shape)
        law = surface_contact(quadrature, out, modulus, 0.0)
        turns = np.linspace(0.0, share * rim / R, 7)
        flat = replace(law, parts=law.parts._replace(out=np.zeros_like(out)))
        forces = np.array(
            [[pressed(of, ball.points, depth, t) for t in turns] for of in (law, flat)]
        )
        worst.append(np.abs(forces / exact - 1.0).max(axis=1))
    errors, flat_errors = np.array(worst).T
    assert math.log2(errors[0] / errors[-1]) / 3 > 2.0  # measured 2.8
    assert math.log2(flat_errors[0] / flat_errors[-1]) / 3 == pytest.approx(2.0, abs=0.1)
    assert (errors < flat_errors / 20).all()
    assert errors[2] < 1e-3  # edges of a quarter of the rim's radius; flat facets: 4 %
