"""The neo-Hookean hexahedron against mathematics: tension, crushing, small strains, damping."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from reference_fem.elements.kinds import hex8, hex8_neo_hooke
from reference_fem.stable_step import stable_step
from tests.reference_fem.elements.bodies import (
    POISSON,
    SIZE,
    YOUNG,
    force,
    grid,
    material,
    neo_hooke,
    rotation,
    tangent,
)

MU = YOUNG / (2 * (1 + POISSON))
LAME = 2 * MU * POISSON / (1 - 2 * POISSON)


@pytest.mark.parametrize("stretch", [0.4, 0.8, 1.2, 3.0])
def test_uniaxial_tension(stretch: float) -> None:
    """Lateral stretch b of no lateral stress: mu (b^2 - 1) + lambda (J^2 - 1)/2 = 0, J = a b^2."""
    points, cells = grid(4, 2, 2)
    k = neo_hooke(points, cells)
    square = brentq(lambda b: MU * (b - 1) + LAME * ((stretch * b) ** 2 - 1) / 2, 0.01, 10)
    volume = stretch * square
    u = points * (np.array([stretch, math.sqrt(square), math.sqrt(square)]) - 1)
    axial = (MU * (stretch**2 - 1) + LAME * (volume**2 - 1) / 2) / volume
    f = force(k, u)
    face = points[:, 0] > points[:, 0].max() - 1e-9
    assert f[face, 0].sum() == pytest.approx(axial * 4 * SIZE**2 * square, rel=1e-11)
    assert np.abs(f[:, 1:]).max() < 1e-10 * np.abs(f).max()
    assert k.cell_stress(u)[0] == pytest.approx([axial, 0, 0, 0, 0, 0], abs=1e-10 * abs(axial))


def test_crushed_it_stiffens_where_the_other_law_softens() -> None:
    """Confined to 0.9, 0.5 and 0.1 of its length: P = (mu + lambda/2) (a - 1/a)."""
    points, cells = grid(1, 1, 1)
    k, other = neo_hooke(points, cells), hex8(points, cells, *material(1))
    stretches = np.array([0.9, 0.5, 0.1])

    def pushed(of: object) -> np.ndarray:
        moves = [points * [a - 1, 0, 0] for a in stretches]
        return np.array([force(of, u)[points[:, 0] > 0, 0].sum() for u in moves])

    exact = (MU + LAME / 2) * (stretches - 1 / stretches) * SIZE**2
    assert pushed(k) == pytest.approx(exact, rel=1e-11)
    assert (np.diff(pushed(k)) < 0).all()
    assert pushed(other)[2] > pushed(other)[1]  # a St. Venant-Kirchhoff body pushes back less


def test_small_strains_follow_hookes_law() -> None:
    points, cells = grid(2, 2, 1, distortion=0.15)
    ours, hookes = (of(points, cells, *material(4)) for of in (hex8_neo_hooke, hex8))
    stiffness = tangent(hookes, points)
    assert np.abs(tangent(ours, points) - stiffness).max() < 1e-6 * np.abs(stiffness).max()
    assert np.array_equal(ours.lumped_mass, hookes.lumped_mass)


@pytest.mark.parametrize("poisson", [0.3, 0.49])
def test_damping_takes_what_the_viscous_stress_does(poisson: float) -> None:
    """The added force is linear in tau and v, its power -f.v, and a turning body has none."""
    points, cells = grid(3, 2, 2, distortion=0.15)
    given, tau = material(len(cells), poisson), np.full(len(cells), 1e-6)
    rng = np.random.default_rng(2)
    u, v = 0.05 * SIZE * rng.standard_normal((2, *points.shape))
    v *= 1e3
    elastic = hex8_neo_hooke(points, cells, *given)
    ours, hookes = (of(points, cells, *given, tau) for of in (hex8_neo_hooke, hex8))
    hooke = hex8(points, cells, *given)
    out = np.empty_like(u)
    found = ours.force(u, out, (v, 0.0), audited=True)
    added = out - force(elastic, u)
    assert found.stored == pytest.approx(elastic.energies(u)[0], rel=1e-12)
    assert found.power == pytest.approx(np.sum(added * v), rel=1e-11)
    assert found.power > 0.0
    # the other law's damping is the same
    theirs = hookes.force(u, out, (v, 0.0))
    assert found.power == pytest.approx(theirs.power, rel=1e-11)
    assert added == pytest.approx(out - force(hooke, u), abs=1e-11 * np.abs(out).max())
    turning = np.cross([300.0, -200.0, 100.0], points + u)
    assert ours.force(u, out, (turning, 0.0)).power < 1e-20 * found.power


def test_a_step_of_a_turn_is_not_damped() -> None:
    """Over a step of twice the lag rates are differences of strains, here those of two postures.

    At rates without the lag a turn by an angle a has strains of (a/2)^2 a step.
    """
    points, cells = grid(3, 2, 2, distortion=0.15)
    ours = hex8_neo_hooke(points, cells, *material(len(cells)), np.full(len(cells), 1e-6))
    step, out = 1e-3, np.empty_like(points)
    before, after = (points @ rotation(angle).T - points for angle in (0.3, 0.7))
    v = (after - before) / step
    late, now = (ours.force(after, out, (v, lag)).power for lag in (0.5 * step, 0.0))
    assert 0.0 <= late < 1e-20 * now  # round-off of E' is 1e-15 of it, its square in the power


def test_stresses_of_chosen_cells_are_those_of_their_own_material() -> None:
    points, cells = grid(3, 1, 1, distortion=0.15)
    young, *others = material(3)
    k = hex8_neo_hooke(points, cells, young * [1.0, 2.0, 3.0], *others)
    u = 0.05 * SIZE * np.random.default_rng(3).standard_normal(points.shape)
    chosen = np.array([2, 0])
    assert np.array_equal(k.cell_stress(u, chosen), k.cell_stress(u)[chosen])


def test_its_steps_are_half_as_long() -> None:
    """Thinned to a half its highest frequency is up to twice that at rest."""
    points, cells = grid(3, 2, 2)
    none = np.empty(0, dtype=np.int64)
    ours, hookes = (
        stable_step(k, none, np.empty(0), none)
        for k in (neo_hooke(points, cells), hex8(points, cells, *material(len(cells))))
    )
    assert ours == pytest.approx(0.5 * hookes, rel=1e-5)  # forces are linear to 1e-6
