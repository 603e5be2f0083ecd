"""The search for the first event: double crossings, grazing, re-arming, chatter."""

import numpy as np
import pytest

from hcm.contact.law import COMPRESSION, STICK, ContactLaw, ContactState
from hcm.integrators.event_search import dip_below, zero_of_cubic
from hcm.reference_solution import ChainStart
from tests.hcm.cases import SOFT_TIP, integrate, point_mass

MASS, K = 0.01, SOFT_TIP.normal_stiffness
PULL = 1e4  # m/s^2, turns the mass round like a bounce


def grazing(depth: float, step: float, law: ContactLaw | None = None):
    """Parabola Y = -depth + PULL (t - 1 ms)^2/2 over the surface Y = 0: constant acceleration."""
    height = 0.5 * PULL * 1e-6 - depth
    chain, start = point_mass(MASS, (0.0, height), (0.5, -PULL * 1e-3), force=(0.0, MASS * PULL))
    return integrate(chain, law or ContactLaw(K, 1.0, 0.75, 0.5, 0.0), start, step, end_time=2e-3)


@pytest.mark.parametrize("step", [3e-4, 7e-4])
@pytest.mark.parametrize("depth", [1e-4, 1e-6, 1e-9])
def test_double_crossing_inside_a_step(depth: float, step: float) -> None:
    """Down and up again within one step: both ends of the step are above the surface."""
    run = grazing(depth, step)
    touch = 1e-3 - np.sqrt(2 * depth / PULL)
    # the method is exact for constant acceleration
    assert run.time_of("contact") == pytest.approx(touch, abs=1e-12)
    # it touches once and leaves once, whatever happens in between
    assert run.kinds().count("contact") == 1
    assert run.kinds().count("separation") == 1


@pytest.mark.parametrize("step", [3e-4, 7e-4, 1e-5])
def test_a_miss_is_no_contact(step: float) -> None:
    assert grazing(-1e-9, step).kinds() == []


def test_dip_of_a_cubic() -> None:
    """p = (t - 0.4)^2 - d over (0, 1): its minimum -d lies at 0.4."""
    g0, g1 = 0.16, 0.36
    assert dip_below(0.0, 1.0, g0 - 0.01, -0.8, g1 - 0.01, 1.2) == pytest.approx(0.4, rel=1e-12)
    assert dip_below(0.0, 1.0, g0 + 0.01, -0.8, g1 + 0.01, 1.2) == 0.0
    # a dip before a top: p' = -(t - 0.2) (t - 0.8), from rates of one sign or of none
    a, b, c = -1 / 3, 0.5, -0.16
    for begin in (0.0, 0.2, -0.1):
        g0, g1 = (0.02 + t * (c + t * (b + t * a)) for t in (begin, 1.0))
        d0, d1 = (c + t * (2 * b + 3 * t * a) for t in (begin, 1.0))
        found = dip_below(0.01, 1.0 - begin, g0, d0, g1, d1)
        assert found == pytest.approx(0.2 - begin if begin < 0.2 else 0.0, rel=1e-12)
    # from rest at a top: p = 1 - t^2 + t^3 - d
    for d, wanted in ((0.9, 2 / 3), (0.84, 0.0)):
        assert dip_below(0.0, 1.2, 1 - d, 0.0, 1.288 - d, 1.92) == pytest.approx(wanted, rel=1e-12)
    # a genuine cubic with a step other than 1: p = t^3 - t + 0.3 has its minimum at 1/sqrt(3)
    h = 0.9
    found = dip_below(0.0, h, 0.3, -1.0, h**3 - h + 0.3, 3 * h * h - 1)
    assert found == pytest.approx(1 / np.sqrt(3), rel=1e-12)


def test_zero_of_a_cubic() -> None:
    """p = t^3 - t + 0.3 falls through zero once in (0, 0.5)."""
    h = 0.5
    zero = min(root.real for root in np.roots([1, 0, -1, 0.3]) if 0 < root.real < h)
    found = zero_of_cubic(h, 0.3, -1.0, h**3 - h + 0.3, 3 * h * h - 1)
    assert found == pytest.approx(zero, rel=1e-12)
    # flat at its start: Newton's method leaves the bracket there
    assert zero_of_cubic(1.0, 1e-9, 0.0, 1e-9 - 1, -3.0) == pytest.approx(1e-3, rel=1e-9)


def test_no_event_fires_twice() -> None:
    """Bounces under gravity: each tap gives its three events once, at rising times."""
    gravity, drop = 1e4, 1e-3
    chain, start = point_mass(MASS, (0.0, drop), (0.0, 0.0), force=(0.0, -MASS * gravity))
    law = ContactLaw(K, 1.0, 0.75, 0.0, 0.0)
    run = integrate(chain, law, start, 1e-6, taps=4)
    tap = ["contact", "compression_to_restitution", "separation"]
    assert run.kinds() == tap * 4
    times = np.array([e.time_s for e in run.events])
    assert np.diff(times).min() > 1e-5
    # contact pulls the period: drop sqrt(2 h/g), then arcs of 2 v/g plus equal contacts
    fall, speed = np.sqrt(2 * drop / gravity), np.sqrt(2 * drop * gravity)
    assert times[0] == pytest.approx(fall, rel=1e-9)
    flights = times[3::3] - times[2:-1:3]
    np.testing.assert_allclose(flights, 2 * speed / gravity, rtol=1e-4)
    # a cubic misses the event of so short a step by round-off: one trial past it, or one before too
    assert run.totals.trials <= 2 * len(run.events)


def test_bounces_that_die_out_are_passed() -> None:
    """e* = 0.5 under a constant force: each bounce takes half the speed and a deeper residual.

    Below g sqrt(m/k) the mass hops on the spot: dozens of taps, each with its three events and
    the share 1 - e*^2 of its compression's work lost; the audit closes through all of them.
    """
    gravity, drop = 1e4, 1e-3
    chain, start = point_mass(MASS, (0.0, drop), (0.1, 0.0), force=(0.0, -MASS * gravity))
    law = ContactLaw(K, 0.5, 0.75, 0.3, 0.0)
    run = integrate(chain, law, start, 1e-6, taps=1000, end_time=8e-3, rows=60_000)
    assert run.totals.time == pytest.approx(8e-3, rel=1e-9)
    assert np.isfinite(run.table).all()
    kinds = run.kinds()
    assert kinds.count("separation") > 10
    assert abs(kinds.count("contact") - kinds.count("separation")) <= 1
    held = sum(run[c] for c in ("kinetic", "strain", "gravity", "contact_energy"))
    balance = held + run["restitution_loss"] + run["friction_loss"] - held[0]
    # second order: (h w)^2 = 8e-5 of the energy
    assert np.abs(balance).max() < 1e-4 * MASS * gravity * drop
    assert np.diff(run["restitution_loss"]).min() >= 0
    assert np.diff(run["friction_loss"]).min() >= -1e-15


def test_chatter_is_passed() -> None:
    """On the edge of the cone for ever: F_t = mu F_n to one rounding."""
    weight, mu = 10.0, 0.5
    depth, stretch = -weight / K, mu * weight / (0.75 * K)
    chain, start = point_mass(
        MASS, (stretch, depth), (0.0, 0.0), force=(mu * weight * (1 + 1e-15), -weight)
    )
    edge = ContactState(COMPRESSION, STICK, 0.0, 0.0, 0.0, 0.0)
    start = ChainStart(start.coordinates, start.velocities, 0.0, edge)
    run = integrate(chain, ContactLaw(K, 1.0, 0.75, mu, 0.0), start, 1e-6, end_time=1e-3)
    assert run.totals.time == pytest.approx(1e-3, rel=1e-9)
    assert abs(run.motion.q[4] - stretch) < 1e-12
