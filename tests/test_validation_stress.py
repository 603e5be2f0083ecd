"""Random scenes of the reduced model, checks that can fail, and the campaign's command."""

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st

import hcm
from validation.stress.audit import mechanics, observed
from validation.stress.campaign import draw, run_cells, table_rows
from validation.stress.cells import difference, judge, judge_alone
from validation.stress.checks import violations
from validation.stress.finished import Finished
from validation.stress.frame import ANSWERS, REFUSED, RIGHT, SMALLER, STOPPED, WRONG, Cell
from validation.stress.hard_cells import tap_of
from validation.stress.limits import limit
from validation.stress.maps import SOURCES, hcm_maps
from validation.stress.other_integrator import judge_other
from validation.stress.page import write_stress_page
from validation.stress.random_scenes import NUMBERS, HcmScene, random_numbers, random_scene
from validation.stress.rigid_rod import closed_form, judge_rod
from validation.stress.scipy_user import solve

SOFT = hcm.Phalanx(0.04, 0.015, 1e9, 1400.0, elements=2)
TAP = HcmScene(
    hcm.Finger((SOFT,)), hcm.Surface(0.03, 0.5), hcm.Tip(0.78e6, 0.8), hcm.Drive(),
    hcm.Settings(max_steps=5_000),
)  # fmt: skip


@pytest.fixture(scope="module", autouse=True)
def tap() -> hcm.TapResult:
    """A tap; for every test, so that none counts the seconds of compiling."""
    return hcm.simulate(**TAP.arguments())


@seed(6)
@settings(
    max_examples=60, deadline=None, database=None, suppress_health_check=[HealthCheck.too_slow]
)
@given(st.lists(st.floats(0, 1, exclude_max=True), min_size=NUMBERS, max_size=NUMBERS))
def test_every_random_scene_is_answered(numbers: list[float]) -> None:
    scene = random_scene(numbers, max_steps=600)
    try:
        result = hcm.simulate(**observed(scene).arguments())
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
        # checks that were wrong: chatter, P that jumps as it starts to slip, turns between frames
        (2026, 1257),
        (2026, 1470),
        (2026, 1779),
        (2026, 2036),
    ],
)
def test_scenes_that_once_broke_an_invariant(case: int, number: int) -> None:
    scene = observed(random_scene(random_numbers(case, number)))
    assert violations(scene, hcm.simulate(**scene.arguments())) == []


def test_frames_at_the_ends_of_steps_are_kept() -> None:
    """A wanted time that a step ends on, to the last bit or beside it, belongs to that step."""
    ends = hcm.simulate(**TAP.arguments()).history.time_s
    times = np.unique(np.concatenate([ends, np.nextafter(ends, 1), np.nextafter(ends[1:], 0)]))
    wanted = replace(TAP.settings, frame_times=tuple(times.tolist()))
    result = hcm.simulate(**replace(TAP, settings=wanted).arguments())
    rows = np.searchsorted(times, ends)
    tips = np.array([frame.positions_m[-1][-1] for frame in result.frames])
    assert np.isfinite(tips).all()
    assert np.abs(tips[rows] - result.history.tip_position_m).max() < 1e-15


def test_small_dents_are_resolved() -> None:
    """A stiff tip on a light finger: the steps follow the contact, whatever was asked for."""
    light = hcm.Finger((hcm.Phalanx(0.005, 3e-4, 1e9, 200.0, elements=2),))
    scene = HcmScene(light, hcm.Surface(1e-4, 0.0), hcm.Tip(1e8), hcm.Drive(),
                     hcm.Settings(max_steps=20_000))  # fmt: skip
    coarse = hcm.simulate(**scene.arguments())
    fine = replace(scene.settings, contact_step=1e-10, contact_tolerance=1e-15, max_steps=200_000)
    truth = hcm.simulate(**replace(scene, settings=fine).arguments())
    assert coarse.status is truth.status is hcm.Status.COMPLETED
    error = difference(coarse, truth)
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
        "energy off": {"contact_energy_J": h.contact_energy_J + 0.2 * h.kinetic_energy_J.max()},
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
    scene = observed(replace(TAP, drive=hcm.Drive((0.05,))))
    result = hcm.simulate(**scene.arguments())
    assert result.status is hcm.Status.COMPLETED
    assert violations(scene, result) == []
    weaker = replace(scene, drive=hcm.Drive((0.04,)))
    assert any("energy off" in v for v in violations(weaker, result))


def test_cells_are_judged() -> None:
    verdict = judge(TAP)
    assert verdict.answer in (RIGHT, SMALLER)
    assert verdict.error is not None
    assert verdict.error < 1e-3
    stopped = judge(replace(TAP, settings=hcm.Settings(max_steps=50)))
    assert stopped.answer == STOPPED
    assert "50 steps" in stopped.reason
    many = replace(TAP, settings=hcm.Settings(end_time=1e3, flight_step=1e-9))
    refused = judge(many)
    assert refused.answer == REFUSED
    assert "end_time" in refused.reason


def test_steps_too_long_are_wrong_and_not_silent() -> None:
    fixed = hcm.Settings(contact_step=2e-4, contact_tolerance=0.0, flight_tolerance=0.0)
    assert judge(replace(TAP, settings=fixed)).answer in (WRONG, STOPPED)


@pytest.mark.parametrize(
    ("finger", "settings", "words"),
    [
        (hcm.Finger((replace(SOFT, elements=10**9),)), hcm.Settings(), ("GiB", "elements")),
        (hcm.Finger((SOFT,)), hcm.Settings(max_steps=10**12), ("GiB", "max_steps")),
        (hcm.Finger((SOFT,)), hcm.Settings(end_time=1e8), ("1e+12 steps", "end_time")),
    ],
)
def test_hopeless_sizes_are_refused_before_allocation(
    finger: hcm.Finger, settings: hcm.Settings, words: tuple[str, ...]
) -> None:
    with pytest.raises(hcm.ParameterError) as caught:
        hcm.simulate(finger, TAP.surface, TAP.tip, TAP.drive, settings)
    for word in words:
        assert word in str(caught.value)


def test_a_rod_is_compared_with_its_closed_form() -> None:
    """A stiff rod on a soft spring; another mass in the closed form is seen."""
    rod = next(m for m in hcm_maps(quick=True) if m.name == "rigid-rod")
    scene = rod.scene(1e4, 1e12, 0.002)
    verdict = judge_rod(scene)
    assert verdict.answer == RIGHT
    assert verdict.error is not None
    assert verdict.error < 1e-3
    result = hcm.simulate(**scene.arguments())
    heavier = replace(scene.finger.phalanges[0], density=1.2 * 1400.0)
    other = closed_form(replace(scene, finger=hcm.Finger((heavier,))))
    peak = result.summary.peak_normal_force_N
    assert peak is not None
    assert abs(peak / other["peak_normal_force_N"] - 1) > 0.05


def test_a_tap_is_compared_with_another_integrator() -> None:
    verdict = judge_other(TAP)
    assert verdict.answer in (RIGHT, SMALLER)
    assert "DOP853" in verdict.checked_by
    assert verdict.error is not None
    assert 0 < verdict.error < 1e-4


def test_maps_cover_the_ranges() -> None:
    maps = {wanted.name: wanted for wanted in hcm_maps(quick=False)}
    assert sum(1 for wanted in maps.values() for _ in wanted.cells()) > 10_000
    assert (maps["stiffness-step"].x[0], maps["stiffness-step"].x[-1]) == (1e2, 1e10)
    assert maps["phalanges"].x[-1] == 30
    assert maps["slenderness-elements"].y[-1] == 320


def test_a_campaign_goes_on_where_it_was(tmp_path: Path) -> None:
    wanted = next(m for m in hcm_maps(quick=True) if m.name == "friction-ratio-restitution")
    small = replace(wanted, x=(0.0, 0.5), y=(0.75,), panels=(1.0,), judge=judge_alone)
    cells = list(small.cells())
    path = tmp_path / "cells.jsonl"
    told: list[str] = []
    with ThreadPoolExecutor(1) as pool:
        run_cells(cells[:1], Finished(path), pool, lambda _, text: told.append(text))
        first = path.read_text()
        path.write_text(first + first[: len(first) // 2])  # killed while it wrote
        run_cells(cells, Finished(path), pool, lambda _, text: told.append(text))
    assert path.read_text().startswith(first)
    again = Finished(path)
    assert [again.get(cell) is not None for cell in cells] == [True, True]
    assert len(told) == 2  # the first cell was not run again
    rows = table_rows(small, again)
    assert [row["friction"] for row in rows] == [0.0, 0.5]
    assert {row["answer"] for row in rows} <= {RIGHT, SMALLER}
    plane = replace(small, y=(0.75, 0.9))
    draw(tmp_path, plane, again)
    assert (tmp_path / f"{small.name}.png").stat().st_size > 1000


def test_a_map_says_what_limits_it() -> None:
    """Counts and places come from the cells."""
    wanted = replace(next(m for m in hcm_maps(quick=True) if m.name == "stiffness-step"),
                     x=(1.0, 2.0, 3.0), y=(4.0, 5.0), panels=(1.0,))  # fmt: skip
    rows = [
        {wanted.x_name: x, wanted.y_name: y, wanted.panel_name: 1.0, "reason": "",
         "answer": STOPPED if x > 1 and y > 4 else RIGHT} for x in wanted.x for y in wanted.y
    ]  # fmt: skip
    assert limit(wanted, rows[:2]) == "every cell is right"
    for row in rows:
        row["reason"] = "work limit at t = 1 s"
    told = "stopped: work limit (2 of 6, mostly at normal stiffness from 2, contact step 5)"
    assert limit(wanted, rows) == told


def test_the_page_shows_maps_and_peers(tmp_path: Path) -> None:
    row = {"map": "plane", "solver": "hcm", "cells": 2, **dict.fromkeys(ANSWERS, 0), RIGHT: 2,
           "what limits it": "every cell is right"}  # fmt: skip
    write_stress_page(tmp_path, [row], [{"cell": "a hard one", "hcm": "completed"}])
    text = (tmp_path / "index.html").read_text()
    for words in (
        "2 cells, <b>0</b> of them wrong and silent",
        "a hard one",
        "every cell is right",
    ):
        assert words in text


def test_a_users_solve_ivp_taps() -> None:
    """SciPy's defaults find the tap of a soft rod, a few per cent off."""
    soft = replace(TAP, finger=hcm.Finger((replace(SOFT, youngs_modulus=1e7, elements=1),)),
                   tip=hcm.Tip(1e4))  # fmt: skip
    told, tap = solve(soft, 60.0, "RK45")
    assert told == "completed"
    own = tap_of(hcm.simulate(**soft.arguments()))
    assert tap is not None
    assert own is not None
    assert tap.error(own) < 0.5
    assert solve(soft, 1e-9, "RK45")[1] is None


def test_altered_verdicts_are_run_again(tmp_path: Path) -> None:
    cell = Cell("one", 0, 0, 0, TAP, judge, SOURCES)
    path = tmp_path / "cells.jsonl"
    Finished(path).add(cell, {"answer": STOPPED, "reason": ""})
    assert Finished(path).get(cell) is not None
    row = json.loads(path.read_text())
    path.write_text(json.dumps({**row, "answer": RIGHT}) + "\n")
    assert Finished(path).get(cell) is None
