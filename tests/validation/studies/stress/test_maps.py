"""Cells, maps and the campaign of `fingertap stress`: judged, told, stored, resumed."""

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest

import hcm
from validation.harness.line_store import LineStore
from validation.peers.scipy_ivp import solve_first_tap
from validation.studies.random_scenes import HcmScene
from validation.studies.stress.campaign import run_cells, verdict_inputs
from validation.studies.stress.hcm.dop853 import judge_by_dop853
from validation.studies.stress.hcm.judge import judge_by_laws, judge_by_tighter_run
from validation.studies.stress.hcm.maps import hcm_maps
from validation.studies.stress.hcm.peers import peak_and_impulse
from validation.studies.stress.hcm.rigid_rod import closed_form, judge_by_closed_form
from validation.studies.stress.judging import largest_difference
from validation.studies.stress.limits import limit
from validation.studies.stress.report import table_rows, write_map, write_stress_page
from validation.studies.stress.stability_map import Answer, Cell

SOFT = hcm.Phalanx(0.04, 0.015, 1e9, 1400.0, elements=2)
TAP = HcmScene(
    hcm.Finger((SOFT,)), hcm.Surface(0.03, 0.5), hcm.Tip(0.78e6, 0.8), hcm.Drive(),
    hcm.Settings(max_steps=5_000),
)  # fmt: skip


@pytest.fixture(scope="module", autouse=True)
def warm() -> None:
    """Compile before any test counts seconds."""
    hcm.simulate(**TAP.arguments())


def test_cells_are_judged() -> None:
    verdict = judge_by_tighter_run(TAP)
    assert verdict.answer in (Answer.RIGHT, Answer.SMALLER)
    assert verdict.error is not None
    assert verdict.error < 1e-3
    stopped = judge_by_tighter_run(replace(TAP, settings=hcm.Settings(max_steps=50)))
    assert stopped.answer == Answer.STOPPED
    assert "50 steps" in stopped.reason
    many = replace(TAP, settings=hcm.Settings(end_time=1e3, flight_step=1e-9))
    refused = judge_by_tighter_run(many)
    assert refused.answer == Answer.REFUSED
    assert "end_time" in refused.reason


def test_steps_too_long_are_wrong_and_not_silent() -> None:
    fixed = hcm.Settings(contact_step=2e-4, contact_tolerance=0.0, flight_tolerance=0.0)
    assert judge_by_tighter_run(replace(TAP, settings=fixed)).answer in (
        Answer.WRONG,
        Answer.STOPPED,
    )


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
    verdict = judge_by_closed_form(scene)
    assert verdict.answer == Answer.RIGHT
    assert verdict.error is not None
    assert verdict.error < 1e-3
    result = hcm.simulate(**scene.arguments())
    heavier = replace(scene.finger.phalanges[0], density=1.2 * 1400.0)
    other = closed_form(replace(scene, finger=hcm.Finger((heavier,))))
    peak = result.summary.peak_normal_force_N
    assert peak is not None
    assert abs(peak / other["peak_normal_force_N"] - 1) > 0.05


def test_a_tap_is_compared_with_another_integrator() -> None:
    verdict = judge_by_dop853(TAP)
    assert verdict.answer in (Answer.RIGHT, Answer.SMALLER)
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
    small = replace(wanted, x=(0.0, 0.5), y=(0.75,), panels=(1.0,), judge=judge_by_laws)
    cells = list(small.cells())
    path = tmp_path / "cells.jsonl"
    told: list[str] = []
    with ThreadPoolExecutor(1) as pool:
        run_cells(cells[:1], LineStore(path), pool, lambda _, text: told.append(text))
        first = path.read_text()
        path.write_text(first + first[: len(first) // 2])  # killed while it wrote
        run_cells(cells, LineStore(path), pool, lambda _, text: told.append(text))
    assert path.read_text().startswith(first)
    again = LineStore(path)
    assert [again.load(verdict_inputs(cell)) is not None for cell in cells] == [True, True]
    assert len(told) == 2  # the first cell was not run again
    rows = table_rows(small, again)
    assert [row["friction"] for row in rows] == [0.0, 0.5]
    assert {row["answer"] for row in rows} <= {Answer.RIGHT, Answer.SMALLER}
    plane = replace(small, y=(0.75, 0.9))
    line = write_map(tmp_path, plane, table_rows(plane, again))
    assert line["cells"] == 2
    assert line["map"] == small.name
    assert (tmp_path / f"{small.name}.png").stat().st_size > 1000


def test_a_map_says_what_limits_it() -> None:
    """Counts and places come from the cells."""
    wanted = replace(next(m for m in hcm_maps(quick=True) if m.name == "stiffness-step"),
                     x=(1.0, 2.0, 3.0), y=(4.0, 5.0), panels=(1.0,))  # fmt: skip
    rows = [
        {wanted.x_name: x, wanted.y_name: y, wanted.panel_name: 1.0, "reason": "",
         "answer": Answer.STOPPED if x > 1 and y > 4 else Answer.RIGHT}
        for x in wanted.x for y in wanted.y
    ]  # fmt: skip
    assert limit(wanted, rows[:2]) == "every cell is right"
    for row in rows:
        row["reason"] = "work limit at t = 1 s"
    told = "stopped: work limit (2 of 6, mostly at normal stiffness from 2, contact step 5)"
    assert limit(wanted, rows) == told
    told_of = {
        Answer.REFUSED: (
            "{} elements (the first is cell 4) are inverted: mend",
            "refused: n elements are",
        ),
        Answer.FLAGGED: (
            "cautioned, springs hold {} % of it, so (half)",
            "flagged: springs hold n % of it",
        ),
        Answer.STOPPED: ("work limit at t = {} s", "stopped: work limit"),
    }
    wrong = [row for row in rows if row["answer"] == Answer.STOPPED]
    for answer, (reason, told) in told_of.items():
        for row, figure in zip(wrong, (4, 12.5), strict=True):
            row |= {"answer": answer, "reason": reason.format(figure)}
        assert limit(wanted, rows).startswith(told)
        assert "(2 of 6, mostly" in limit(wanted, rows)


def test_the_page_shows_maps_and_peers(tmp_path: Path) -> None:
    row = {"map": "plane", "solver": "hcm", "cells": 2, **dict.fromkeys(Answer, 0), Answer.RIGHT: 2,
           "what limits it": "every cell is right"}  # fmt: skip
    write_stress_page(
        tmp_path,
        [row],
        [{"cell": "a hard one", "hcm": "completed"}],
        [{"cell": "a stiff one", "CalculiX: answer": "not converged"}],
    )
    text = (tmp_path / "index.html").read_text()
    for words in (
        "2 cells, <b>0</b> of them wrong and silent",
        "a hard one",
        "not converged",
        "every cell is right",
    ):
        assert words in text


def test_a_users_solve_ivp_taps() -> None:
    """SciPy's defaults find the tap of a soft rod, a few per cent off."""
    soft = replace(TAP, finger=hcm.Finger((replace(SOFT, youngs_modulus=1e7, elements=1),)),
                   tip=hcm.Tip(1e4))  # fmt: skip
    given = (soft.finger, soft.surface, soft.tip, soft.drive)
    ending, tap = solve_first_tap(*given, 60.0)
    assert ending == "completed"
    own = peak_and_impulse(hcm.simulate(**soft.arguments()))
    assert tap is not None
    assert own is not None
    assert largest_difference(tap, own) < 0.5
    assert solve_first_tap(*given, 1e-9)[1] is None


def test_altered_verdicts_are_run_again(tmp_path: Path) -> None:
    cell = Cell("one", 0, 0, 0, TAP, judge_by_tighter_run)
    path = tmp_path / "cells.jsonl"
    LineStore(path).keep(verdict_inputs(cell), {"answer": Answer.STOPPED, "reason": ""})
    assert LineStore(path).load(verdict_inputs(cell)) is not None
    row = json.loads(path.read_text())
    path.write_text(json.dumps({**row, "answer": Answer.RIGHT}) + "\n")
    assert LineStore(path).load(verdict_inputs(cell)) is None
