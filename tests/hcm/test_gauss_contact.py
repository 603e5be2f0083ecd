"""Gauss collocation in contact: order, events, invariants, what the stages' rows add up to."""

from dataclasses import replace

import numpy as np
import pytest

import hcm
from hcm.assembly.equations import fill_chords
from hcm.assembly.state import build_motion
from hcm.contact.events import NORMAL
from hcm.contact.law import COMPRESSION, FREE, ContactLaw, ContactState, contact_law
from hcm.integrators.gauss import step
from hcm.integrators.stages import shorten, value_inside
from hcm.reference_solution import ChainStart, solve_chain
from tests.hcm.cases import (
    SOFT,
    SOFT_TIP,
    SURFACE,
    TRUTH,
    Run,
    finger,
    integrate,
    order_of,
    straight_links,
)
from tests.hcm.test_dynamics import momenta
from tests.hcm.test_gauss import prepared

NO_GRAVITY = hcm.Drive((), 0.0)


@pytest.fixture(scope="module")
def struck_link():
    """A soft link of one element that strikes, slides, sticks and slides, and its truth."""
    angle = np.array([np.radians(255.0)])
    surface = hcm.Surface(height=-0.04 * np.sin(angle[0]), friction=0.5)
    chain, start = straight_links(finger(SOFT, 1, elements=1), angle, np.array([40.0]), NO_GRAVITY)
    law = contact_law(surface, replace(SOFT_TIP, normal_stiffness=2e5, restitution=0.7))
    return chain, law, start, solve_chain(chain, law, start, 1e-12, 1e-16)


def collocated(chain, law, start: ChainStart, h: float, **how: float) -> Run:
    return integrate(chain, law, start, h, collocation=True, in_contact=True, **how)


def test_order_in_a_smooth_piece(struck_link) -> None:
    chain, law, start, truth = struck_link
    time = 0.4 * truth.time_of("compression_to_restitution")
    exact = solve_chain(chain, law, start, 1e-12, 1e-16, end_time=time).end
    steps, errors = time / np.array([16, 24, 32]), []
    for h in steps:
        run = collocated(chain, law, start, h, end_time=time, stages=3)
        errors.append(np.abs((run.motion.q - exact.coordinates) / chain.scale)[2:].max())
    # theory says 2 s = 6, where the step resolves the element's axial wave too
    assert order_of(steps, errors) == pytest.approx(6.0, abs=0.3)


def test_events_converge_faster_than_the_paper_scheme(struck_link) -> None:
    """Every transition, restitution and separation among them, at order 4 and more by 3 stages."""
    chain, law, start, truth = struck_link
    steps, errors = np.array([8e-6, 4e-6]), []
    for h in steps:
        run = collocated(chain, law, start, h, stages=3)
        assert run.kinds() == [e.kind for e in truth.events]
        times = zip(run.events, truth.events, strict=True)
        errors.append(max(abs(a.time_s - b.time_s) for a, b in times))
    assert order_of(steps, errors) > 4.0
    alpha = integrate(chain, law, start, 4e-6, xi=1.0)
    off = max(abs(a.time_s - b.time_s) for a, b in zip(alpha.events, truth.events, strict=True))
    assert errors[-1] < 1e-2 * off


@pytest.mark.parametrize(("steps", "bound"), [(1.5, 4e-4), (4.0, 1e-6)])
def test_half_a_swing_on_the_spring(steps: float, bound: float) -> None:
    """A stiff rod about its hinge: T = pi sqrt(m/(3 k)), F = v sqrt(k m/3), in two steps or five.

    It bends by 1e-4 of what the spring yields, and the audit closes.
    """
    rod = replace(SOFT, youngs_modulus=1e12)
    mass, k, speed = rod.line_density * rod.length / 3, 1e4, 0.01
    swing = np.pi * np.sqrt(mass / k)
    chain, start = straight_links(
        finger(rod, 1, elements=1), np.array([np.pi]), np.array([speed / rod.length]), NO_GRAVITY
    )
    run = collocated(chain, ContactLaw(k, 1.0, 0.75, 0.0, 0.0), start, swing / steps)
    assert run.kinds() == ["contact", "compression_to_restitution", "separation"]
    assert run.time_of("compression_to_restitution") == pytest.approx(swing / 2, rel=3e-4)
    assert run.time_of("separation") == pytest.approx(swing, rel=3e-4)
    assert run["normal_force"].max() == pytest.approx(speed * np.sqrt(mass * k), rel=3e-4)
    held = run["kinetic"] + run["strain"] + run["contact_energy"]
    # inside a step its polynomial knows the motion to order 6: 2.5e-4 measured where it is two
    # thirds of the swing
    assert np.abs(held / held[0] - 1.0).max() < bound


def test_stick_and_slip_are_located() -> None:
    """The transitions of a tap that sticks, slips and sticks again, as fine steps find them."""
    chain, start = straight_links(finger(SOFT, elements=2))
    law = contact_law(replace(SURFACE, friction=1.0), replace(SOFT_TIP, tangential_ratio=0.2))
    fine = integrate(chain, law, start, 5e-8, xi=1.0)
    coarse = collocated(chain, law, start, 1e-5)
    assert coarse.kinds() == fine.kinds()
    assert {"stick_to_slip", "slip_to_stick"} & set(fine.kinds())
    for ours, theirs in zip(coarse.events, fine.events, strict=True):
        # 37 ns measured, of a reversal; the trapezoidal rule's own error at 50 ns is 1 ns
        assert ours.time_s == pytest.approx(theirs.time_s, abs=1e-7)


def test_energy_and_momentum_through_a_tap(struck_link) -> None:
    """The audit closes, and angular momentum changes by the quadrature of the contact's moment."""
    chain, law, start, _ = struck_link
    run = collocated(chain, law, start, 4e-6)
    held = sum(run[part] for part in ("kinetic", "strain", "gravity", "contact_energy"))
    lost = sum(run[part] for part in ("friction_loss", "restitution_loss"))
    assert np.abs(held + lost - held[0]).max() < 1e-6 * held[0]
    assert lost[-1] > 0.01 * held[0]
    before = momenta(chain, start.coordinates, start.velocities)[2]
    change = momenta(chain, run.motion.q, run.motion.v)[2] - before
    fn, ft = run["normal_force"], run["tangential_force"]
    moment = run["tip_x"] * fn - run["tip_y"] * ft
    turned = np.sum(0.5 * (moment[1:] + moment[:-1]) * np.diff(run["time"]))
    # trapezoids over rows a fifth of a step apart
    assert change == pytest.approx(turned, rel=1e-3)


def test_a_mirrored_tap_is_the_mirror_image(struck_link) -> None:
    chain, law, start, _ = struck_link
    sign = np.where(np.arange(chain.scale.size) % 2 == 0, -1.0, 1.0)
    image = ChainStart(sign * start.coordinates, sign * start.velocities)
    run, mirrored = (collocated(chain, law, s, 8e-6) for s in (start, image))
    for name, factor in (("normal_force", 1.0), ("tangential_force", -1.0), ("tip_x", -1.0)):
        size = np.abs(run[name]).max()
        np.testing.assert_allclose(mirrored[name], factor * run[name], rtol=0, atol=1e-9 * size)


def test_events_take_no_trials(struck_link) -> None:
    """They are located on the polynomials of the steps, and the factors of whole steps serve on."""
    chain, law, start, _ = struck_link
    run = collocated(chain, law, start, 4e-6)
    assert run.events[0].time_s == 0.0
    assert len(run.events) == 5
    assert run.totals.trials == 0


@pytest.mark.parametrize("share", [0.02, 0.4, 0.93])
def test_a_shortened_step_is_a_step_of_that_length(struck_link, share: float) -> None:
    """To the order of the collocation's polynomial, s + 1; its end is what was looked at."""
    chain, law, start, _ = struck_link
    contact, errors, steps = (
        ContactState(COMPRESSION, FREE, 0.0, 0.0, 0.0, 0.0),
        [],
        np.array([2e-6, 1e-6]),
    )
    for h in steps:
        integrator, old, cut = prepared(chain, start, stages=3, law=law)
        solved, looked = (build_motion(chain, old.q, old.v) for _ in range(2))
        assert step(share * h, contact, old, solved, integrator)
        assert step(h, contact, old, cut, integrator)
        value = value_inside(NORMAL, share, h, contact, old, looked, integrator)
        assert shorten(share, h, contact, old, cut, integrator)
        assert value == pytest.approx(-cut.v[chain.tip + 1], rel=1e-9)
        ours, theirs = (
            np.array([cut.q, share * h * cut.v]),
            np.array([solved.q, share * h * solved.v]),
        )
        errors.append(np.abs((ours - theirs) / chain.scale)[:, 2:].max(axis=1))
        chords = np.empty_like(cut.chords)
        fill_chords(cut.q, chain, chords)
        np.testing.assert_allclose(cut.chords, chords, rtol=0, atol=1e-12)
    for of_part in np.array(errors).T:
        assert order_of(steps, of_part) > 3.8


@pytest.mark.parametrize(
    ("step", "bound", "stages"), [(3e-5, 1e-4, 5), (1e-5, 1e-5, 5), (2e-5, 1e-5, 8)]
)
def test_whole_tap_in_a_few_steps(step: float, bound: float, stages: int) -> None:
    """Peak, duration and impulse of the soft tap against the kept truth."""
    settings = hcm.Settings(
        flight_integrator="gauss", contact_integrator="gauss", flight_step=6e-5,
        flight_tolerance=0.0, contact_step=step, contact_tolerance=0.0, stages=stages,
        estimate=False,
    )  # fmt: skip
    result = hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, settings=settings)
    found, history = result.summary, result.history
    assert result.status is hcm.Status.COMPLETED
    assert found.peak_normal_force_N == pytest.approx(TRUTH["peak_normal_force_N"], rel=bound)
    assert found.contact_duration_s == pytest.approx(TRUTH["contact_duration_s"], rel=bound)
    assert found.energy_residual < bound
    # the rows' trapezoids know the impulse less well than the stages' quadrature
    held = history.mode >= 3
    steps, force = np.diff(history.time_s), history.normal_force_N
    plain = np.sum((0.5 * (force[1:] + force[:-1]) * steps)[held[:-1]])
    assert found.normal_impulse_N_s == pytest.approx(plain, rel=3e-3)
    assert found.normal_impulse_N_s != plain


@pytest.mark.parametrize(
    ("friction", "chatters"), [(1e-14, True), (1e-12, True), (1e-9, False), (1e-6, False)]
)
def test_a_tip_that_chatters_is_not_held_by_the_surface(friction: float, chatters: bool) -> None:
    """Where stick and slip follow each other in one instant steps are whole, and the surface pulled
    with a twelfth of the peak until the end of the one in which the tip left. The limit is mu = 0.
    """

    def tap(mu: float) -> hcm.TapResult:
        return hcm.simulate(
            hcm.Finger((hcm.Phalanx(0.0328, 0.00774, 2.6e9, 1124.0, 4, 2.28e-7),)),
            hcm.Surface(0.01316, mu), hcm.Tip(5.317e6, 0.8, 0.8013),
            hcm.Drive((-7.66e-5,), reaction=True, incline=-0.182),
            hcm.Settings(flight_integrator="gauss", contact_integrator="gauss", estimate=False),
            start=hcm.RigidStart((0.1147,), (7.981,)),
        )  # fmt: skip

    smooth, rough = tap(0.0).summary, tap(friction)
    assert (rough.statistics.chatter_steps > 0) == chatters
    assert rough.history.normal_force_N.min() >= -1e-9 * (smooth.peak_normal_force_N or 0.0)
    for name in ("contact_duration_s", "normal_impulse_N_s", "peak_normal_force_N"):
        # friction moves them by a share of its own size
        wanted = pytest.approx(getattr(smooth, name), rel=friction + 1e-7)
        assert getattr(rough.summary, name) == wanted


@pytest.mark.parametrize("friction", [1e-12, 1e-9, 1e-6, 1e-4])
def test_a_narrow_cone_holds_no_more_than_it_is_wide(friction: float) -> None:
    """Sticking is over within ns, long before a step's first stage: its end was not seen, and the
    tip stuck for whole steps. mu = 0 is the limit."""
    phalanx = hcm.Phalanx(0.03, 0.015, 1e8, 1400.0, 10, poisson_ratio=0.4)
    scene = hcm.Scene(hcm.Finger((phalanx,)), hcm.Surface(0.02, friction), hcm.Tip(1e5, 1.0, 0.75))
    result = hcm.simulate_within(1e-3, scene)
    smooth = hcm.simulate_within(1e-3, replace(scene, surface=hcm.Surface(0.02, 0.0)))
    assert result.status is hcm.Status.COMPLETED
    tap, limit, history = result.summary, smooth.summary, result.history
    assert tap.peak_normal_force_N == pytest.approx(limit.peak_normal_force_N, rel=2e-3)
    # an event is located to 1e-12 of the largest force
    allowed = friction * history.normal_force_N + 1e-11 * limit.peak_normal_force_N
    assert (np.abs(history.tangential_force_N) <= allowed).all()


def test_a_damped_tips_events_are_sought_in_the_last_iterations_velocities() -> None:
    """Those of the one before were off by 1e-3 of the approach: it slid on backwards for 7e-4 of
    the tap before it was found to stick.
    """
    phalanx = hcm.Phalanx(0.0600435, 0.0075457, 1.05644e9, 2545.05, 5, 1.20792e-7)
    scene = hcm.Scene(
        hcm.Finger((phalanx,)), hcm.Surface(0.02085912, 0.575352),
        hcm.Tip(1.370958e6, 0.355425, 1.2),
        start=hcm.RigidStart((0.2186007,), (0.7928188,)),
    )  # fmt: skip
    run = hcm.simulate_within(1e-4, scene)
    assert run.given["settings"].contact_integrator == "gauss"
    assert run.summary.reverse_slip is False
    assert run.accuracy is not None
    assert run.accuracy.expected is not None
    assert run.accuracy.expected < 1e-4


def test_frames_lie_on_the_stages_polynomial() -> None:
    """In steps of a tenth of the tap, against steps of 0.1 us on the same elements: 0.07 % of the
    tip's way seen, 0.45 % by a cubic through a step's ends.
    """
    scene = hcm.Scene(finger(SOFT, 3, elements=5), SURFACE, SOFT_TIP)
    chosen = hcm.settings_for(1e-3, scene).scene
    ((touch, leaves),) = hcm.simulate_scene(chosen).taps
    times = tuple(np.linspace(touch + 1e-9, leaves - 2e-6, 41).tolist())
    coarse = replace(chosen.settings, frame_times=times, estimate=False)
    fine = replace(coarse, contact_integrator="generalized-alpha", contact_step=1e-7)
    heights = [
        np.array([frame.positions_m[-1][-1, 1] for frame in hcm.simulate_scene(one).frames])
        for one in (replace(chosen, settings=coarse), replace(chosen, settings=fine))
    ]
    assert coarse.contact_integrator == "gauss"
    assert np.abs(heights[0] - heights[1]).max() < 1.5e-3 * np.ptp(heights[1])
