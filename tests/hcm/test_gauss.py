"""Gauss collocation in flight: order, phase, invariants, symmetry, hinges, and taps with it."""

import math
from dataclasses import replace

import numpy as np
import pytest

import hcm
from hcm.assembly.equations import residual
from hcm.assembly.state import Motion, build_motion
from hcm.beam.chain import Chain
from hcm.beam.energy import energies
from hcm.contact import law as contact
from hcm.contact.contract import Law
from hcm.contact.law import IN_FLIGHT, ContactState
from hcm.integrators.gauss import step
from hcm.integrators.gauss_tableau import GaussIntegrator, tableau, with_collocation
from hcm.integrators.generalized_alpha import initial_acceleration
from hcm.integrators.workspace import Integrator, coefficients, workspace
from hcm.parameters import STAGES
from hcm.reference_solution import ChainStart, solve_chain
from tests.hcm.cases import (
    NOWHERE,
    SOFT,
    SOFT_LAW,
    SOFT_TIP,
    SURFACE,
    TRUTH,
    finger,
    integrate,
    mode_near,
    straight_links,
)

STILL = hcm.Drive(gravity=0.0)
ANGLES = np.radians([255.0, 240.0, 200.0])


def prepared(
    chain: Chain,
    start: ChainStart,
    stages: int = STAGES,
    tolerance: float = 1e-13,
    law: Law = NOWHERE,
) -> tuple[GaussIntegrator, Motion, Motion]:
    old, new = (build_motion(chain, start.coordinates, start.velocities) for _ in range(2))
    plain = Integrator(coefficients(1.0, tolerance), chain, law, workspace(chain.scale.size))
    assert initial_acceleration(old, IN_FLIGHT, plain)
    plain.work.cost[:] = 0
    return with_collocation(plain, stages), old, new


def flown(chain: Chain, start: ChainStart, h: float, steps: int, **how: float) -> Motion:
    integrator, old, new = prepared(chain, start, **how)  # type: ignore[arg-type]
    for _ in range(steps):
        assert step(h, IN_FLIGHT, old, new, integrator)
        old, new = new, old
    return old


def nodes(chain: Chain) -> np.ndarray:
    """Places of nodal coordinates: all but the hinges'."""
    held = np.add.outer(chain.hinge, [0, 1]).ravel()
    return np.setdiff1d(np.arange(chain.scale.size), held)


@pytest.mark.parametrize("stages", [2, 3, 4, 5, 6])
def test_tableau_satisfies_the_simplifying_assumptions(stages: int) -> None:
    """B(2s) of the weights; C(s) of a a, integrated twice; T diag(mu) T^-1 = a a."""
    t = tableau(stages)
    for k in range(2 * stages):
        assert t.b @ t.c**k == pytest.approx(1 / (k + 1), abs=1e-14)
    for k in range(stages - 1):
        twice = t.c ** (k + 2) / ((k + 1) * (k + 2))
        np.testing.assert_allclose(t.a_squared @ t.c**k, twice, atol=1e-14)
    for k in range(stages):
        to_q, to_v = t.ends @ t.a_squared @ t.c**k
        assert to_q == pytest.approx(1 / ((k + 1) * (k + 2)), abs=1e-12)
        assert to_v == pytest.approx(1 / (k + 1), abs=1e-12)
    # with K = 0 every system returns its right-hand side: T diag(mu) T^-1
    np.testing.assert_allclose(t.backward @ t.forward, t.a_squared, atol=1e-13)


@pytest.mark.parametrize(("stages", "steps"), [(2, (16, 32)), (3, (8, 16))])
@pytest.mark.parametrize("driven", [False, True])
def test_order_in_coordinates_and_velocities(
    stages: int, steps: tuple[int, ...], driven: bool
) -> None:
    """Three links whose axial vibrations the start excites, against DOP853."""
    drive = hcm.Drive((2e-2, 1e-2, 5e-3), 9.8, reaction=True) if driven else hcm.Drive()
    chain, start = straight_links(finger(SOFT, elements=1), ANGLES, drive=drive)
    time = 4e-5
    exact = solve_chain(chain, NOWHERE, start, 1e-13, 1e-17, end_time=time).end
    errors = []
    for n in steps:
        end = flown(chain, start, time / n, n, stages=stages)
        off = np.array([end.q - exact.coordinates, end.v - exact.velocities]) / chain.scale
        errors.append(np.abs(off)[:, nodes(chain)].max(axis=1))
    orders = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    # omega h of the highest mode is 1 and less: the next order is not gone
    np.testing.assert_allclose(orders, 2 * stages, atol=0.25)


@pytest.mark.parametrize("stages", [2, 3, 5])
@pytest.mark.parametrize("h_omega", [0.9, 2.0])
def test_phase_of_a_vibrating_bar(stages: int, h_omega: float) -> None:
    """A step turns the bending mode of a hinged bar by 2 arg P(i omega h), P Pade's numerator."""
    chain, start = straight_links(finger(SOFT, 1), np.array([np.pi]), np.zeros(1), STILL)
    rest, count, amplitude = start.coordinates, 40, 1e-9
    omega, shape = mode_near(1.0, chain, rest)
    bent = ChainStart(rest + amplitude * shape, np.zeros(rest.size))
    end = flown(chain, bent, h_omega / omega, count, stages=stages)
    found = (end.q - rest)[nodes(chain)] @ shape[nodes(chain)] / (shape @ shape) / amplitude
    pade = sum(
        math.perm(2 * stages - k, stages) / math.factorial(k) * (1j * h_omega) ** k
        for k in range(stages + 1)
    )
    # a displacement of 1e-9 m keeps six digits of positions of 0.04 m
    assert found == pytest.approx(math.cos(2 * count * np.angle(pade)), abs=1e-5)


@pytest.fixture(scope="module")
def tumbling():
    """Soft links that whirl about the hinge without gravity: 200 steps of 0.1 ms."""
    chain, start = straight_links(finger(SOFT), ANGLES, drive=STILL)
    integrator, old, _ = prepared(chain, start, tolerance=1e-12)
    states = [old]
    for _ in range(200):
        new = Motion(*(a.copy() for a in states[-1]))
        assert step(1e-4, IN_FLIGHT, states[-1], new, integrator)
        states.append(new)
    return chain, integrator, states


def test_energy_does_not_drift(tumbling) -> None:
    """Steps hundreds of times longer than the mesh's shortest period."""
    chain, _, states = tumbling
    total = np.array([sum(energies(s.q, s.v, chain)) for s in states])
    kinetic = energies(states[0].q, states[0].v, chain)[0]
    assert kinetic > 0.9 * total[0]
    assert np.abs(total / total[0] - 1.0).max() < 1e-8


def test_angular_momentum_is_kept_to_round_off(tumbling) -> None:
    """A quadratic invariant: sum over nodes of q^T J M q., J a quarter turn."""
    chain, _, states = tumbling

    def momentum(state: Motion) -> float:
        total = 0.0
        for first, mass in zip(chain.first, chain.mass, strict=True):
            q, v = (y[first : first + 8].reshape(4, 2) for y in (state.q, state.v))
            total += q[:, 0] @ mass @ v[:, 1] - q[:, 1] @ mass @ v[:, 0]
        return total

    np.testing.assert_allclose([momentum(s) for s in states], momentum(states[0]), rtol=1e-10)


def test_hinges_hold_to_round_off(tumbling) -> None:
    chain, _, states = tumbling
    for outer, inner in zip(chain.hinge_outer, chain.hinge_inner, strict=True):
        for state in states:
            for y, unit in ((state.q, 0.04), (state.v, 1.0)):
                held = y[inner : inner + 2] if inner >= 0 else 0.0
                # 200 steps of one rounding each
                assert np.abs(y[outer : outer + 2] - held).max() < 200 * 2.3e-16 * unit * 3


def test_factors_turn_with_the_phalanges(tumbling) -> None:
    """The links turn by up to 0.8 rad; with K as it was, every step would need new factors."""
    _, integrator, states = tumbling
    iterations, factorizations = integrator.work.cost
    assert factorizations / integrator.tableau.mu.size < len(states) / 3
    assert iterations < 7 * len(states)


def test_a_step_back_returns(tumbling) -> None:
    """Symmetric: the step of -h undoes that of h, to the iteration's tolerance."""
    chain, start = straight_links(finger(SOFT), ANGLES)
    integrator, old, new = prepared(chain, start)
    back = build_motion(chain, start.coordinates, start.velocities)
    for _ in range(3):
        assert step(1e-4, IN_FLIGHT, old, new, integrator)
        assert step(-1e-4, IN_FLIGHT, new, back, integrator)
        place = nodes(chain)
        np.testing.assert_allclose(back.q[place], old.q[place], rtol=0, atol=1e-13)
        np.testing.assert_allclose(back.v[place], old.v[place], rtol=0, atol=1e-8)
        old, new = new, old


def test_acceleration_at_the_end_satisfies_the_equations(tumbling) -> None:
    """What generalized-alpha starts from at touch-down, and the reactions of the row."""
    chain, _, states = tumbling
    for state in states[1::50]:
        out = np.empty(chain.scale.size)
        residual(state.q, state.v, state.acceleration, chain, IN_FLIGHT, NOWHERE, out)
        # positions known to 1e-17 m through E A/l
        assert np.abs(out).max() < 1e-16 * chain.axial_stiffness.max() / chain.length.min() * 10


FINE = {"contact_step": 2e-7, "contact_tolerance": 0.0, "spectral_radius": 1.0,
        "newton_tolerance": 1e-8, "flight_integrator": "gauss", "estimate": False}  # fmt: skip


@pytest.mark.parametrize(("flight_step", "reuse"), [(6e-5, True), (1e-4, True), (1e-4, False)])
def test_whole_tap_to_five_digits(flight_step: float, reuse: bool) -> None:
    """Peak and duration against the kept truth; trapezoidal steps would have to be of 1 us."""
    how = {"flight_step": flight_step, "flight_tolerance": 0.0, "reuse_factors": reuse}
    settings = hcm.Settings(**how, **FINE)
    result = hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, settings=settings)
    found = result.summary
    assert result.status is hcm.Status.COMPLETED
    assert found.peak_normal_force_N == pytest.approx(TRUTH["peak_normal_force_N"], rel=1e-5)
    assert found.contact_duration_s == pytest.approx(TRUTH["contact_duration_s"], rel=1e-5)
    assert found.contact_time_s == pytest.approx(TRUTH["contact_time_s"], rel=1e-8)
    assert found.energy_residual < 1e-6
    assert [e.kind for e in result.events][::2] == ["contact", "separation"]


@pytest.mark.parametrize("reuse", [True, False])
def test_a_stiff_finger_falls_as_rods_do(reuse: bool) -> None:
    """In steps of 9 ms, a million periods of its stiffest modes: the round-off of a place over h^2
    is far below that of an acceleration, at which the iteration would stop 1e-5 s off.
    """
    body = finger(SOFT, youngs_modulus=1e13, elements=4)
    long = {"flight_integrator": "gauss", "flight_step": 9e-3, "flight_tolerance": 0.0}
    found, rods = (
        hcm.simulate(body, SURFACE, SOFT_TIP, settings=hcm.Settings(estimate=False, **how))
        for how in ({**long, "reuse_factors": reuse}, {"flight": "rigid", "flight_tolerance": 1e-9})
    )
    assert found.status is hcm.Status.COMPLETED
    assert found.summary.contact_time_s == pytest.approx(rods.summary.contact_time_s, rel=1e-6)


def test_tolerance_shortens_the_steps_and_buys_accuracy() -> None:
    """A vibration below the tolerance reaches the contact in any phase.

    Amplitude times k is 1.2e-6 of the peak force at 1e-10 m, and the contact's own steps leave as
    much (1.2e-6 at 1e-11 m). At 1e-9 m the error is no function of the tolerance: changes of
    gravity by some roundings, or of processor, move it between -3.3e-5 and 1.7e-5.
    """
    errors, steps = [], []
    for tolerance in (1e-5, 1e-9):
        settings = hcm.Settings(flight_step=5e-3, flight_tolerance=tolerance, **FINE)
        result = hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, settings=settings)
        flight = result.history.time_s[result.history.mode == 0][:-1]
        assert np.diff(flight).max() <= 5e-3 * (1 + 1e-12)
        errors.append(abs(result.summary.peak_normal_force_N / TRUTH["peak_normal_force_N"] - 1.0))
        steps.append(result.statistics.steps)
    # 3.2e-5, and 2.0e-6 to 3.3e-6 over such changes, BLAS kernels, with and without fma
    assert errors[1] < 1e-5
    assert errors[1] < errors[0]
    assert steps[1] > steps[0]


def test_two_taps_agree_with_generalized_alpha() -> None:
    """From the one to the other and back, twice: a rod that bounces, with restitution and friction.

    Five reversals of v_n make the second tap sensitive: generalized-alpha's own error there, at
    steps of 1 and 2 us, is 0.3 us.
    """
    surface = hcm.Surface(height=0.008, friction=0.5)
    tip = hcm.Tip(SOFT_TIP.normal_stiffness, restitution=0.8)
    found = []
    for name, h in (("gauss", 2e-5), ("generalized-alpha", 1e-6)):
        settings = hcm.Settings(
            flight_step=h, contact_step=5e-7, flight_tolerance=0.0, contact_tolerance=0.0,
            spectral_radius=1.0, end_time=0.1, flight_integrator=name,
        )  # fmt: skip
        result = hcm.simulate(finger(SOFT, 1, elements=2), surface, tip, settings=settings)
        assert result.status is hcm.Status.COMPLETED
        assert result.summary.energy_residual < 1e-6
        found.append(result)
    kinds = [[e.kind for e in r.events] for r in found]
    assert kinds[0] == kinds[1]
    assert kinds[0].count("contact") == kinds[0].count("separation") == 2
    ends = ("contact", "separation")
    times = [[e.time_s for e in r.events if e.kind in ends] for r in found]
    np.testing.assert_allclose(*times, rtol=0, atol=2e-6)


def test_contact_is_generalized_alphas_alone() -> None:
    """From a state in contact the run is the same to the last bit, events and all."""
    chain, start = straight_links(finger(SOFT, elements=2))
    start = replace(
        start, contact=ContactState(contact.COMPRESSION, contact.SLIP, 1.0, 0.0, 0.0, 0.0)
    )
    ours, theirs = (integrate(chain, SOFT_LAW, start, 1e-6, collocation=c) for c in (True, False))
    assert len(ours.events) >= 2
    assert ours.contact.normal_mode == contact.FLIGHT
    np.testing.assert_array_equal(ours.table, theirs.table)


@pytest.mark.parametrize("name", ["", "Gauss", "radau", None, 3])
def test_unknown_integrators_are_refused(name: str) -> None:
    with pytest.raises(hcm.ParameterError) as refusal:
        hcm.Settings(flight_integrator=name)
    assert str(refusal.value).startswith(f"flight_integrator = {name!r}")
    assert "'generalized-alpha' or 'gauss'" in str(refusal.value)
