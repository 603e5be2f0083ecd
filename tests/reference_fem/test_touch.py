"""How hard a finger touches: the chain's mobility against its energy, and Hertz's closed form."""

import math

import numpy as np
import pytest

import meshes
from reference_fem import ChainState, Drive, Material, Settings, Surface, predicted_touch
from reference_fem.model import build_model
from reference_fem.rigid_chain import chain_and_start, pose

R, L = 0.0075, 0.04
SIZING = meshes.Sizing(1e-3, 2e-3, 1e-3)
MATERIAL = Material(1e9, 0.4, 1400.0)


def test_mobility_is_the_velocity_that_an_impulse_gives() -> None:
    """G = J M⁻¹ Jᵀ, M the Hessian of the energy in the rates and J the velocities at unit rates."""
    mesh = meshes.finger_hexahedra(meshes.FingerGeometry((L,) * 3, (2 * R,) * 3), SIZING)
    model = build_model(mesh, (MATERIAL,) * 3, Surface(0.1, 0.5), Drive(), Settings())
    chain, _ = chain_and_start(model.chain, None)
    angles, pole = np.array([0.9, 0.7, 0.4]), [model.pole]

    def at(rates: np.ndarray) -> ChainState:
        return ChainState(angles, rates, 0.0)

    unit, still = np.eye(3), np.zeros(3)
    energy = [[chain.energy(at(a + b)) for a in unit] for b in unit]
    alone = np.array([chain.energy(at(a)) for a in unit])
    inertia = energy - alone[:, None] - alone + chain.energy(at(still))
    spins = [pose(chain, at(a), model.points[pole], model.body_of_point[pole]) for a in unit]
    turned = np.array([velocity[0, :2] for _, velocity in spins]).T
    place = model.points[model.pole, :2] + spins[0][0][0, :2]
    rates = np.array([3.0, -2.0, 5.0])
    mobility, velocity = chain.mobility(at(rates), place)
    assert mobility == pytest.approx(turned @ np.linalg.solve(inertia, turned.T), rel=1e-9)
    assert velocity == pytest.approx(turned @ rates)


@pytest.mark.parametrize("friction", [0.0, 0.5, 50.0])
def test_one_phalanx_touches_as_a_hinged_rod_with_hertz_law(friction: float) -> None:
    """1/m = (r_x² - μ s r_x r_y)/J with r from the hinge to the lowest point, s = sgn(-ω r_y)."""
    mesh = meshes.finger_hexahedra(meshes.FingerGeometry((L,), (2 * R,)), SIZING)
    tilt, rate = 0.6, 30.0
    state = ChainState(np.array([tilt]), np.array([rate]), 0.0)
    touch = predicted_touch(mesh, (MATERIAL,), Surface(0.03, friction), Drive(), state)
    rod, ball = 1400 * math.pi * R**2 * (L - R), 1400 * 2 / 3 * math.pi * R**3
    inertia = rod * ((L - R) ** 2 / 3 + R**2 / 4)
    inertia += ball * (83 / 320 * R**2 + (L - R + 3 * R / 8) ** 2)
    x, y = -(L - R) * math.cos(tilt), -(L - R) * math.sin(tilt) - R
    slip = -friction * math.copysign(1.0, -rate * y)
    yielding = x * x - slip * x * y
    mass = inertia / (yielding if yielding > 0.0 else x * x)
    # The section of 24 edges round misses 1 % of the area, and 2 % of the second moment.
    assert touch.mass == pytest.approx(mass, rel=0.03)
    assert touch.speed == pytest.approx(-rate * x)
    assert touch.angle == pytest.approx(math.pi / 2 - tilt)
    whirled = ChainState(np.array([tilt + 4.0 * math.pi]), np.array([rate]), 0.0)
    again = predicted_touch(mesh, (MATERIAL,), Surface(0.03, friction), Drive(), whirled)
    assert again.angle == pytest.approx(touch.angle)
    modulus = MATERIAL.plane_strain_modulus
    energy = 8 / 15 * modulus * touch.patch_radius**5 / R**2
    assert energy == pytest.approx(0.5 * touch.mass * touch.speed**2)
    assert touch.force == pytest.approx(4 / 3 * modulus * touch.patch_radius**3 / R)


@pytest.mark.parametrize(("tilt", "angle"), [(-0.3, math.pi / 2), (2.0, 0.0)])
def test_a_finger_that_moves_away_or_points_beyond_has_a_touch_too(
    tilt: float, angle: float
) -> None:
    mesh = meshes.finger_quadrilaterals(meshes.FingerGeometry((L,), (2 * R,)), SIZING)
    state = ChainState(np.array([tilt]), np.array([-30.0 * math.cos(tilt)]), 0.0)
    touch = predicted_touch(mesh, (MATERIAL,), Surface(0.03, 0.5), Drive(), state)
    assert (touch.angle, touch.speed, touch.force) == (angle, 0.0, 0.0)
