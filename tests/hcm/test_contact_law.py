"""The lumped contact law: hysteresis loops of eq. 19, continuity, stored and lost energy."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hcm.contact.events import (
    LIFT_OFF,
    NORMAL,
    SEPARATION,
    TANGENTIAL,
    TO_COMPRESSION,
    TO_RESTITUTION,
    TO_SLIP,
    TO_STICK,
    TOUCH,
    event_rates,
    event_values,
    transition,
)
from hcm.contact.law import (
    COMPRESSION,
    FREE,
    IN_FLIGHT,
    RESTITUTION,
    SLIP,
    STICK,
    ContactLaw,
    ContactState,
    contact_force,
    contact_tangent,
    hysteresis_loss,
    particle_position,
    particle_velocity,
    stored_energy,
)

K = 0.78e6


def law_with(restitution: float, mu: float = 0.5, ratio: float = 0.75) -> ContactLaw:
    return ContactLaw(K, restitution, ratio, mu, 0.0)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    restitution=st.floats(0.2, 1.0),
    travels=st.lists(st.floats(0.05, 0.95), min_size=1, max_size=12),
)
def test_repeated_loops_follow_eq_19(restitution: float, travels: list[float]) -> None:
    """Random reversals; u_c and u_r are -F_n/k at them, as the paper defines them."""
    law = law_with(restitution)
    contact, kind = transition(NORMAL, 0.0, 0.0, 0.0, -1.0, IN_FLIGHT, law)
    assert kind == TOUCH
    e2, gap, loops = restitution**2, 0.0, 0.0
    for i, travel in enumerate(travels):
        compressing = i % 2 == 0
        start, force = gap, contact_force(0.0, gap, contact, law)[1]
        stored = stored_energy(0.0, gap, contact, law)
        # restitution stops before the force vanishes
        gap += -1e-4 * travel if compressing else travel * force * e2 / K
        if compressing:
            expected = -K * gap + K * (1 - e2) * loops
        else:
            expected = -K * gap / e2 + K * (1 / e2 - 1) * loops
        fn = contact_force(0.0, gap, contact, law)[1]
        assert fn == pytest.approx(expected, rel=1e-9, abs=1e-9)
        # what the tip puts in is stored or lost; the force is linear, so its work is exact
        lost = hysteresis_loss(start, gap, contact, law)
        gained = stored_energy(0.0, gap, contact, law) - stored
        work = -0.5 * (force + fn) * (gap - start)
        assert gained + lost == pytest.approx(work, rel=1e-9, abs=1e-12)
        assert lost >= 0
        contact, kind = transition(NORMAL, 0.0, gap, 0.0, 0.0, contact, law)
        assert kind == (TO_RESTITUTION if compressing else TO_COMPRESSION)
        assert contact_force(0.0, gap, contact, law)[1] == pytest.approx(fn, rel=1e-15)
        # the sum of eq. 19: u_c1 + u_c2 - u_r1 + ..., with u = -F_n/k at the reversals
        loops += -fn / K if compressing else fn / K


@pytest.mark.parametrize("restitution", [0.3, 0.8, 1.0])
def test_one_loop_gives_back_the_square_of_e(restitution: float) -> None:
    law = law_with(restitution)
    contact, _ = transition(NORMAL, 0.0, 0.0, 0.0, -1.0, IN_FLIGHT, law)
    depth = -2e-4
    energy_in = 0.5 * K * depth**2
    lost = hysteresis_loss(0.0, depth, contact, law)
    assert lost == pytest.approx((1 - restitution**2) * energy_in, rel=1e-13)
    assert stored_energy(0.0, depth, contact, law) == pytest.approx(energy_in - lost, rel=1e-13)
    contact, _ = transition(NORMAL, 0.0, depth, 0.0, 0.0, contact, law)
    residual_gap = (1 - restitution**2) * depth
    assert contact_force(0.0, residual_gap, contact, law)[1] == pytest.approx(0.0, abs=1e-10)
    assert hysteresis_loss(depth, residual_gap, contact, law) == 0.0
    flight, kind = transition(SEPARATION, 0.0, residual_gap, 0.0, 1.0, contact, law)
    assert kind == LIFT_OFF
    assert flight.gap_ref == residual_gap
    # contact begins anew where it ended, with no force
    again, _ = transition(NORMAL, 0.0, residual_gap, 0.0, -1.0, flight, law)
    assert contact_force(0.0, residual_gap, again, law)[1] == 0.0


@pytest.mark.parametrize(("vt", "mode"), [(0.66, STICK), (0.67, SLIP), (-0.67, SLIP), (0.0, STICK)])
def test_initial_mode(vt: float, mode: int) -> None:
    """Eq. 21: stick inside |V_t/V_n| < mu eta^2 = 0.5 x 4/3."""
    contact, _ = transition(NORMAL, 0.0, 0.0, vt, -1.0, IN_FLIGHT, law_with(1.0))
    assert contact.tangential_mode == mode
    assert contact.slip_sign == (math.copysign(1, vt) if mode == SLIP else 0.0)


@pytest.mark.parametrize(("mu", "ratio"), [(0.0, 0.75), (0.5, 0.0)])
def test_no_tangential_element(mu: float, ratio: float) -> None:
    law = law_with(1.0, mu, ratio)
    contact, _ = transition(NORMAL, 0.0, 0.0, 1.0, -1.0, IN_FLIGHT, law)
    assert contact.tangential_mode == FREE
    assert contact_force(0.1, -1e-4, contact, law) == (0.0, pytest.approx(78.0))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_slip_and_stick_are_continuous(sign: float) -> None:
    law = law_with(0.8)
    slip = ContactState(RESTITUTION, SLIP, sign, 50.0, -1e-4, 0.0)
    x, gap = 3e-4, -0.9e-4
    ft, fn = contact_force(x, gap, slip, law)
    assert ft == -sign * 0.5 * fn  # friction opposes the particle's motion
    stick, kind = transition(TANGENTIAL, x, gap, 0.0, 0.1, slip, law)
    assert kind == TO_STICK
    assert contact_force(x, gap, stick, law) == pytest.approx((ft, fn), rel=1e-12)
    assert particle_position(x, gap, slip, law) == pytest.approx(stick.particle, rel=1e-15)
    again, kind = transition(TANGENTIAL, x, gap, 0.0, 0.1, stick, law)
    assert kind == TO_SLIP
    assert again.slip_sign == sign
    assert contact_force(x, gap, again, law) == pytest.approx((ft, fn), rel=1e-12)


MODES = [
    IN_FLIGHT,
    ContactState(COMPRESSION, FREE, 0.0, 3.0, 0.0, 0.0),
    ContactState(COMPRESSION, STICK, 0.0, 3.0, 0.0, 1e-5),
    ContactState(RESTITUTION, STICK, 0.0, 3.0, 0.0, -1e-5),
    ContactState(COMPRESSION, SLIP, 1.0, 3.0, 0.0, 0.0),
    ContactState(RESTITUTION, SLIP, -1.0, 3.0, 0.0, 0.0),
]


@pytest.mark.parametrize("contact", MODES)
def test_tangent_and_rates_are_derivatives(contact: ContactState) -> None:
    law = law_with(0.7)
    x, gap, vt, vn, at, an = 2e-5, -1e-5, 0.8, 0.3, 900.0, 700.0
    h = 1e-7
    force = np.array(contact_force(x, gap, contact, law))
    dtx, dty, dny = contact_tangent(contact, law)
    moved = np.array(contact_force(x + h, gap, contact, law)) - force
    np.testing.assert_allclose(moved, [h * dtx, 0.0], atol=1e-12)
    moved = np.array(contact_force(x, gap + h, contact, law)) - force
    np.testing.assert_allclose(moved, [h * dty, h * dny], atol=1e-12)

    def values(t: float) -> np.ndarray:
        state = (
            x + vt * t + at * t * t / 2,
            gap + vn * t + an * t * t / 2,
            vt + at * t,
            vn + an * t,
        )
        return np.array(event_values(*state, contact, law))

    t = 1e-9
    rates = np.array(event_rates(x, gap, vt, vn, at, an, contact, law))
    here = np.isfinite(values(0.0))
    differences = (values(t)[here] - values(-t)[here]) / (2 * t)
    np.testing.assert_allclose(differences, rates[here], rtol=1e-5)
    if contact.tangential_mode == SLIP:
        positions = [particle_position(x + vt * s, gap + vn * s, contact, law) for s in (-t, t)]
        expected = (positions[1] - positions[0]) / (2 * t)
        assert particle_velocity(0.0, vt, vn, contact, law) == pytest.approx(expected, rel=1e-5)
