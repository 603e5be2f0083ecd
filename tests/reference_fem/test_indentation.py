"""Static indentation: the contact solver on an exact half-space, the meshed tip against Hertz."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import meshes
import reference_fem as rf
from meshes.topology import structured
from reference_fem.contact.hertz import hertz_indentation, hertz_stiffness
from reference_fem.statics import indentation
from reference_fem.statics.indentation import ContactArea, contact_area, indent, mindlin_ratio
from reference_fem.statics.tip import TipCompliance, rigid_motion, tip_compliance

RADIUS = 0.0075
MATERIAL = rf.Material(1e9, 0.4, 1400.0)
SQUARE = 4.0 * math.log(1.0 + math.sqrt(2.0))  # ∫ dA/r over a unit square about its middle


Exact = tuple[TipCompliance, ContactArea]
Ball = tuple[meshes.FingerMesh, TipCompliance]


def hertz_force(contact_radius: float) -> float:
    return 4.0 / 3.0 * MATERIAL.plane_strain_modulus * contact_radius**3 / RADIUS


def half_space(contact_radius: float, cells: int) -> TipCompliance:
    """Boussinesq's and Cerruti's compliance of a grid of square patches (Johnson, ch. 3)."""
    edge = 2.6 * contact_radius
    axis = np.linspace(-0.5, 0.5, cells + 1) * edge
    x, z = (grid.ravel() for grid in np.meshgrid(axis, axis, indexing="ij"))
    h = edge / cells
    dx, dz = np.subtract.outer(x, x), np.subtract.outer(z, z)
    r = np.hypot(dx, dz)
    np.fill_diagonal(r, 1.0)
    inverse = np.where(np.eye(x.size, dtype=bool), SQUARE / h, 1.0 / r)
    along = np.where(np.eye(x.size, dtype=bool), 0.5 * SQUARE / h, dx**2 / r**3)
    across = np.where(np.eye(x.size, dtype=bool), 0.5 * SQUARE / h, dz**2 / r**3)
    mixed = dx * dz / r**3
    nu = MATERIAL.poisson_ratio
    shear = MATERIAL.youngs_modulus / (2 * (1 + nu))
    tangential = np.empty((x.size, x.size, 2, 2))
    tangential[..., 0, 0] = (1 - nu) * inverse + nu * along
    tangential[..., 1, 1] = (1 - nu) * inverse + nu * across
    tangential[..., 0, 1] = tangential[..., 1, 0] = nu * mixed
    corner = np.arange((cells + 1) ** 2).reshape(cells + 1, -1)
    facets = structured(corner)
    height = RADIUS - np.sqrt(RADIUS**2 - x**2 - z**2)
    return TipCompliance(
        nodes=np.arange(x.size),
        facets=facets,
        points=np.stack([x, z, height], axis=1),
        radius=RADIUS,
        normal=inverse / (math.pi * MATERIAL.plane_strain_modulus),
        tangential=tangential / (2 * math.pi * shear),
        held=np.zeros(x.size, dtype=bool),
        symmetry_factor=1,
        material=MATERIAL,
    )


@pytest.fixture(scope="module")
def exact() -> Exact:
    tip = half_space(4e-4, 20)
    return tip, contact_area(tip)


@pytest.mark.parametrize("share", [0.75, 1.0])
def test_half_space_gives_hertz_and_mindlin(exact: Exact, share: float) -> None:
    contact_radius = share * 4e-4
    force = hertz_force(contact_radius)
    pressed = indent(*exact, force)
    # Patches of a/8 at the largest load, a/6 at the smaller one: the edge is known to half a patch,
    # which moves areas by 5 % and the indentation, an integral over all of it, by less.
    depth = hertz_indentation(MATERIAL, RADIUS, force)
    assert pressed.indentation_m == pytest.approx(depth, rel=0.015)
    stiffness = hertz_stiffness(MATERIAL, RADIUS, force)
    assert pressed.stiffness_N_per_m == pytest.approx(stiffness, rel=0.02)
    # by a moment of the pressure, of second order: 0.9 % here, 1.6 % at the smaller load
    assert pressed.contact_radius_m == pytest.approx(contact_radius, rel=0.02)
    assert pressed.eta_squared == pytest.approx(mindlin_ratio(0.4), rel=0.02)


def test_energy_is_the_work_of_the_plane(exact: Exact) -> None:
    forces = hertz_force(4e-4) * np.linspace(0.0, 1.0, 13) ** 1.5
    curve = [indent(*exact, force) for force in forces[1:]]
    depth = np.array([0.0, *[p.indentation_m for p in curve]])
    work = float(np.trapezoid(forces, depth))
    # The trapezoid of a power of 1.5 in 12 steps is off by 2e-3, the first load by its patches.
    assert curve[-1].energy_J == pytest.approx(work, rel=5e-3)
    middle = indent(*exact, 0.5 * (forces[-1] + forces[-2]))
    slope = (forces[-1] - forces[-2]) / (depth[-1] - depth[-2])
    assert middle.normal_tangent_N_per_m == pytest.approx(slope, rel=0.02)


ANGLE = math.radians(52.0)


@pytest.fixture(scope="module")
def ball() -> Ball:
    sizing = meshes.Sizing(2.5e-3, 2.5e-3, 1e-4, contact_angle=ANGLE, growth=1.6)
    mesh = meshes.finger_hexahedra(meshes.FingerGeometry((0.015,), (0.015,)), sizing)
    return mesh, tip_compliance(mesh, MATERIAL, ANGLE, 6e-4)


@pytest.mark.parametrize("contact_radius", [3e-4, 4e-4])
def test_meshed_tip_is_hertzian(ball: Ball, contact_radius: float) -> None:
    tip = ball[1]
    force = hertz_force(contact_radius)
    pressed = indent(tip, contact_area(tip), force)
    # A section a radius away misses 2 a/(pi R) = 3 % of the half-space's indentation; a mesh with
    # three to four edges on the contact radius adds as much.
    ratio = pressed.indentation_m / hertz_indentation(MATERIAL, RADIUS, force)
    assert 0.92 < ratio < 1.01
    stiffness = pressed.stiffness_N_per_m / hertz_stiffness(MATERIAL, RADIUS, force)
    assert 0.97 < stiffness < 1.10
    # by the half-space's 0.5 (h/a)^2
    assert pressed.contact_radius_m == pytest.approx(contact_radius, rel=0.05)
    # Under tangential load the ball's own shear comes in: above Mindlin by some 10 %.
    assert 0.97 < pressed.eta_squared / mindlin_ratio(0.4) < 1.20


def test_compliance_is_inverse_to_the_modulus(
    ball: Ball,
) -> None:
    mesh, tip = ball
    stiff = tip_compliance(mesh, replace(MATERIAL, youngs_modulus=20e9), ANGLE, 6e-4)
    assert np.allclose(20 * stiff.normal, tip.normal, rtol=1e-9)
    force = hertz_force(4e-4)
    soft = indent(tip, contact_area(tip), force)
    hard = indent(stiff, contact_area(stiff), 20 * force)
    assert hard.indentation_m == pytest.approx(soft.indentation_m, rel=1e-9)
    assert hard.stiffness_N_per_m == pytest.approx(20 * soft.stiffness_N_per_m, rel=1e-9)
    assert hard.eta_squared == pytest.approx(soft.eta_squared, rel=1e-9)


def test_section_further_behind_sees_more_of_the_beam(
    ball: Ball,
) -> None:
    mesh, tip = ball
    behind = tip_compliance(mesh, MATERIAL, ANGLE, 6e-4, behind=RADIUS)
    # The held end: its motion is zero, and all that lies between the two adds compliance.
    assert np.all(behind.normal > tip.normal)
    near, far = (indent(t, contact_area(t), hertz_force(4e-4)) for t in (tip, behind))
    assert far.stiffness_N_per_m < near.stiffness_N_per_m


def test_the_shaft_is_no_sphere() -> None:
    """Its nodes were lifted to the sphere's height, which beyond its radius was no number."""
    angle = math.radians(78.0)
    sizing = meshes.Sizing(2.5e-3, 2.5e-3, 1.5e-3, contact_angle=angle)
    mesh = meshes.finger_hexahedra(meshes.FingerGeometry((0.0225,), (0.015,)), sizing)
    tip = tip_compliance(mesh, MATERIAL, angle, 1.2 * RADIUS)
    area = contact_area(tip)
    # from the ball's centre along the axis, towards the hinge
    behind = tip.points @ [math.sin(angle), 0.0, math.cos(angle)] - RADIUS * math.cos(angle)
    shaft = (behind > 1e-9 * RADIUS)[tip.facets].all(axis=1)
    assert 0 < shaft.sum() < len(shaft)
    lift = np.abs(area.heights - area.shapes @ tip.points[:, 2]).reshape(len(shaft), -1).max(axis=1)
    assert lift[shaft].max() < 1e-12 * RADIUS
    assert lift[~shaft].min() > 1e-4 * RADIUS


def test_bad_input_is_refused(ball: Ball) -> None:
    mesh, tip = ball
    area = contact_area(tip)
    for force in (0.0, -1.0, math.nan):
        with pytest.raises(ValueError, match="force"):
            indent(tip, area, force)
    with pytest.raises(ValueError, match="larger reach"):
        indent(tip, area, hertz_force(7e-4))
    with pytest.raises(ValueError, match="tip_size"):
        tip_compliance(mesh, MATERIAL, ANGLE, 1e-5)
    sizing = meshes.SIZINGS["fast"]
    plane = meshes.finger_quadrilaterals(meshes.FingerGeometry((0.04,), (0.015,)), sizing)
    with pytest.raises(ValueError, match="3D"):
        tip_compliance(plane, MATERIAL, ANGLE, 1e-3)


def test_the_penaltys_share_is_taken_off_to_first_order(monkeypatch: pytest.MonkeyPatch) -> None:
    """A hundred times the penalty changes the energy by 8e-4; without the share by 2e-2."""
    tip = half_space(4e-4, 20)
    area, energies = contact_area(tip), []
    for factor in (200.0, 20000.0):
        monkeypatch.setattr(indentation, "PENALTY", factor)
        energies.append(indent(tip, area, hertz_force(4e-4)).energy_J)
    assert energies[0] == pytest.approx(energies[1], rel=5e-3)


def test_a_half_section_moves_as_the_whole() -> None:
    """Its nodes off the plane of symmetry stand for two."""
    random = np.random.default_rng(0)
    off, moved = [3, 4, 5], random.normal(size=(6, 3))
    points = np.column_stack([np.zeros(6), random.normal(size=6), [0, 0, 0, 1, 1, 2.0]])
    mirror = points[off] * [1, 1, -1]
    half: Any = SimpleNamespace(points=points, node_sets={"symmetry": np.arange(3)})
    whole: Any = SimpleNamespace(
        points=np.vstack([points, mirror]), node_sets={"symmetry": np.arange(0)}
    )
    at = np.array([0.3, -0.4, 0.0])
    both = np.vstack([moved, moved[off]])
    assert rigid_motion(half, np.arange(6), moved, at) == pytest.approx(
        rigid_motion(whole, np.arange(9), both, at)
    )
