"""Random scenes of the reduced model, and checks that can fail."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st

import hcm
from tests.validation.studies.stress.taps import SOFT, TAP
from validation.models.hcm import warm_up_choices
from validation.studies.random_scenes import NUMBERS, random_numbers, random_scene
from validation.studies.stress.hcm.audit import mechanics, observed
from validation.studies.stress.hcm.checks import violations
from validation.studies.stress.judging import judged_scalars, largest_difference


@pytest.fixture(scope="module", autouse=True)
def tap() -> hcm.TapResult:
    """A tap; for every test, so that none counts the seconds of compiling."""
    warm_up_choices()
    return hcm.simulate_scene(TAP)


@seed(6)
@settings(
    max_examples=60, deadline=None, database=None, suppress_health_check=[HealthCheck.too_slow]
)
@given(st.lists(st.floats(0, 1, exclude_max=True), min_size=NUMBERS, max_size=NUMBERS))
def test_every_random_scene_is_answered(numbers: list[float]) -> None:
    scene = random_scene(numbers, max_steps=600)
    try:
        result = hcm.simulate_scene(observed(scene))
    except hcm.ParameterError:
        return
    assert violations(observed(scene), result) == []


def test_random_scenes_reach_their_ranges() -> None:
    scenes = [random_scene(random_numbers(0, i)) for i in range(400)]
    counts = [len(s.finger.phalanges) for s in scenes]
    assert min(counts) == 1
    assert max(counts) > 20
    moduli = [s.finger.phalanges[0].youngs_modulus for s in scenes]
    assert min(moduli) < 1e5
    assert max(moduli) > 1e11
    assert random_scene(random_numbers(0, 7)) == scenes[7]


@pytest.mark.parametrize(
    ("case", "number"),
    [
        # a touch found to Newton's tolerance only started with a pulling force
        (3, 563),
        # chatter left the contact in compression with a pulling force
        (3, 582),
        # frames at a step's end were lost
        (2026, 571),
        (2026, 849),
        # an audit that let a light, stiff finger lose a fifth of its energy
        (2026, 2828),
        # checks that were wrong: chatter, P that jumps as it starts to slip, turns between frames
        (2026, 1257),
        (2026, 1470),
        (2026, 1779),
        (2026, 2036),
        # checks that were wrong: the impulse of a flight that collocation takes in one step
        (2026, 2397),
        (2026, 2707),
    ],
)
def test_scenes_that_once_broke_an_invariant(case: int, number: int) -> None:
    scene = observed(random_scene(random_numbers(case, number)))
    assert violations(scene, hcm.simulate_scene(scene)) == []


@pytest.mark.parametrize(("modulus", "elements"), [(1e12, 160), (1e4, 40), (1e12, 1)])
def test_a_finger_at_rest_is_balanced(modulus: float, elements: int) -> None:
    """Without gravity nothing moves but round-off, and the audit knows that."""
    bar = replace(SOFT, youngs_modulus=modulus, elements=elements)
    still = hcm.simulate(hcm.Finger((bar,)), TAP.surface, TAP.tip, hcm.Drive((), 0.0),
                         hcm.Settings(max_flight_time=0.02))  # fmt: skip
    assert still.status is hcm.Status.NOT_REACHED


def test_frames_at_the_ends_of_steps_are_kept() -> None:
    """A wanted time that a step ends on, to the last bit or beside it, belongs to that step."""
    ends = hcm.simulate_scene(TAP).history.time_s
    times = np.unique(np.concatenate([ends, np.nextafter(ends, 1), np.nextafter(ends[1:], 0)]))
    wanted = replace(TAP.settings, frame_times=tuple(times.tolist()))
    result = hcm.simulate_scene(replace(TAP, settings=wanted))
    rows = np.searchsorted(times, ends)
    tips = np.array([frame.positions_m[-1][-1] for frame in result.frames])
    assert np.isfinite(tips).all()
    assert np.abs(tips[rows] - result.history.tip_position_m).max() < 1e-15


def test_small_dents_are_resolved() -> None:
    """A stiff tip on a light finger: the steps follow the contact, whatever was asked for."""
    light = hcm.Finger((hcm.Phalanx(0.005, 3e-4, 1e9, 200.0, elements=2),))
    scene = hcm.Scene(light, hcm.Surface(2e-4, 0.0), hcm.Tip(1e8), hcm.Drive(),
                     hcm.Settings(max_steps=20_000))  # fmt: skip
    coarse = hcm.simulate_scene(scene)
    fine = replace(scene.settings, contact_step=1e-10, contact_tolerance=1e-15, max_steps=200_000)
    truth = hcm.simulate_scene(replace(scene, settings=fine))
    assert coarse.status is truth.status is hcm.Status.COMPLETED
    error = largest_difference(*(judged_scalars(of.summary, of.history) for of in (coarse, truth)))
    assert error is not None
    assert error < 0.01


def _with(result: hcm.TapResult, **arrays: np.ndarray) -> hcm.TapResult:
    return replace(result, history=replace(result.history, **arrays))


def test_checks_see_what_is_wrong(tap: hcm.TapResult) -> None:
    assert violations(TAP, tap) == []
    h = tap.history
    touching = h.mode // 3 > 0
    row = np.flatnonzero(touching)[5]

    def bent(values: np.ndarray, by: float) -> np.ndarray:
        changed = values.copy()
        changed[row] += by
        return changed

    force = float(h.normal_force_N.max())
    broken = {
        "is not finite": {"stress_R_Pa": bent(h.stress_R_Pa, np.nan)},
        "runs backwards": {"time_s": bent(h.time_s, -1.0)},
        "kinetic energy": {"kinetic_energy_J": (1 + 1e-5) * h.kinetic_energy_J},
        "strain energy": {"strain_energy_J": 1.1 * h.strain_energy_J},
        "energy off": {"contact_energy_J": h.contact_energy_J + 0.07 * h.kinetic_energy_J.max()},
        "momentum off": {"hinge_reactions_N": 1.5 * h.hinge_reactions_N},
        "leaves its law": {"normal_force_N": bent(h.normal_force_N, 1e-6 * force)},
        "pulls": {"normal_force_N": bent(h.normal_force_N, -2 * force)},
        "leaves the cone": {"tangential_force_N": 1.01 * h.tangential_force_N},
        "friction_dissipation_J falls": {"friction_dissipation_J": -h.friction_dissipation_J},
    }
    for text, arrays in broken.items():
        assert any(text in v for v in violations(TAP, _with(tap, **arrays))), text
    events = tuple(e for e in tap.events if e.kind != "compression_to_restitution")
    lost = replace(tap, events=events, event_postures=tap.event_postures[: len(events)])
    assert any("separation while in compression" in v for v in violations(TAP, lost))


def _bar(stretch: float, rate: float) -> hcm.Posture:
    """SOFT along -X, stretched, turning at `rate` about its first node."""
    nodes = np.linspace(0, 0.04, 3)
    zero = 0 * nodes
    return hcm.Posture(
        0.0, (np.column_stack([-stretch * nodes, zero]),), (np.array([[-stretch, 0.0]] * 3),),
        (np.column_stack([zero, -rate * stretch * nodes]),),
        (np.array([[0.0, -rate * stretch]] * 3),),
    )  # fmt: skip


def test_mechanics_of_a_stretched_turning_bar() -> None:
    """U = E A L (s^2 - 1)^2/8; T = m (s L omega)^2/6, p = m s L omega/2, V = 0 along X."""
    stretch, rate, finger = 1.02, 30.0, hcm.Finger((SOFT,))
    own = mechanics(finger, 9.8, _bar(stretch, rate))
    mass, length = SOFT.density * SOFT.area * 0.04, stretch * 0.04
    strain = SOFT.youngs_modulus * SOFT.area * 0.04 * (stretch**2 - 1) ** 2 / 8
    assert own.strain_J == pytest.approx(strain, rel=1e-12)
    assert own.kinetic_J == pytest.approx(mass * (length * rate) ** 2 / 6, rel=1e-12)
    assert own.momentum_N_s == pytest.approx([0.0, -mass * length * rate / 2], rel=1e-12)
    assert own.gravity_J == pytest.approx(0.0, abs=1e-15)


def test_torques_work_is_recomputed() -> None:
    """A driven tap's energy closes with our own count of the torques' turns, and only with it."""
    longer = replace(TAP.settings, max_steps=20_000)
    scene = observed(replace(TAP, drive=hcm.Drive((0.05,)), settings=longer))
    result = hcm.simulate_scene(scene)
    assert result.status is hcm.Status.COMPLETED
    assert violations(scene, result) == []
    weaker = replace(scene, drive=hcm.Drive((0.04,)))
    assert any("energy off" in v for v in violations(weaker, result))
