"""A disc on a rigid line against Hertz's two-dimensional law: the plane-stress model's contact."""

import math

import numpy as np
import pytest

from meshes import FingerMesh
from meshes.ball import half_ball
from meshes.topology import orient, outer_facets
from reference_fem import Material, Settings, Status, Surface
from reference_fem import model as modelling
from tests.reference_fem.taps import body, throw

RADIUS, THICKNESS = 0.0075, 0.002
# Edges at the line over the radius, a seventh of b, and how far they stay even.
TIP, GROWTH, PATCH = 0.003, 1.15, 0.027
LAWS: list[dict] = [{"contact": "surface"}, {"contact": "impulse"}]
MATERIAL = Material(1e9, 0.3, 1400.0)


def disc(tip: float, growth: float) -> FingerMesh:
    """The half ball's plane of symmetry, quadrilaterals graded towards the lowest point."""
    ball = half_ball(RADIUS, tip * RADIUS, growth, patch_size=PATCH * RADIUS)
    faces = outer_facets(ball.cells)
    faces = faces[(ball.points[faces, 2] == 0.0).all(axis=1)]
    nodes, place = np.unique(faces, return_inverse=True)
    points = ball.points[nodes, :2]
    cells = orient(points, place.reshape(-1, 4))
    edges = outer_facets(cells)
    outside = np.linalg.norm(points[edges], axis=2).min(axis=1) > (1 - 1e-9) * RADIUS
    lower = points[edges, 1].mean(axis=1) < 0.0
    return FingerMesh(
        points,
        cells,
        {"pole": np.array([np.argmin(points[:, 1])])},
        {"surface": edges[outside & lower], "tip": edges[outside]},
        {"phalanx_1": np.arange(len(cells))},
    )


@pytest.mark.parametrize("contact", LAWS, ids=lambda law: law["contact"])
def test_disc_on_a_line_is_hertz_in_two_dimensions(
    contact: dict, monkeypatch: pytest.MonkeyPatch
) -> None:
    """b = sqrt(4 F' R/(pi E*)) and p_0 = 2 F'/(pi b), F' the force per thickness, E* = E.

    (Johnson, Contact Mechanics, eqs. 4.43 and 4.46; plane stress takes E where plane strain takes
    E/(1 - nu²).) An even thickness stands in for the round section's chord. The approach is no
    part of the law: in two dimensions it depends on the body's shape and support.
    """
    monkeypatch.setattr(
        modelling, "chord_thickness", lambda points, cells, radius: np.full(cells.shape, THICKNESS)
    )
    speed = 3e-4 * MATERIAL.bar_speed
    settings = Settings(max_contact_time_s=1e-3, output_interval=5, **contact)
    mesh = disc(TIP, GROWTH)
    surface = Surface(RADIUS * (1 + 1e-9), 0.0)
    model = body(mesh, MATERIAL, surface, settings)
    result = throw(model, settings, (0.0, -speed))
    assert result.status is Status.COMPLETED
    history = result.history
    line = history.normal_force_N / THICKNESS
    pressed = line > 0.5 * line.max()
    half_width = np.sqrt(4 * line[pressed] * RADIUS / (math.pi * MATERIAL.youngs_modulus))
    pressure = 2 * line[pressed] / (math.pi * half_width)
    found = 0.5 * history.contact_area_m2[pressed] / THICKNESS
    # Nodal means, and St. Venant-Kirchhoff's softening by p_0/E = b/2R = 1 %.
    assert history.peak_pressure_Pa[pressed] == pytest.approx(pressure, rel=0.04)
    # The rim is known to one edge.
    assert (np.abs(found - half_width) < 1.05 * TIP * RADIUS).all()
    assert (found / half_width).mean() == pytest.approx(1.0, abs=0.1)
    # In two dimensions a share of v/c remains as vibration.
    mirrored = 2 * model.mass.sum() * speed
    assert result.summary.normal_impulse_N_s == pytest.approx(mirrored, rel=5e-3)
    assert (result.summary.energy_residual or 1.0) < 1e-3
