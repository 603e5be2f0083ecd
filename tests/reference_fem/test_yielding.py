"""What the tip yields beside half-space and beam: the parts in closed form, the whole on a mesh."""

import numpy as np
import pytest

import meshes
import reference_fem as rf
from reference_fem.statics.yielding import beam, half_space, tip_yield

RADIUS, E, NU = 0.0075, 1e9, 0.4
MATERIAL = rf.Material(E, NU, 1400.0)


def test_the_half_space_is_hertzs_and_mindlins() -> None:
    """Work of Hertz's pressure on its own indentation, 0.3 F^2/(E* b) = 2/5 F d, d = 3 F/(4 E* b);
    the tangential one is larger by Mindlin's ratio (2 - nu)/(2 (1 - nu)).
    """
    patch, modulus = 1e-3, E / (1 - NU**2)
    normal, along = np.diag(half_space(MATERIAL, patch))
    assert 0.5 * normal == pytest.approx(0.4 * 0.75 / (modulus * patch), rel=1e-12)
    assert along / normal == pytest.approx((2 - NU) / (2 * (1 - NU)), rel=1e-12)


def test_the_beam_is_a_cantilever_with_a_rigid_end() -> None:
    """A touch at the pole stretches and bends, at a right angle to it bends by both its arms."""
    s, area, bending = RADIUS, np.pi * RADIUS**2, E * np.pi * RADIUS**4 / 4
    kappa = 6 * (1 + NU) ** 2 / (7 + 12 * NU + 4 * NU**2)
    shear = 2 * (1 + NU) * s / (kappa * E * area)
    pole = beam(MATERIAL, RADIUS, 0.0, s)
    # from the section to the pole a force at the end of s + R, rigid over the last R
    bend = (s**3 / 3 + s**2 * RADIUS + s * RADIUS**2) / bending
    assert pole == pytest.approx(np.diag([s / (E * area), bend + shear]), rel=1e-12, abs=1e-20)
    side = beam(MATERIAL, RADIUS, 0.5 * np.pi, s)
    assert side[0, 0] == pytest.approx(s**3 / (3 * bending) + shear, rel=1e-12)
    assert side[1, 1] == pytest.approx(s / (E * area) + RADIUS**2 * s / bending, rel=1e-12)
    assert side[0, 1] == pytest.approx(side[1, 0], rel=1e-12)


def test_a_meshed_tip_yields_as_the_closed_form_says() -> None:
    """At 38 degrees below the horizontal, nu = 0.4: -0.15, 0.34, 0.985, known to 0.03, 0.05, 0.1.

    Edges of 0.4 of the patch are too stiff under it: of its 2.0 normal and 3.6 along, some 5 %.
    """
    angle = np.radians(52.0)
    sizing = meshes.Sizing(RADIUS / 5, RADIUS / 3, 0.1 * RADIUS, contact_angle=angle, growth=1.2)
    mesh = meshes.finger_hexahedra(meshes.FingerGeometry((3 * RADIUS,), (2 * RADIUS,)), sizing)
    found = tip_yield(mesh, MATERIAL, angle)
    assert found.nn == pytest.approx(-0.15, abs=0.03 + 0.05 * 2.0)
    assert found.nt == pytest.approx(0.34, abs=0.05)
    assert found.tt == pytest.approx(0.985, abs=0.1 + 0.05 * 3.6)


def test_hanging_nodes_are_refused() -> None:
    """Without them it would be half as stiff, and say nothing."""
    finger = meshes.FingerGeometry((0.04,), (2 * RADIUS,))
    mesh = meshes.finger_hexahedra(finger, meshes.Sizing(2.5e-3, 4e-3, 6e-4, halvings=2))
    with pytest.raises(ValueError, match=r"hanging nodes.*halvings = 0"):
        tip_yield(mesh, MATERIAL, 0.7)
