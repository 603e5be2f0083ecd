"""Refined beams: masses, shear, rotary inertia and the tip's rigid end, against closed forms."""

import dataclasses
import itertools

import numpy as np
import pytest
from scipy.linalg import eigh

import hcm
from hcm.assumptions import NEEDS, Assumptions
from hcm.beam.customized_mass import customized
from hcm.beam.energy import energies
from hcm.beam.refinement import beams_of, moments
from hcm.flight.rigid_chain import build_rods, rates
from hcm.model import fill_rigid_motion
from tests.hcm.cases import refined, timoshenko, transverse

R, L, E, RHO, NU = 0.0075, 0.04, 1e9, 1400.0, 0.4
KAPPA = 6 * (1 + NU) ** 2 / (7 + 12 * NU + 4 * NU**2)
AREA, INERTIA, SHEAR = np.pi * R**2, np.pi * R**4 / 4, E / (2 * (1 + NU))
SWITCHES = [field.name for field in dataclasses.fields(Assumptions)[1:]]
MASSES = ("rotary_inertia", "half_ball", "lowest_point", "shear")


def phalanx(elements: int = 4, length: float = L) -> hcm.Phalanx:
    return hcm.Phalanx(length, 2 * R, E, RHO, elements, poisson_ratio=NU)


@pytest.mark.parametrize("elements", [1, 2, 7])
def test_a_cantilever_is_timoshenkos(elements: int) -> None:
    """Exact at the nodes: w = P L^3/(3 E I) + P L/(kappa G A), section's angle P L^2/(2 E I)."""
    chain = refined(hcm.Finger((phalanx(elements),)), Assumptions(shear=True))
    stiffness, _ = transverse(chain)
    load = np.zeros(len(stiffness))
    load[-2] = 1.0
    deflection, angle = np.linalg.solve(stiffness[2:, 2:], load[2:])[-2:]
    assert angle == pytest.approx(L**2 / (2 * E * INERTIA), rel=1e-11)
    expected = L**3 / (3 * E * INERTIA) + L / (KAPPA * SHEAR * AREA)
    assert deflection == pytest.approx(expected, rel=1e-11)


def test_frequencies_of_a_hinged_beam_are_timoshenkos() -> None:
    """w^2 of k = n pi/L, sine shapes between hinges.

    Shear is constant in an element, so that its share s/(1 + s), s = k^2 E I/(kappa G A), of the
    deflection is inertia on straight lines, whose w^2 is (k l)^2/12 too large; rotary inertia takes
    a little of that.
    """
    line, turning, soft = RHO * AREA, RHO * INERTIA, KAPPA * SHEAR * AREA
    wanted = [timoshenko(n * np.pi / L, E * INERTIA, line, turning, 1.0 / soft) for n in (1, 2, 3)]
    errors = []
    share = (np.pi / L) ** 2 * E * INERTIA / soft
    for elements in (16, 32, 64):
        both = Assumptions(shear=True, rotary_inertia=True)
        stiffness, mass = transverse(refined(hcm.Finger((phalanx(elements),)), both))
        free = [i for i in range(len(mass)) if i not in (0, len(mass) - 2)]
        found = eigh(stiffness[np.ix_(free, free)], mass[np.ix_(free, free)])[0][:3]
        errors.append(found / wanted - 1)
        line_error = share / (1 + share) * (np.pi / elements) ** 2 / 12
        assert 0.8 * line_error < errors[-1][0] < line_error
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.abs(orders - 2).max() < 0.05


def test_the_whole_phalanx_has_a_cylinders_and_a_half_balls_moments() -> None:
    """m_b = 2/3 pi rho R^3, its centre 3R/8 beyond the ball's, J_b = 83/320 m_b R^2 about it;
    of the cylinder J = m (l^2/12 + R^2/4).
    """
    on = Assumptions(rotary_inertia=True, half_ball=True)
    mass, first, second = moments(hcm.Finger((phalanx(), phalanx())), on)[:, 1]
    rod, ball = RHO * AREA * (L - R), 2 / 3 * np.pi * RHO * R**3
    centre = L - R + 3 / 8 * R
    assert mass == pytest.approx(rod + ball, rel=1e-13)
    assert first * mass * L == pytest.approx(rod * (L - R) / 2 + ball * centre, rel=1e-13)
    inertia = rod * ((L - R) ** 2 / 3 + R**2 / 4) + ball * (centre**2 + 83 / 320 * R**2)
    assert second * mass * L**2 == pytest.approx(inertia, rel=1e-13)
    plain = moments(hcm.Finger((phalanx(), phalanx())), on)[:, 0]
    assert plain[1] == pytest.approx(0.5, rel=1e-13)
    assert plain[2] == pytest.approx(1 / 3 + (R / L) ** 2 / 4, rel=1e-13)


@pytest.mark.parametrize("chosen", itertools.product([False, True], repeat=len(MASSES)))
def test_beams_that_move_rigidly_are_the_rods(chosen: tuple[bool, ...]) -> None:
    """Same kinetic energy and weight in flight and in contact, whatever is switched on, and
    wherever in an element a half-ball begins.
    """
    assumptions = Assumptions(**dict(zip(MASSES, chosen, strict=True)))
    body = hcm.Finger((phalanx(), phalanx(5)))
    chain, beams = refined(body, assumptions), beams_of(body, assumptions)
    q, v = np.zeros((2, chain.scale.size))
    state = np.array([0.3, 0.7, 2.0, 5.0])
    lengths = np.array([p.length for p in beams.phalanges])
    fill_rigid_motion(state, lengths, chain, q, v)
    kinetic, strain, gravity = energies(q, v, chain)
    keeps_time = customized(chain, body, assumptions)
    assert energies(q, v, keeps_time)[0] == pytest.approx(kinetic, rel=1e-13)
    mass, first, second = moments(body, assumptions)
    speed, arm = lengths[0] * 2.0, first[1] * mass[1] * lengths[1]
    wanted = 0.5 * second[0] * mass[0] * speed**2 + 0.5 * mass[1] * speed**2
    wanted += 0.5 * second[1] * mass[1] * lengths[1] ** 2 * 25.0 + arm * 5.0 * speed * np.cos(0.4)
    assert kinetic == pytest.approx(wanted, rel=1e-12)
    assert abs(strain) < 1e-15 * E * AREA * L
    fall = -9.8 * (first[0] * mass[0] + mass[1]) * lengths[0] * np.sin(0.3)
    assert gravity == pytest.approx(fall - 9.8 * arm * np.sin(0.7), rel=1e-12)
    for e in range(chain.first.size):
        assert np.linalg.eigvalsh(chain.mass[e]).min() > 0
        assert np.linalg.eigvalsh(keeps_time.mass[e]).min() > 0


def test_a_round_bar_falls_as_a_compound_pendulum() -> None:
    """theta.. = g S cos(theta)/J of one phalanx about the hinge."""
    body, on = hcm.Finger((phalanx(),)), Assumptions("refined")
    rods = build_rods(body, hcm.Surface(0.03, 0.5), hcm.Drive(), on)[0]
    out, length = np.empty(2), L - R
    rates(0.0, np.array([0.4, 3.0]), rods, out)
    mass, first, second = moments(body, on)[:, 0]
    assert out == pytest.approx([3.0, 9.8 * first * np.cos(0.4) / (second * length)], rel=1e-12)
    assert rods.height == 0.03 - R
    assert mass < RHO * AREA * L


@pytest.mark.parametrize(("switch", "other"), NEEDS)
def test_an_assumption_that_needs_another_is_refused(switch: str, other: str) -> None:
    with pytest.raises(hcm.ParameterError, match=f"{switch} = true: needs {other} = true"):
        Assumptions(**{"hertz": True, "lowest_point": True,
            "tip_compliance": other == "deforming_tip", switch: True, other: False})  # fmt: skip


def test_switches_follow_the_assumptions_unless_they_are_given() -> None:
    assert not Assumptions().any
    assert all(Assumptions("refined").has(name) for name in SWITCHES)
    assert not Assumptions("refined", shear=False).has("shear")
    assert [n for n in SWITCHES if Assumptions(hertz=True).has(n)] == ["hertz"]


def test_a_missing_ratio_and_a_short_tip_are_refused() -> None:
    bare = dataclasses.replace(phalanx(), poisson_ratio=None)
    with pytest.raises(hcm.ParameterError, match="poisson_ratio = None"):
        beams_of(hcm.Finger((bare,)), Assumptions("refined"))
    with pytest.raises(hcm.ParameterError, match="longer than its round end"):
        beams_of(hcm.Finger((phalanx(length=R),)), Assumptions(half_ball=True))
