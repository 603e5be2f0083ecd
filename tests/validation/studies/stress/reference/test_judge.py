"""The reference's stability maps: their cells, and that their checks find what is wrong."""

import dataclasses
from dataclasses import replace
from typing import Any

import numba
import numpy as np
import pytest

import reference_fem as rf
from reference_fem.model import Model
from tests.validation.commands import Patch
from validation.studies.stress.reference import judge as judge_module
from validation.studies.stress.reference.checks import violations
from validation.studies.stress.reference.judge import bar_impulse, judge, scalars
from validation.studies.stress.reference.maps import reference_maps
from validation.studies.stress.reference.scene import SIDE, ReferenceScene, block
from validation.studies.stress.stability_map import Answer


def test_the_full_maps_hold_a_thousand_different_cells() -> None:
    maps = reference_maps(quick=False)
    cells = [scene for wanted in maps for _, scene in wanted.cells()]
    assert len(cells) >= 1000
    assert len({wanted.name for wanted in maps}) == len(maps)
    assert len({repr(scene) for scene in cells}) > 900
    assert sum(1 for m in reference_maps(quick=True) for _ in m.cells()) < len(cells) / 5


ANSWERS: list[tuple[ReferenceScene, str, str]] = [
    (ReferenceScene(), Answer.RIGHT, ""),
    (
        ReferenceScene(body="finger", contact="surface", stiffness=0.004, dim=2),
        Answer.SMALLER,
        "times shorter",
    ),
    (ReferenceScene(poisson=0.5), Answer.REFUSED, "poisson_ratio = 0.5"),
    (ReferenceScene(divisions=6, distortion=1.0), Answer.REFUSED, "Jacobian"),
    (ReferenceScene(step_factor=1.2), Answer.STOPPED, "unstable at t ="),
    (ReferenceScene(speed=50.0), Answer.STOPPED, "at t ="),
    (ReferenceScene(contact="penalty", stiffness=0.01), Answer.FLAGGED, "springs hold"),
    (ReferenceScene(contact="surface", stiffness=10.0, dim=2), Answer.FLAGGED, "spike"),
]


@pytest.mark.parametrize(("scene", "answer", "reason"), ANSWERS)
def test_every_answer(scene: ReferenceScene, answer: str, reason: str) -> None:
    verdict = judge(scene)
    assert (verdict.answer, reason in verdict.reason) == (answer, True), verdict
    if answer == Answer.RIGHT:
        assert "half the step" in verdict.checked_by
        assert verdict.error is not None
        assert verdict.error < 0.05


def test_an_answer_that_nothing_supports_is_wrong(monkeypatch: Patch) -> None:
    told: list[float] = [0.2, 1e-6]
    monkeypatch.setattr(judge_module, "largest_difference", lambda *_: told.pop(0))
    monkeypatch.setattr("reference_fem.dynamics.loop.cautions", lambda *_: ())
    verdict = judge(ReferenceScene())
    assert verdict.answer == Answer.WRONG
    assert "half the step: differs by 0.2" in verdict.reason


@pytest.mark.parametrize(("share", "answer"), [(1.0, Answer.RIGHT), (1e-6, Answer.UNDERSTATED)])
def test_a_finger_is_held_to_the_errors_that_it_states(
    share: float, answer: Answer, monkeypatch: Patch
) -> None:
    whole = ReferenceScene.simulate

    def bolder(scene: ReferenceScene) -> tuple[rf.TapResult, Model]:
        result, model = whole(scene)
        errors = {name: share * np.asarray(error) for name, error in result.errors.items()}
        return replace(result, errors=errors), model

    monkeypatch.setattr(ReferenceScene, "simulate", bolder)
    verdict = judge(ReferenceScene(body="finger"))
    assert (verdict.answer, verdict.stated is None) == (answer, False), verdict


INNER = int(np.argmin(np.abs(block(3, 4).points).sum(axis=1)))  # the node in the middle


@pytest.fixture(scope="module")
def sound() -> tuple[rf.TapResult, Model]:
    return ReferenceScene().simulate()


def _changed(result: rf.TapResult, part: str, **columns: Any) -> rf.TapResult:
    values = {
        name: change(getattr(getattr(result, part), name)) for name, change in columns.items()
    }
    return replace(result, **{part: replace(getattr(result, part), **values)})


def _faster(result: rf.TapResult) -> rf.TapResult:
    last = result.snapshots[-1]
    return replace(
        result, snapshots=(*result.snapshots[:-1], replace(last, velocity=1.4 * last.velocity))
    )


def _stronger(result: rf.TapResult, factor: float) -> rf.TapResult:
    """Recorded forces that are not those that moved the body."""
    stronger = dict.fromkeys(("normal_force_N", "tangential_force_N"), lambda a: factor * a)
    return _changed(result, "forces", **stronger)


def _sunk(result: rf.TapResult) -> rf.TapResult:
    """Moved down through a surface that goes on pushing where it was."""
    fields = []
    for shown in result.snapshots:
        lower = shown.displacement.copy()
        lower[INNER, 1] -= SIDE
        fields.append(replace(shown, displacement=lower))
    return replace(result, snapshots=tuple(fields))


BROKEN = {
    "not finite": lambda r: _changed(r, "forces", lowest_gap_m=lambda a: a * np.nan),
    "pulls": lambda r: _changed(r, "forces", normal_force_N=lambda a: a - 1e-3 * a.max()),
    "leaves the cone": lambda r: _changed(r, "forces", tangential_force_N=lambda a: 1.01 * a),
    "momentum off": lambda r: _stronger(r, 1.001),
    "energy off": _faster,
    "of the body lie below": _sunk,
    "audited energy": lambda r: _changed(
        r, "history", energy_balance_J=lambda a: a + 1.0, kinetic_energy_J=lambda a: a
    ),
    "friction_dissipation_J falls": lambda r: _changed(
        r, "history", friction_dissipation_J=lambda a: -100.0 * a
    ),
    "strain_energy_J is negative": lambda r: _changed(r, "history", strain_energy_J=lambda a: -a),
    "without a message": lambda r: replace(r, message=""),
    "nothing is kept": lambda r: replace(
        r, history=rf.History(**{f.name: np.empty(0) for f in dataclasses.fields(rf.History)}),
        status=rf.Status.UNSTABLE,
    ),
}  # fmt: skip


@pytest.mark.parametrize("sentence", BROKEN)
def test_every_violation_is_found(sentence: str, sound: tuple[rf.TapResult, Model]) -> None:
    result, model = sound
    assert violations(result, model) == []
    assert any(sentence in told for told in violations(BROKEN[sentence](result), model))


@pytest.mark.slow
def test_forces_a_third_too_large_are_seen_in_every_cell() -> None:
    """A sample of the full maps, whatever became of the run; sound runs are not accused."""
    cells = [scene for wanted in reference_maps(quick=False) for _, scene in wanted.cells()]
    seen = sample = 0
    for number in np.random.default_rng(3).choice(len(cells), 60, replace=False):
        try:
            result, model = cells[number].simulate()
        except ValueError:
            continue
        assert violations(result, model) == []
        sample += 1
        seen += bool(violations(_stronger(result, 1.3), model))
    assert seen >= 0.95 * sample


@pytest.mark.parametrize("contact", ["penalty", "surface", "impulse"])
def test_a_finger_s_moment_of_momentum_tells_its_forces(contact: str) -> None:
    """About the fixed hinge; the centre of the forces is known to the field, 6 % of the impulse."""
    result, model = ReferenceScene(body="finger", contact=contact, stiffness=1.0).simulate()
    assert violations(result, model) == []
    for factor in (0.9, 1.1):
        found = violations(_stronger(result, factor), model)
        assert [told.split(" off")[0] for told in found] == ["momentum"]


def test_the_bar_s_limit_is_for_bars_alone() -> None:
    flat = ReferenceScene(poisson=0.0, slide=0.0, tilt=0.0, speed=0.5, divisions=8)
    result, model = flat.simulate()
    mass = 1000.0 * SIDE**3
    assert bar_impulse(flat, model) == pytest.approx(2.0 * mass * 0.5)
    assert result.summary.normal_impulse_N_s == pytest.approx(mass, rel=0.05)
    for other in (replace(flat, tilt=0.1), replace(flat, poisson=0.3), replace(flat, speed=9.0)):
        assert bar_impulse(other, model) is None


def test_a_distorted_block_keeps_its_outside() -> None:
    even, moved = block(3, 6), block(3, 6, 0.45, seed=3)
    limits = np.ptp(even.points, axis=0) / 2
    inside = (np.abs(even.points[:, :2]) < limits[:2] - 1e-9).all(axis=1)
    inside &= (even.points[:, 2] > 1e-9) & (even.points[:, 2] < SIDE / 2 - 1e-9)
    assert (moved.points[~inside] == even.points[~inside]).all()
    change = np.abs(moved.points - even.points)[inside]
    assert 0.4 * SIDE / 6 < change.max() <= 0.45 * SIDE / 6


@pytest.mark.parametrize("threads", [1, 2])
def test_the_same_bits_at_a_number_of_threads(threads: int) -> None:
    if threads > numba.config.NUMBA_NUM_THREADS:
        pytest.skip(f"{threads} threads are not offered")
    scene = ReferenceScene(body="finger", contact="surface", stiffness=0.01)
    before = numba.get_num_threads()
    try:
        numba.set_num_threads(threads)
        first, second = (ReferenceScene.simulate(scene)[0] for _ in range(2))
    finally:
        numba.set_num_threads(before)
    assert scalars(first) == scalars(second)
    for name, values in vars(first.forces).items():
        assert (values == getattr(second.forces, name)).all()
    for one, other in zip(first.snapshots, second.snapshots, strict=True):
        assert (one.displacement == other.displacement).all()
        assert (one.velocity == other.velocity).all()
