"""Flights whose vibration is added as modes: closed forms, flights that follow it, refusals."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.polynomial import Polynomial, legendre
from scipy.integrate import quad

import hcm
from hcm.accuracy.coarser_run import ACCURACY_QUANTITIES
from hcm.arrays import Floats
from hcm.assembly.equations import fill_chords
from hcm.assembly.minimal_coordinates import minimal_coordinates
from hcm.assembly.normal_coordinates import mass_and_stiffness, normal_coordinates
from hcm.beam.division import flight_elements
from hcm.flight.fall import rods_fall
from hcm.flight.vibration import NODES, Vibration, _followed, _phase_error, fill_rods, vibration
from hcm.modal_flight import MOST_MODAL, _first_touch, fly_modal
from hcm.model import Model, build_model, until_touch
from hcm.results.status import Status
from hcm.simulate import _fly_elastic, solve_once
from hcm.start import Flown
from tests.hcm.cases import NO_ESTIMATE, SOFT, SOFT_SCENE, SOFT_TIP

# a phalanx that sways by a hundredth of its length: its vibration changes the tap by half a percent
LIMP = hcm.Scene(
    hcm.Finger((hcm.Phalanx(0.06, 0.0145, 4e6, 2000.0, 20, 0.0, 0.4),)), hcm.Surface(0.055, 0.5),
    hcm.Tip(5e3, 1.0),
)  # fmt: skip


PAIR = hcm.Scene(
    hcm.Finger((hcm.Phalanx(0.039, 0.007, 2e8, 2000.0), hcm.Phalanx(0.024, 0.012, 4e8, 1500.0))),
    hcm.Surface(0.05, 0.5), hcm.Tip(1e5), start=hcm.RigidStart((0.6, 0.4), (0.0, 0.0)),
)  # fmt: skip
CROSSING = hcm.Scene(
    hcm.Finger((
        hcm.Phalanx(0.0386, 0.0097, 3e8, 2000.0), hcm.Phalanx(0.0386, 0.01135, 3e8, 2000.0)
    )),
    hcm.Surface(0.045, 0.5), hcm.Tip(5e4),
)  # fmt: skip


def flight_of(scene: hcm.Scene) -> tuple[Model, Vibration]:
    fall = rods_fall(scene)
    assert fall is not None
    model = until_touch(build_model(scene), scene.finger, scene.assumptions)
    lengths = np.array([p.length for p in scene.finger.phalanges])
    law = model.generalized_alpha.law
    return model, vibration(model.chain, law, lengths, fall.flight)


def single(elements: int) -> hcm.Scene:
    body = hcm.Finger((replace(SOFT, elements=elements),))
    return hcm.Scene(body, hcm.Surface(0.03, 0.5), SOFT_TIP)


def test_in_normal_coordinates_mass_is_one() -> None:
    model = build_model(SOFT_SCENE)
    chain = model.chain
    of = normal_coordinates(chain, model.generalized_alpha.law)
    minimal = minimal_coordinates(chain)
    mass = np.linalg.inv(minimal.inverse_mass)
    shapes = of.to_places[:, minimal.place]
    assert shapes @ mass @ shapes.T == pytest.approx(np.eye(len(mass)), abs=1e-9)
    # both nodes at a hinge are at the same place
    inner, outer = chain.hinge_inner[1:], chain.hinge_outer[1:]
    assert (of.to_places[:, inner] == of.to_places[:, outer]).all()
    # the stiffness grows with its weight, the mass does not
    none, one, two = (mass_and_stiffness(of, model.q[None], w)[0] for w in (0.0, 1.0, 2.0))
    assert none == pytest.approx(of.lower @ of.lower.T, rel=1e-12, abs=1e-12 * none.max())
    assert two - one == pytest.approx(one - none, rel=1e-9, abs=1e-9 * one.max())


def test_a_falling_beam_vibrates_at_the_frequencies_of_a_hinge_and_a_free_end() -> None:
    """tan(x) = tanh(x) for x = kappa L; the weight of a stiff beam changes them by 1e-6."""
    scene = single(8)
    ringing = flight_of(scene)[1]
    roots = np.array([3.92660231, 7.06858275])
    free = (roots / SOFT.length) ** 2 * np.sqrt(SOFT.bending_stiffness / SOFT.line_density)
    # eight elements with customized masses: 2e-6 and 1.4e-5
    assert ringing.frequency[:2] == pytest.approx(free, rel=3e-5)
    fall = rods_fall(scene)
    assert fall is not None
    assert ringing.phase[:2] == pytest.approx(ringing.frequency[:2] * fall.time, rel=1e-5)


def test_a_beam_released_level_bends_by_its_weight_less_its_inertia() -> None:
    """E I w'''' = -rho A (g - 3 g s/(2 L)), w'' = 0 at both ends, int w s ds = 0."""
    model, ringing = flight_of(single(8))
    length = SOFT.length
    s = Polynomial([0.0, 1.0])
    shape = -(s**4) / 24 + s**5 / (80 * length) + length * s**3 / 24
    shape -= s * (shape * s).integ()(length) * 3 / length**3
    shape *= SOFT.line_density * 9.8 / SOFT.bending_stiffness
    assert shape.deriv(3)(length) == pytest.approx(0.0, abs=1e-12)
    first, tip = model.chain.hinge_outer[0], model.chain.tip
    found = ringing.bent[np.arange(first, tip + 1, 4) + 1]
    exact = shape(np.linspace(0.0, length, 9))
    # 7 nm at most, a ten-millionth of the length; bending changes its load by as little
    assert found == pytest.approx(exact, abs=2e-6 * np.abs(exact).max())


def tapped(scene: hcm.Scene, **changes: Any) -> tuple[hcm.TapResult, Floats, float]:
    settings = replace(scene.settings, estimate=False, **changes)
    result, left_out = solve_once(replace(scene, settings=settings))
    assert result.status is Status.COMPLETED
    summary = result.summary
    return result, np.array([getattr(summary, name) for name in ACCURACY_QUANTITIES]), left_out


@pytest.mark.parametrize(
    ("scene", "accuracy", "differ", "out_of_phase"),
    [
        # measured: 1.3e-6, and 2e-5 in the wrong phase
        (SOFT_SCENE, 1e-5, 4e-6, 1e-5),
        # 1e-4 and 1.5e-3
        (LIMP, 1e-4, 2e-4, 1e-3),
        # two phalanges of different material, released at an angle: 4e-6 and 2e-3
        (PAIR, 1e-5, 1e-5, 1e-3),
    ],
    ids=["soft", "limp", "pair"],
)  # fmt: skip
def test_modes_arrive_as_a_vibration_that_is_followed(
    scene: hcm.Scene, accuracy: float, differ: float, out_of_phase: float
) -> None:
    plain = replace(scene, settings=NO_ESTIMATE)
    chosen = hcm.settings_for(accuracy, plain, {"flight": "elastic"}).scene
    fall = rods_fall(chosen)
    assert fall is not None
    exact = tapped(chosen, flight_step=chosen.settings.flight_step / 2)[1]
    long = {"flight_step": fall.time / 30, "stages": 5}
    result, modal, left_out = tapped(chosen, flight="modal", **long)
    unfollowed = tapped(chosen, **long)[1]
    off = np.abs(modal / exact - 1.0).max()
    assert off < differ
    assert off < left_out
    assert np.abs(unfollowed / exact - 1.0).max() > out_of_phase
    history = result.history
    assert np.abs(history.energy_balance_J).max() < 1e-4 * history.kinetic_energy_J.max()
    assert (np.diff(history.time_s) >= 0.0).all()


def both_flights(scene: hcm.Scene, accuracy: float) -> tuple[hcm.Scene, Flown, Flown]:
    """With its elements in flight: one that follows the vibration, and a modal one."""
    scene = replace(scene, settings=NO_ESTIMATE)
    scene = hcm.settings_for(accuracy, scene, {"flight": "elastic"}).scene
    few = flight_elements(scene.finger, scene.settings)
    assert few is not None
    scene, fall = replace(scene, finger=few), rods_fall(scene)
    assert fall is not None
    long = replace(scene.settings, flight="modal", flight_step=fall.time / 30, stages=5)
    modal = fly_modal(replace(scene, settings=long), None, fall)
    return scene, _fly_elastic(scene, None, None), modal


@pytest.mark.parametrize(
    ("scene", "accuracy", "modes", "turn", "share"),
    [
        # measured: 1e-4 rad and 2e-4 of the amplitude; without what turning adds 0.015 rad,
        # without (w(0)/w(t))^(1/2) 2e-3
        (LIMP, 1e-4, [0], 5e-4, 1e-3),
        # 2e-4 rad and 3e-3
        (PAIR, 1e-5, [0, 1], 1e-3, 6e-3),
    ],
    ids=["limp", "pair"],
)  # fmt: skip
def test_modes_arrive_in_amplitude_and_phase(
    scene: hcm.Scene, accuracy: float, modes: list[int], turn: float, share: float
) -> None:
    """Against a flight that follows the vibration: differences at its touch as parts of modes."""
    scene, exact, found = both_flights(scene, accuracy)
    of = normal_coordinates(found.model.chain, found.model.generalized_alpha.law)

    def normal(q: Floats) -> Floats:
        return (q / of.chain.scale)[of.place] @ of.lower

    time, ringing = found.segments[-1].totals.time, flight_of(scene)[1]
    later = exact.segments[-1].totals.time - time
    shapes = np.array([normal(ringing.modes[m]) for m in modes])
    shapes /= (shapes**2).sum(axis=1)[:, None]
    frequency = ringing.frequency[modes]
    phase = ringing.phase[modes] + (time - ringing.time) * frequency
    apart = shapes @ normal(exact.motion.q - found.motion.q - later * found.motion.v)
    rates = shapes @ normal(exact.motion.v - found.motion.v) / frequency
    # of c = a cos(phase), c./w = -a sin(phase)
    assert apart * np.cos(phase) - rates * np.sin(phase) == pytest.approx(0.0, abs=share)
    assert apart * np.sin(phase) + rates * np.cos(phase) == pytest.approx(0.0, abs=turn)


def test_the_state_at_the_touch_is_that_of_a_start_there() -> None:
    _, exact, found = both_flights(LIMP, 1e-4)
    motion, chain, totals = found.motion, found.model.chain, found.segments[-1].totals
    # the vibration moves this touch by 12 us
    assert totals.time == pytest.approx(exact.segments[-1].totals.time, abs=1e-7)
    assert totals.phase_start == totals.time
    chords = np.empty_like(motion.chords)
    fill_chords(motion.q, chain, chords)
    assert (motion.chords == chords).all()


def test_rows_after_an_earlier_touch_or_just_before_it_are_dropped(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("hcm.modal_flight._first_touch", lambda end, *rest: 0.902 * end)
    _, exact, found = both_flights(LIMP, 1e-4)
    times = np.concatenate([segment.rows[:, 0] for segment in found.segments])
    step = found.model.limits.flight_step
    assert np.diff(times).min() > 0.099 * step
    assert times[-1] == pytest.approx(0.902 * exact.segments[-1].totals.time, rel=1e-2)


def test_the_bent_shape_turns_no_rod_and_has_converged(monkeypatch: pytest.MonkeyPatch) -> None:
    model, ringing = flight_of(PAIR)
    of = normal_coordinates(model.chain, model.generalized_alpha.law)
    lengths = np.array([p.length for p in PAIR.finger.phalanges])
    q, a, turns = (np.zeros((k, of.chain.scale.size)) for k in (1, 1, 2))
    work = np.zeros((3, of.chain.scale.size)), np.empty(4)
    fill_rods(np.array([[0.6, 0.4, 0.0, 0.0]]), lengths, of.chain, *work, q, a, turns[None])
    bent, along = ((d / of.chain.scale)[..., of.place] @ of.lower for d in (ringing.bent, turns))
    sizes = np.linalg.norm(bent) * np.linalg.norm(along, axis=1)
    assert along @ bent / sizes == pytest.approx(0.0, abs=1e-10)
    # a hundredth of the length, for which one iteration leaves 4e-4
    twice = flight_of(LIMP)[1].bent
    monkeypatch.setattr("hcm.flight.vibration.BENDING_ITERATIONS", 4)
    exact = flight_of(LIMP)[1].bent
    assert twice == pytest.approx(exact, abs=5e-5 * np.abs(exact).max())


def test_modes_that_lose_themselves_or_their_phase_are_unknown(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    usual = flight_of(PAIR)[1]
    with monkeypatch.context() as few:
        few.setattr("hcm.flight.vibration.NODES", 3)
        other = flight_of(PAIR)[1]
    tip = build_model(PAIR).chain.tip + np.arange(2)
    turned = np.abs(other.phase - usual.phase)[:, None] * usual.modes[:, tip]
    assert other.unknown > np.linalg.norm(usual.frequency[:, None] * turned)
    monkeypatch.setattr("hcm.flight.vibration.LEAST_OVERLAP", 1.1)
    all_of_it = np.linalg.norm(usual.frequency[:, None] * usual.modes[:, tip])
    assert flight_of(PAIR)[1].unknown > all_of_it > 10.0 * usual.unknown


def test_a_mode_is_followed_while_most_of_it_is_left() -> None:
    def turned(angle: float) -> Floats:
        c, s = np.cos(angle), np.sin(angle)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, -1.0]])

    kept = np.array([1, 2])
    number, sign, followed = _followed(kept, np.array([turned(a) for a in (0.0, 0.7, 1.4)]))
    assert number.tolist() == [[1, 2]] * 3
    assert sign.tolist() == [1.0, 1.0]
    assert followed.all()
    # in one step of 1.4 the first two modes exchange their numbers; then they turn round
    number, sign, followed = _followed(kept, np.array([turned(0.0), turned(1.4), turned(4.0)]))
    assert number.tolist() == [[1, 2], [0, 2], [0, 2]]
    assert sign.tolist() == [-1.0, 1.0]
    assert followed.tolist() == [True, True]
    # a reflection that leaves a third of each
    assert not _followed(kept, np.array([turned(0.0), np.eye(3) - 2.0 / 3.0]))[2].any()


def test_modes_are_chosen_where_steps_would_take_longer(monkeypatch: pytest.MonkeyPatch) -> None:
    def flight() -> str:
        return hcm.settings_for(1e-5, SOFT_SCENE).scene.settings.flight

    steps = hcm.settings_for(1e-5, SOFT_SCENE, {"flight": "elastic"})
    assert steps.fall is not None
    number = steps.fall.time / steps.scene.settings.flight_step
    for as_long, chosen in ((1.01 * number, "elastic"), (0.99 * number, "modal")):
        monkeypatch.setattr("hcm.accuracy.chosen_flight.AS_LONG", (as_long,))
        assert flight() == chosen
    elements = 3 * steps.scene.settings.flight_elements
    for most, chosen in ((elements - 1, "elastic"), (elements, "modal")):
        monkeypatch.setattr("hcm.accuracy.chosen_flight.MOST_MODAL", most)
        assert flight() == chosen


def test_what_modes_do_not_know_is_in_the_errors_of_fixed_settings() -> None:
    chosen = hcm.settings_for(1e-5, CROSSING)
    assert chosen.scene.settings.flight == "modal"
    settings = replace(chosen.scene.settings, estimate=True)
    result, left_out = solve_once(replace(chosen.scene, settings=settings))
    found = hcm.simulate_scene(replace(chosen.scene, settings=settings))
    share = found.errors["peak_normal_force_N"] / abs(result.summary.peak_normal_force_N)
    assert left_out <= share < 3.0 * left_out


def test_a_flight_whose_modes_cross_is_solved_again_by_steps() -> None:
    """Two equal phalanges, whose second and third frequencies meet on the way."""
    found = hcm.settings_for(1e-5, CROSSING)
    assert found.scene.settings.flight == "modal"
    _, left_out = solve_once(found.scene)
    assert left_out > 1e-4
    again = hcm.simulate_within(1e-5, CROSSING)
    assert again.given["settings"].flight == "elastic"
    assert again.accuracy is not None
    assert any("modes leave" in choice.reason for choice in again.accuracy.choices)
    assert again.accuracy.expected is not None
    assert again.accuracy.expected < 1e-5
    # a modal flight that is stated is kept, and says what it misses
    stated = replace(CROSSING, settings=replace(CROSSING.settings, flight="modal"))
    kept = hcm.simulate_within(1e-5, stated, {"flight": "modal"})
    assert kept.given["settings"].flight == "modal"
    assert any("was wanted" in caution for caution in kept.cautions)
    off = abs(kept.summary.peak_normal_force_N - again.summary.peak_normal_force_N)
    assert off < kept.errors["peak_normal_force_N"] + again.errors["peak_normal_force_N"]


@pytest.mark.parametrize(
    "changes",
    [
        {"drive": hcm.Drive((1e-3, 0.0, 0.0))},
        {"start": hcm.RigidStart((0.1, 0.1, 0.1), (0.0, 1.0, 0.0))},
        {"finger": hcm.Finger((replace(SOFT, relaxation_time=1e-6),) * 3)},
        {"settings": replace(NO_ESTIMATE, consistent_start=False)},
        {"settings": replace(NO_ESTIMATE, flight_integrator="generalized-alpha")},
    ],
)  # fmt: skip
def test_only_a_start_at_rest_without_loads_or_damping_flies_so(changes: dict[str, Any]) -> None:
    scene = replace(SOFT_SCENE, **{"settings": NO_ESTIMATE, **changes})
    chosen = replace(scene.settings, flight="modal")
    if "settings" not in changes:
        chosen = replace(chosen, flight_integrator="gauss")
        assert hcm.settings_for(1e-5, scene).scene.settings.flight == "elastic"
    with pytest.raises(hcm.ParameterError, match="flight = 'modal': must be 'elastic' or 'rigid'"):
        hcm.simulate_scene(replace(scene, settings=chosen))


def test_a_modal_flight_of_many_elements_is_refused() -> None:
    many = hcm.Finger((replace(SOFT, elements=MOST_MODAL // 2),) * 3)
    settings = replace(NO_ESTIMATE, flight="modal", flight_integrator="gauss")
    scene = replace(SOFT_SCENE, finger=many, settings=settings)
    with pytest.raises(hcm.ParameterError, match=f"must have at most {MOST_MODAL}"):
        hcm.simulate_scene(scene)


def test_a_modal_flight_that_does_not_touch_says_so() -> None:
    settings = replace(NO_ESTIMATE, flight="modal", flight_integrator="gauss", flight_step=1e-3)
    weightless = replace(SOFT_SCENE, drive=hcm.Drive(gravity=0.0), settings=settings)
    result = hcm.simulate_scene(weightless)
    assert result.status is Status.NOT_REACHED
    assert result.taps == ()


def test_an_interrupt_while_modes_are_computed_leaves_the_start(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def interrupted(*args: object) -> Vibration:
        raise KeyboardInterrupt

    monkeypatch.setattr("hcm.modal_flight.vibration", interrupted)
    settings = replace(NO_ESTIMATE, flight="modal", flight_integrator="gauss")
    result = hcm.simulate_scene(replace(SOFT_SCENE, settings=settings))
    assert result.status is Status.INTERRUPTED
    assert result.history.time_s.max() == 0.0


@pytest.mark.parametrize("speed", [0.5, 2.0, 20.0])
def test_the_first_of_several_touches_is_found(speed: float) -> None:
    """Height -v t + sum a_i cos(w_i t + p_i), whose rate may point upwards at v = 0.5 m/s."""
    frequency, size = np.array([2.0e4, 7.1e4]), np.array([2.0e-5, 1.0e-5])
    modes = np.zeros((2, 3))
    modes[:, 1] = size
    ringing = Vibration(np.zeros(3), 0.1, frequency, np.array([0.3, 2.0]), modes, 0.0)
    path = np.array([0.0, -speed, 0.0])
    time = _first_touch(0.1, 1.0, path, 1, ringing)
    reach = 1.5 * size.sum() / speed
    fine = 0.1 + np.linspace(-reach, reach, 200_001)
    height = -speed * (fine - 0.1) + ringing.at(fine)[0][:, 1]
    first = fine[np.flatnonzero(height <= 0.0)[0]]
    assert time == pytest.approx(first, abs=2.0 * reach / 200_000)


def test_the_error_of_an_integrated_frequency_is_not_understated() -> None:
    nodes, weights = legendre.leggauss(NODES)
    # Runge's function, a bump, and a polynomial that the half of the nodes integrate exactly
    rates = [lambda x: 1 / (1 + 9 * x * x), lambda x: np.exp(-((x - 0.6) ** 2) / 0.05),
             lambda x: 1 + x**5]  # fmt: skip
    for number, rate in enumerate(rates):
        values = rate(nodes)[:, None]
        phase = weights @ values
        off = abs(phase[0] - quad(rate, -1.0, 1.0, epsabs=1e-12)[0])
        stated = _phase_error(nodes, values, phase)[0]
        assert off <= stated + 1e-14
        assert stated < (0.1 if number < 2 else 1e-13)
