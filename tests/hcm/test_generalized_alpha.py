"""The integrator: order in q and lam against the truth, stability, local error, change of step."""

import numpy as np
import pytest

from hcm.assembly.state import build_motion
from hcm.contact.law import IN_FLIGHT
from hcm.integrators.generalized_alpha import change_step, initial_acceleration, local_error, step
from hcm.integrators.workspace import Integrator, coefficients, workspace
from hcm.reference_solution import solve_chain
from tests.hcm.cases import (
    NOWHERE,
    SOFT,
    SOFT_LAW,
    bordered_acceleration,
    finger,
    integrate,
    order_of,
    point_mass,
    straight_links,
)

RADII = [0.0, 0.5, 0.8, 1.0]


@pytest.fixture(scope="module")
def struck_links():
    """Three soft links of two elements that strike the surface, and their truth."""
    chain, start = straight_links(finger(SOFT, elements=2))
    return chain, SOFT_LAW, start, solve_chain(chain, SOFT_LAW, start, 1e-11, 1e-15)


@pytest.mark.parametrize("xi", RADII)
def test_order_two_in_coordinates_and_multipliers(struck_links, xi: float) -> None:
    chain, law, start, _ = struck_links
    time = 8e-5  # in contact, before the first reversal
    exact = solve_chain(chain, law, start, 1e-11, 1e-15, end_time=time).end
    state = exact.coordinates, exact.velocities
    acceleration = bordered_acceleration(*state, chain, exact.contact, law)
    multiplier = np.zeros(chain.scale.size, dtype=bool)
    multiplier[np.add.outer(chain.hinge, [0, 1])] = True
    steps, errors = np.array([1e-7, 5e-8, 2.5e-8]), []
    for h in steps:
        motion = integrate(chain, law, start, h, xi=xi, end_time=time).motion
        q, v = (motion.q - exact.coordinates) / chain.scale, motion.v - exact.velocities
        lam = motion.acceleration - acceleration
        parts = (q[~multiplier], (v / chain.scale)[~multiplier], lam[multiplier])
        errors.append([np.abs(part).max() for part in parts])
    orders = [order_of(steps, e) for e in zip(*errors, strict=True)]
    # theory says 2; the next order contributes h omega = 0.05 of the highest mode, and its decay
    np.testing.assert_allclose(orders, 2.0, atol=0.15)


@pytest.mark.parametrize("xi", RADII)
def test_events_converge_with_order_two(struck_links, xi: float) -> None:
    chain, law, start, truth = struck_links
    steps = np.array([2e-7, 1e-7, 5e-8])
    runs = [integrate(chain, law, start, h, xi=xi) for h in steps]
    assert all(run.kinds() == [e.kind for e in truth.events] for run in runs)
    errors = [
        abs(run.time_of("compression_to_restitution") - truth.events[1].time_s) for run in runs
    ]
    assert order_of(steps, errors) > 1.85
    # separation is better than order 2 at these steps: it only has to stay below the other
    separation = [abs(run.time_of("separation") - truth.events[2].time_s) for run in runs]
    assert np.all(np.array(separation) < errors)


def oscillator(xi: float, tolerance: float, spring: float = 1.0):
    """Unit mass at x = 1 on a spring to the origin: q = cos(omega t)."""
    chain, start = point_mass(1.0, (1.0, 0.0), (0.0, 0.0), spring=spring)
    old, new = (build_motion(chain, start.coordinates, start.velocities) for _ in range(2))
    integrator = Integrator(coefficients(xi, tolerance), chain, NOWHERE, workspace(8))
    assert initial_acceleration(old, IN_FLIGHT, integrator)
    return integrator, old, new


@pytest.mark.parametrize("xi", [0.0, 0.3, 0.5, 0.8, 1.0])
@pytest.mark.parametrize("h_omega", [0.1, 1.0, 3.0, 30.0, 1e4])
def test_stiff_oscillator_stays_bounded(xi: float, h_omega: float) -> None:
    integrator, old, new = oscillator(xi, 1e-12)
    largest = 0.0
    for _ in range(2000):
        assert step(h_omega, IN_FLIGHT, old, new, integrator)
        old, new = new, old
        largest = max(largest, abs(old.q[4]))
    # at most the overshoot of the first steps, (h omega)^2/4 of the start for xi = 0
    assert largest < 1.0 + h_omega**2
    assert abs(old.q[4]) <= 1.0 + 1e-6 * h_omega**2


@pytest.mark.parametrize("xi", [0.0, 0.3, 0.5, 0.8, 1.0])
def test_spectral_radius_at_infinite_frequency(xi: float) -> None:
    """All three roots tend to -xi: the displacements obey (E + xi)^3 q_n = 0, E the shift."""
    integrator, old, new = oscillator(xi, 1e-13)
    q = [1.0]
    for _ in range(12):
        assert step(1e3, IN_FLIGHT, old, new, integrator)
        old, new = new, old
        q.append(old.q[4])
    q = np.array(q)
    residue = q[3:] + 3 * xi * q[2:-1] + 3 * xi**2 * q[1:-2] + xi**3 * q[:-3]
    # the roots are off by powers of 1/(h omega) = 1e-3
    assert np.abs(residue).max() < 1e-4 * np.abs(q).max()


@pytest.mark.parametrize("xi", [0.0, 0.5, 0.8])
def test_local_error_estimate(xi: float) -> None:
    """Against the error of one step from a state on the method's own trajectory."""
    ratios = []
    for h in (0.02, 0.01):
        integrator, old, new = oscillator(xi, 1e-13)
        for _ in range(60):
            step(h, IN_FLIGHT, old, new, integrator)
            old, new = new, old
        step(h, IN_FLIGHT, old, new, integrator)
        exact = old.q[4] * np.cos(h) + old.v[4] * np.sin(h)
        ratios.append(local_error(h, old, new, integrator) / abs(new.q[4] - exact))
    # the leading term only: what is left is of order h, 0.02 and 0.01
    np.testing.assert_allclose(ratios, 1.0, atol=0.03)


@pytest.mark.parametrize("xi", RADII)
def test_variable_steps_keep_order_two(xi: float) -> None:
    """Steps that alternate between h and 1.5 h; without `change_step` the order falls to 1."""
    counts, errors = np.array([40, 80, 160]), []
    for count in counts:
        integrator, old, new = oscillator(xi, 1e-13)
        time = 0.0
        sizes = np.where(np.arange(2 * count) % 2, 1.5, 1.0)
        sizes *= 5.0 / sizes.sum()
        for i, h in enumerate(sizes):
            assert step(h, IN_FLIGHT, old, new, integrator)
            old, new = new, old
            change_step(sizes[(i + 1) % sizes.size] / h, old)
            time += h
        errors.append(np.hypot(old.q[4] - np.cos(time), old.v[4] + np.sin(time)))
    assert order_of(1 / counts, errors) == pytest.approx(2.0, abs=0.1)
