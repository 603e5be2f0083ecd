"""Motion without contact: waves in a bar, a pendulum, momentum and energy of a falling chain."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

import hcm
from hcm.beam.chain import build_chain
from hcm.reference_solution import ChainStart
from tests.hcm.cases import (
    HARD,
    NOWHERE,
    SOFT,
    SOFT_LAW,
    SOFT_TIP,
    SURFACE,
    finger,
    integrate,
    straight_links,
)

G = 9.8


# The curvature |r''| counts the stretch's gradient too, so axial waves are dispersed over the
# section's radius of gyration d/4 (3.75 mm for the finger's bar: no sharp front in 40 mm). The
# classical bar is the limit of small d; its impedance scales with d^2.
THIN = 1.5e-4
IMPEDANCE = 209.09 * (THIN / SOFT.diameter) ** 2


@pytest.fixture(scope="module")
def pulled_bar():
    """A thin soft phalanx, hinge held, pulled at its tip along the axis by 1e-4 N from t = 0."""
    bar = replace(SOFT, diameter=THIN, elements=80)
    chain, rest = build_chain(hcm.Finger((bar,)), hcm.Drive((), 0.0))
    weight = np.zeros(rest.size)
    weight[chain.tip] = -1e-4
    chain = chain._replace(weight=weight)
    return integrate(chain, NOWHERE, ChainStart(rest, np.zeros(rest.size)), 5e-8, end_time=1.6e-4)


def test_impedance_of_a_bar(pulled_bar) -> None:
    """F/v = A sqrt(E rho), 209.09 N s/m at 15 mm, until the held end's echo arrives at 2L/c."""
    plateau = (pulled_bar["time"] > 1e-5) & (pulled_bar["time"] < 9e-5)
    # the loaded node rings at the mesh's highest frequency, which the mean takes out
    speed = -pulled_bar["tip_vx"][plateau].mean()
    assert 1e-4 / speed == pytest.approx(IMPEDANCE, rel=1e-3)


def test_wave_arrives_at_the_held_end(pulled_bar) -> None:
    """The held end's reaction jumps from 0 to 2F at L/c = 47.33 us."""
    time, reaction = pulled_bar["time"], -pulled_bar.reactions[:, 0] / 1e-4
    # the front is smeared over about two elements, 0.6 us each
    assert time[np.argmax(reaction > 1)] == pytest.approx(47.33e-6, abs=1.2e-6)
    late = (time > 6e-5) & (time < 1.3e-4)
    assert reaction[late].mean() == pytest.approx(2.0, rel=5e-3)


def test_echo_of_the_held_end_turns_the_tip(pulled_bar) -> None:
    """At 2L/c = 94.66 us the pulled tip's velocity changes from v to -v."""
    later = pulled_bar["time"] > 8e-5
    time, speed = pulled_bar["time"][later], -pulled_bar["tip_vx"][later]
    assert time[np.argmax(speed < 0)] == pytest.approx(94.66e-6, abs=1.2e-6)
    after = (time > 1.1e-4) & (time < 1.5e-4)
    assert speed[after].mean() == pytest.approx(-1e-4 / IMPEDANCE, rel=5e-3)


@pytest.fixture(scope="module")
def pendulum() -> hcm.TapResult:
    """One phalanx of 20,000 times steel's class; xi = 0 damps the vibration of the release."""
    stiff = replace(HARD, youngs_modulus=1e13, elements=2)
    settings = hcm.Settings(
        flight_step=2e-5, flight_tolerance=0.0, spectral_radius=0.0, contact_step=1e-8
    )
    return hcm.simulate(
        hcm.Finger((stiff,)), hcm.Surface(0.03, 0.0), SOFT_TIP, hcm.Drive((), G), settings
    )


def test_fall_of_a_rod(pendulum: hcm.TapResult) -> None:
    """t = sqrt(L/3g) int_0^theta dt/sqrt(sin t), an incomplete elliptic integral; v^2 = 3 g H."""
    length, height = HARD.length, 0.03
    angle = np.arcsin(height / length)
    # with t = s^2 the integrand is regular at the horizontal
    integral = quad(lambda s: 2 * s / np.sqrt(np.sin(s * s)) if s else 2.0, 0, np.sqrt(angle))[0]
    speed = np.hypot(*pendulum.summary.tip_velocity_at_contact_m_per_s)
    # step 2e-5 s of a fall of 69 ms: second order leaves 1e-7; bending at 1e13 Pa less
    assert pendulum.summary.contact_time_s == pytest.approx(
        np.sqrt(length / (3 * G)) * integral, rel=2e-6
    )
    assert speed == pytest.approx(np.sqrt(3 * G * height), rel=2e-6)


def test_reaction_of_a_rod(pendulum: hcm.TapResult) -> None:
    """Rod at angle t below the horizontal: 5/2 m g sin t along it, 1/4 m g cos t across."""
    history = pendulum.history
    flight = (history.time_s > 0.02) & (history.time_s < pendulum.summary.contact_time_s)
    sine = -history.tip_position_m[flight, 1] / HARD.length
    cosine = np.sqrt(1 - sine**2)
    weight = HARD.density * HARD.area * HARD.length * G
    along = 2.5 * weight * sine
    across = 0.25 * weight * cosine
    # the rod points along (-cos, -sin); the hinge pulls it back along its axis, and holds it up
    expected = np.column_stack([along * cosine - across * sine, along * sine + across * cosine])
    error = np.abs(history.hinge_reactions_N[flight, 0] - expected).max()
    assert error < 1e-4 * weight


def impulse_of(run, column: np.ndarray) -> float:
    return float(np.trapezoid(column, run["time"]))


@pytest.fixture(scope="module")
def struck_chain():
    """Three soft links that turn and strike the surface, without gravity."""
    body = finger(SOFT, elements=3)
    chain, start = straight_links(body, drive=hcm.Drive((), 0.0))
    run = integrate(chain, SOFT_LAW, start, 5e-8)
    return body, chain, start, run


def momenta(chain, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """(p_x, p_y, H about the origin): S q with (1, 0, 1, 0) summed, and q x M v for H."""
    total = np.zeros(3)
    for e in range(chain.first.size):
        places = chain.first[e] + np.arange(0, 4, 2), chain.second[e] + np.arange(0, 4, 2)
        index = np.concatenate(places)
        mvx, mvy = chain.mass[e] @ v[index], chain.mass[e] @ v[index + 1]
        total += [mvx[0] + mvx[2], mvy[0] + mvy[2], q[index] @ mvy - q[index + 1] @ mvx]
    return total


def test_forces_on_the_chain_add_up_to_its_momentum(struck_chain) -> None:
    """dp/dt = F_c - lam_1 and dH/dt = r_tip x F_c, through the whole contact."""
    _, chain, start, run = struck_chain
    before = momenta(chain, start.coordinates, start.velocities)
    change = momenta(chain, run.motion.q, run.motion.v) - before
    fn, ft = run["normal_force"], run["tangential_force"]
    impulses = [
        impulse_of(run, ft - run.reactions[:, 0]),
        impulse_of(run, fn - run.reactions[:, 1]),
        impulse_of(run, run["tip_x"] * fn - run["tip_y"] * ft),
    ]
    # trapezoids and steps of 5e-8 s over waves of 5 us: 1e-4 of the normal impulse and its moment
    bound = 1e-4 * impulse_of(run, fn) * np.array([1, 1, 0.1])
    assert np.all(np.abs(change - impulses) < bound)
    assert np.all(np.abs(change) > 100 * bound)


def test_inner_hinges_balance_their_links(struck_chain) -> None:
    """Each link's momentum changes by lam_(w+1) - lam_w, plus the contact on the last."""
    body, chain, start, run = struck_chain
    fn, ft = run["normal_force"], run["tangential_force"]
    contact = [impulse_of(run, ft), impulse_of(run, fn)]
    lam = [[impulse_of(run, run.reactions[:, 2 * w + c]) for c in range(2)] for w in range(3)]
    element = 0
    for w, phalanx in enumerate(body.phalanges):
        part = slice(element, element + phalanx.elements)
        link = chain._replace(
            first=chain.first[part], second=chain.second[part], mass=chain.mass[part]
        )
        before = momenta(link, start.coordinates, start.velocities)
        change = momenta(link, run.motion.q, run.motion.v) - before
        outer = contact if w == 2 else lam[w + 1]
        expected = np.array(outer) - lam[w]
        assert np.abs(change[:2] - expected).max() < 1e-4 * contact[1]
        element += phalanx.elements


def test_hinges_hold_to_round_off(struck_chain) -> None:
    _, chain, _, run = struck_chain
    q = run.motion.q
    for inner, outer in zip(chain.hinge_inner, chain.hinge_outer, strict=True):
        base = q[inner : inner + 2] if inner >= 0 else 0.0
        assert np.abs(q[outer : outer + 2] - base).max() < 1e-14


def test_energy_of_a_fall() -> None:
    """Strain energy of the release is 1e-3 of the kinetic energy and decays at worst: 1e-5 left."""
    settings = hcm.Settings(max_flight_time=0.12)
    result = hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, settings=settings)
    assert result.status is hcm.Status.NOT_REACHED
    history = result.history
    assert np.abs(history.energy_balance_J).max() < 1e-5 * history.kinetic_energy_J.max()
