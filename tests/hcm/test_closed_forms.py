"""Located events against systems whose event times can be written down."""

import numpy as np
import pytest

from hcm.contact.law import COMPRESSION, FREE, SLIP, ContactLaw, ContactState
from hcm.reference_solution import ChainStart, solve_chain
from tests.hcm.cases import integrate, order_of, point_mass
from tests.hcm.closed_forms import block_on_belt, oblique_impact

MASS, K = 0.01, 0.78e6
OMEGA = np.sqrt(K / MASS)
STEPS = np.array([2e-6, 1e-6, 5e-7])


@pytest.mark.parametrize("restitution", [0.4, 0.8, 1.0])
def test_mass_on_the_bilinear_spring(restitution: float) -> None:
    """Separation at pi/(2 w) (1 + e*), rebound -e* v, impulse m v (1 + e*), peak v sqrt(k m)."""
    speed, law = 1.6, ContactLaw(K, restitution, 0.75, 0.0, 0.0)
    chain, start = point_mass(MASS, (0.0, 0.0), (0.3, -speed))
    truth = solve_chain(chain, law, start, 1e-12, 1e-16)
    end = np.pi / (2 * OMEGA) * (1 + restitution)
    turn = truth.time_of("compression_to_restitution")
    assert turn == pytest.approx(np.pi / (2 * OMEGA), rel=1e-12)
    assert truth.time_of("separation") == pytest.approx(end, rel=1e-12)
    assert truth.peak_normal_force_N == pytest.approx(speed * np.sqrt(K * MASS), rel=1e-10)
    assert truth.normal_impulse_N_s == pytest.approx(MASS * speed * (1 + restitution), rel=1e-10)
    runs = [integrate(chain, law, start, h) for h in STEPS]
    errors = [abs(run.time_of("separation") - end) for run in runs]
    assert order_of(STEPS, errors) > 1.9
    # the method lengthens a period by about (h w)^2/12; w grows to w/e* while restituting
    assert errors[-1] < (STEPS[-1] * OMEGA / restitution) ** 2 / 6 * end
    final = runs[-1]
    assert final.motion.v[5] == pytest.approx(restitution * speed, rel=1e-5)
    assert final.motion.v[4] == 0.3  # no friction, no tangential force
    impulse = np.trapezoid(final["normal_force"], final["time"])
    assert impulse == pytest.approx(MASS * speed * (1 + restitution), rel=1e-5)
    lost = 0.5 * MASS * speed**2 * (1 - restitution**2)
    assert final["restitution_loss"][-1] == pytest.approx(lost, rel=1e-5)


# (eta^-2, mu, V_t) for V_n = -1: stick first, slip throughout, slip -> stick -> reverse slip ...
OBLIQUE = [
    *((0.75, 0.5, vt) for vt in (0.3, 0.6, 1.6, -1.0)),
    *((0.75, 1.2, 1.0), (0.3, 0.5, 0.8), (0.75, 0.1, 0.05), (1.5, 0.5, 0.4)),
]


@pytest.mark.parametrize("restitution", [0.6, 1.0])
@pytest.mark.parametrize(("ratio", "mu", "vt"), OBLIQUE)
def test_oblique_impact(ratio: float, mu: float, vt: float, restitution: float) -> None:
    """Stronge's oblique impact with tangential compliance (Maw, Barber and Fawcett's regimes)."""
    exact = oblique_impact(MASS, K, restitution, ratio, mu, vt, -1.0)
    kinds = [kind for _, kind in exact.events]
    times = np.array([time for time, _ in exact.events])
    chain, start = point_mass(MASS, (0.0, 0.0), (vt, -1.0))
    law = ContactLaw(K, restitution, ratio, mu, 0.0)
    truth = solve_chain(chain, law, start, 1e-11, 1e-16)
    assert [e.kind for e in truth.events] == kinds
    # the largest error measured is 1.1e-14 s
    assert np.abs([e.time_s for e in truth.events] - times).max() < 1e-13
    np.testing.assert_allclose(truth.end.velocities[4:6], exact.velocity, atol=1e-9)
    errors = []
    for h in STEPS:
        run = integrate(chain, law, start, h)
        assert run.kinds() == kinds
        errors.append(np.abs([e.time_s for e in run.events] - times).max())
    assert order_of(STEPS, errors) > 1.9
    np.testing.assert_allclose(run.motion.v[4:6], exact.velocity, atol=2e-5)


def test_reverse_slip() -> None:
    """Slip forward, stick, and slip back before separation: the spring returns its pull."""
    chain, start = point_mass(MASS, (0.0, 0.0), (0.4, -1.0))
    run = integrate(chain, ContactLaw(K, 1.0, 1.5, 0.5, 0.0), start, 1e-6)
    particle = run["particle_velocity"]
    assert particle.max() > 0.01
    assert particle.min() < -0.01
    assert run["tangential_force"].min() < 0 < run["tangential_force"].max()


def test_an_event_that_starts_at_zero_and_comes_back_within_a_step() -> None:
    """Stick begins at touch with F_t = F_n = 0 and ends inside the same step: its function rises
    from zero and falls back; it must fire at the return, not at once."""
    ratio, mu, vt = 0.75, 0.5, 0.66666  # the cone's edge is at 2/3
    exact = oblique_impact(MASS, K, 1.0, ratio, mu, vt, -1.0)
    slip = exact.events[1]
    assert slip[1] == "stick_to_slip"
    step = 4e-6
    assert 0.1 * step < slip[0] < 0.9 * step
    chain, start = point_mass(MASS, (0.0, 0.0), (vt, -1.0))
    run = integrate(chain, ContactLaw(K, 1.0, ratio, mu, 0.0), start, step)
    assert run.kinds() == [kind for _, kind in exact.events]
    # g rises and falls with (h w)^2 of mu F_n, as small as the method's own error in it
    assert 0 < run.time_of("stick_to_slip") < step
    exact_truth = solve_chain(chain, ContactLaw(K, 1.0, ratio, mu, 0.0), start, 1e-12, 1e-18)
    assert exact_truth.time_of("stick_to_slip") == pytest.approx(slip[0], rel=1e-4)


def test_simultaneous_events() -> None:
    """V_P and v_n vanish in the same instant: V_t = mu |V_n| with eta^2 < 1."""
    exact = oblique_impact(MASS, K, 1.0, 1.5, 0.5, 0.5, -1.0)
    chain, start = point_mass(MASS, (0.0, 0.0), (0.5, -1.0))
    run = integrate(chain, ContactLaw(K, 1.0, 1.5, 0.5, 0.0), start, 5e-7)
    assert sorted(run.kinds()) == sorted(kind for _, kind in exact.events)
    turn, stick = run.time_of("compression_to_restitution"), run.time_of("slip_to_stick")
    assert abs(turn - stick) < 1e-12
    assert np.diff(run["time"]).min() >= 0
    np.testing.assert_allclose(run.motion.v[4:6], exact.velocity, atol=1e-5)
    # round-off decides which comes first, and may add a pair or two within its reach
    truth = solve_chain(chain, ContactLaw(K, 1.0, 1.5, 0.5, 0.0), start, 1e-11, 1e-16)
    assert len(truth.events) < 20
    np.testing.assert_allclose(truth.end.velocities[4:6], exact.velocity, atol=1e-9)


def belt_case(step: float):
    """A block of 10 N that runs ahead of its belt is caught, carried along, and torn off again."""
    spring, belt, weight, mu, ratio = 2e4, 0.2, 10.0, 0.5, 0.75
    exact = block_on_belt(MASS, spring, ratio * K, mu * weight, belt, 0.05, 3e-3)
    # the spring acts upwards too: with the anchor at the block's depth it carries nothing there
    depth = -weight / K
    chain, start = point_mass(
        MASS, (0.0, depth), (0.05, 0.0), force=(0.0, -weight), spring=spring,
        anchor=(0.0, depth), anchor_velocity=(-belt, 0.0),
    )  # fmt: skip
    slipping = ContactState(COMPRESSION, SLIP, 1.0, 0.0, 0.0, 0.0)
    start = ChainStart(start.coordinates, start.velocities, 0.0, slipping)
    return exact, integrate(chain, ContactLaw(K, 1.0, ratio, mu, 0.0), start, step, end_time=3e-3)


def tangential(events) -> list[tuple[float, str]]:
    """Without the turns of a block at rest, whose v_n is round-off."""
    return [(e.time_s, e.kind) for e in events if "stick" in e.kind]


def test_block_on_a_belt() -> None:
    errors = []
    for h in STEPS:
        exact, run = belt_case(h)
        assert [kind for _, kind in exact.events] == ["slip_to_stick", "stick_to_slip"] * 2
        found = tangential(run.events)
        assert [kind for _, kind in found] == [kind for _, kind in exact.events]
        errors.append(max(abs(a[0] - b[0]) for a, b in zip(found, exact.events, strict=True)))
    assert order_of(STEPS, errors) > 1.9


def test_a_block_at_rest_stays_at_rest() -> None:
    """v_n is round-off throughout: its sign must not grind the run to a halt."""
    depth = -10.0 / K
    chain, start = point_mass(MASS, (0.0, depth), (0.0, 0.0), force=(0.0, -10.0))
    resting = ContactState(COMPRESSION, FREE, 0.0, 0.0, 0.0, 0.0)
    start = ChainStart(start.coordinates, start.velocities, 0.0, resting)
    for restitution in (1.0, 0.5):
        law = ContactLaw(K, restitution, 0.75, 0.0, 0.0)
        run = integrate(chain, law, start, 1e-6, end_time=1e-3)
        assert run.totals.time == pytest.approx(1e-3, rel=1e-9)
        assert len(run.table) < 12_000
        assert abs(run.motion.q[5] - depth) < 1e-15
