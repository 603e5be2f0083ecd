"""Flights on fewer elements than the contact has: the same curve, and the same tap."""

from dataclasses import replace

import numpy as np
import pytest

import hcm
from hcm import loop
from hcm.accuracy.coarser_run import ACCURACY_QUANTITIES, coarser_scene
from hcm.beam.chain import build_chain
from hcm.beam.division import divided
from hcm.beam.energy import energies
from hcm.beam.refinement import refine_chain
from hcm.model import rigid_motion
from tests.hcm.cases import SOFT, SOFT_TIP, SURFACE, finger

PAPER, REFINED = hcm.Assumptions(), hcm.Assumptions("refined", lowest_point=False, hertz=False,
    partial_slip=False, tip_compliance=False, deforming_tip=False, growing_patch=False,
    radiating_tip=False)  # fmt: skip


def body(elements: int) -> hcm.Finger:
    thick = replace(SOFT, poisson_ratio=0.4, elements=elements)
    return hcm.Finger((thick, replace(thick, length=0.03)))


def chain_of(elements: int, assumptions: hcm.Assumptions) -> hcm.beam.chain.Chain:
    chain, _ = build_chain(body(elements), hcm.Drive())
    if not assumptions.any:
        return chain
    return refine_chain(chain, body(elements), hcm.Drive(), assumptions)


def bent(elements: int) -> np.ndarray:
    """Any state near a rigid one: (q, v) with bent and stretched elements, hinges closed."""
    chain = chain_of(elements, PAPER)
    state = hcm.RigidStart((0.3, 0.8), (20.0, -35.0))
    both = np.array(rigid_motion(body(elements), chain, state))
    rng = np.random.default_rng(elements)
    both += rng.normal(size=both.shape) * [[2e-4], [0.1]] * np.where(chain.scale > 1, 10, 1)
    for w, place in enumerate(chain.hinge):
        both[:, place : place + 2] = 0.0
        inner = chain.hinge_inner[w]
        both[:, place + 2 : place + 4] = both[:, inner : inner + 2] if w else 0.0
    return both


@pytest.mark.parametrize("assumptions", [PAPER, REFINED], ids=["rigid sections", "shear"])
def test_twice_divided_is_divided_once(assumptions: hcm.Assumptions) -> None:
    """A piece of a static shape is a static shape: 2 -> 4 -> 12 is 2 -> 12 elements."""
    few, some, many = (body(n) for n in (2, 4, 12))
    at_once = divided(bent(2), few, many, chain_of(12, PAPER), assumptions)
    halves = divided(bent(2), few, some, chain_of(4, PAPER), assumptions)
    by_turns = divided(halves, some, many, chain_of(12, PAPER), assumptions)
    np.testing.assert_allclose(by_turns, at_once, rtol=0, atol=1e-12 * np.abs(at_once).max())
    # and what the nodes were they are
    chain = chain_of(2, PAPER)
    np.testing.assert_allclose(at_once[:, -4:], bent(2)[:, chain.tip :], rtol=1e-13)
    inner, outer = chain_of(12, PAPER).hinge_inner[1], chain_of(12, PAPER).hinge_outer[1]
    np.testing.assert_array_equal(at_once[:, inner : inner + 2], at_once[:, outer : outer + 2])


@pytest.mark.parametrize("parts", [2, 3, 5])
def test_division_keeps_every_energy(parts: int) -> None:
    """Kinetic, strain's and gravity's: integrals of the same polynomials."""
    own = energies(*bent(3), chain_of(3, PAPER))
    fine = chain_of(3 * parts, PAPER)
    kept = energies(*divided(bent(3), body(3), body(3 * parts), fine, PAPER), fine)
    assert min(own[:2]) > 0.0
    np.testing.assert_allclose(kept, own, rtol=1e-10)


def test_division_keeps_the_bending_and_the_shear_of_small_deflections() -> None:
    """Across the axis; along it the normals of sections are not the axis' own slopes."""
    few, many = chain_of(2, REFINED), chain_of(6, REFINED)
    q = build_chain(body(2), hcm.Drive())[1]
    across = np.random.default_rng(1).normal(size=q.size)
    for place in range(3, q.size, 2):
        q[place] += 1e-7 * across[place]
    q[few.hinge + 1] = 0.0
    fine = divided(np.array([q, 0 * q]), body(2), body(6), many, REFINED)
    np.testing.assert_allclose(energies(*fine, many)[1], energies(q, 0 * q, few)[1], rtol=1e-8)


SETTINGS = hcm.Settings(
    flight_integrator="gauss", flight_step=0.003, flight_tolerance=1e-4, contact_step=4e-6,
    contact_tolerance=0.0, estimate=False,
)  # fmt: skip
SCENE = hcm.Scene(finger(SOFT, elements=8), SURFACE, SOFT_TIP, settings=SETTINGS)


def tap(few: int, scene: hcm.Scene = SCENE, **changes: object) -> hcm.TapResult:
    settings = replace(scene.settings, flight_elements=few, **changes)
    return hcm.simulate_scene(replace(scene, settings=settings))


@pytest.mark.parametrize(
    "assumptions", [PAPER, hcm.Assumptions("refined")], ids=["paper", "refined"]
)
def test_a_slowly_bending_flight_needs_few_elements(assumptions: hcm.Assumptions) -> None:
    """Cubics leave out (l/L)^4 of a bending that is 1e-4 of the tap."""
    thick = hcm.Finger(tuple(replace(p, poisson_ratio=0.4) for p in SCENE.finger.phalanges))
    scene = replace(SCENE, finger=thick, assumptions=assumptions)
    if assumptions.any:
        scene = replace(scene, settings=replace(SETTINGS, contact_step=1e-6))
    whole = tap(0, scene).summary
    error = []
    for few in (1, 4):
        result = tap(few, scene)
        assert result.status is hcm.Status.COMPLETED
        own = result.summary
        error.append(
            max(abs(getattr(own, n) / getattr(whole, n) - 1.0) for n in ACCURACY_QUANTITIES)
        )
        assert own.energy_residual < 1e-4
    assert error[1] < 0.2 * error[0] < 2e-5


def test_no_flight_has_more_elements_than_the_contact() -> None:
    for few, same in ((50, tap(8)), (0, tap(0))):
        np.testing.assert_array_equal(tap(few).history.normal_force_N, same.history.normal_force_N)
    rods = [tap(few, flight="rigid").history.normal_force_N for few in (0, 3)]
    np.testing.assert_array_equal(*rods)


def test_a_divided_flight_leaves_a_whole_history() -> None:
    times = (0.0, 0.05, 0.13, 0.1362)
    result, whole = tap(4, frame_times=times), tap(0, frame_times=times)
    assert [e.kind for e in result.events] == [e.kind for e in whole.events]
    assert (np.diff(result.history.time_s) >= 0).all()
    assert result.statistics.steps == pytest.approx(whole.statistics.steps, abs=2)
    for own, other in zip(result.frames, whole.frames, strict=True):
        assert own.time_s == other.time_s
        for at, its in zip(own.positions_m, other.positions_m, strict=True):
            np.testing.assert_allclose(at, its, rtol=0, atol=2e-6)
    # the row of the touch on either elements: of the same curve
    history = result.history
    before = int(np.searchsorted(history.time_s, result.summary.contact_time_s))
    assert history.time_s[before] == history.time_s[before + 1]
    for numbers in (history.stress_R_Pa, history.kinetic_energy_J, history.strain_energy_J):
        assert numbers[before] != 0.0
        assert numbers[before + 1] == pytest.approx(numbers[before], rel=1e-8)


def test_a_flight_that_does_not_touch_ends_as_it_would() -> None:
    for changes, status in (
        ({"end_time": 0.05}, hcm.Status.COMPLETED),
        ({"max_flight_time": 0.05}, hcm.Status.NOT_REACHED),
        ({"max_steps": 5}, hcm.Status.WORK_LIMIT),
    ):
        assert tap(2, **changes).status is status
        assert tap(0, **changes).status is status
    low = replace(SCENE, surface=hcm.Surface(0.01, 0.5))
    assert tap(2, low).status is tap(0, low).status is hcm.Status.BODY_TOUCHES
    assert tap(2, low).message.split(":")[1][:12] == tap(0, low).message.split(":")[1][:12]


def test_iterations_of_the_flight_on_few_elements_are_counted() -> None:
    """A step takes one at least, in flight as in contact."""
    for changes in ({"end_time": 0.05}, {}):
        statistics = tap(2, **changes).statistics
        assert 0 < statistics.steps <= statistics.newton_iterations
        assert statistics.factorizations > 0


def test_an_interrupt_in_the_flight_ends_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    own, calls = loop.advance_by_kind, []

    def interrupted(*given: object) -> object:
        calls.append(1)
        if len(calls) == 1:
            raise KeyboardInterrupt
        return own(*given)

    monkeypatch.setattr(loop, "advance_by_kind", interrupted)
    result = tap(2)
    assert result.status is hcm.Status.INTERRUPTED
    assert (len(calls), result.history.time_s.size) == (1, 2)


def test_the_run_that_judges_a_followed_flight_has_fewer_elements_there() -> None:
    followed, bent = (hcm.settings_for(accuracy, SCENE) for accuracy in (1e-5, 1e-4))
    assert (followed.followed, bent.followed) == (True, False)
    few = [chosen.scene.settings.flight_elements for chosen in (followed, bent)]
    own = hcm.simulate_scene(bent.scene)
    coarse = [coarser_scene(chosen, own).settings.flight_elements for chosen in (followed, bent)]
    assert coarse == [few[0] - 1, few[1]] == [round(few[0] / 3**0.25), few[1]]
