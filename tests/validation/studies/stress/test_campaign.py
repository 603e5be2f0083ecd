"""The campaign of `fingertap stress`: verdicts stored and resumed, tables, figures, the page."""

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib import pyplot as plt
from matplotlib.colors import to_rgba

from tests.validation.commands import Patch, Run
from tests.validation.studies.stress.taps import TAP
from validation.harness.line_store import LineStore
from validation.models.hcm import warm_up_choices, warm_up_kernels
from validation.studies import campaign
from validation.studies.campaign import Case, run_cases, verdict_inputs
from validation.studies.stress import command
from validation.studies.stress.hcm.judge import judge_by_laws, judge_by_tighter_run
from validation.studies.stress.hcm.maps import hcm_maps
from validation.studies.stress.report import (
    COLORS,
    _where,
    draw_map,
    limit,
    table_rows,
    write_map,
    write_stress_page,
)
from validation.studies.stress.stability_map import Answer


def test_a_campaign_goes_on_where_it_was(tmp_path: Path, monkeypatch: Patch) -> None:
    monkeypatch.setattr(campaign, "workers", ThreadPoolExecutor)
    wanted = next(m for m in hcm_maps(quick=True) if m.name == "friction-ratio-restitution")
    axes = dict(zip(wanted.axes, ((0.0, 0.5), (0.75,), (1.0,)), strict=True))
    small = replace(wanted, axes=axes, judge=judge_by_laws)
    cases = [Case(small.name, scene, small.judge) for _, scene in small.cells()]
    path = tmp_path / "cells.jsonl"
    told: list[str] = []
    run_cases(cases[:1], path, lambda _, text: told.append(text))
    first = path.read_text()
    path.write_text(first + first[: len(first) // 2])  # killed while it wrote
    found = run_cases(cases, path, lambda _, text: told.append(text))
    assert path.read_text().startswith(first)
    again = LineStore(path)
    assert [again.load(verdict_inputs(case)) is not None for case in cases] == [True, True]
    assert len(told) == 2  # the first cell was not run again
    rows = table_rows(small, iter(found))
    assert rows == table_rows(small, map(again.load, map(verdict_inputs, cases)))
    assert [row["friction"] for row in rows] == [0.0, 0.5]
    assert {row["answer"] for row in rows} <= {Answer.RIGHT, Answer.SMALLER}
    plane = replace(small, axes=axes | {"tangential_ratio": (0.75, 0.9)})
    line = write_map(tmp_path, plane, table_rows(plane, iter(found)))
    assert line["cells"] == 2
    assert line["map"] == small.name
    assert (tmp_path / f"{small.name}.png").stat().st_size > 1000


def test_a_map_says_what_limits_it() -> None:
    """Counts and places come from the cells."""
    whole = next(m for m in hcm_maps(quick=True) if m.name == "stiffness-step")
    xs, ys = (1.0, 2.0, 3.0), (4.0, 5.0)
    wanted = replace(whole, axes=dict(zip(whole.axes, (xs, ys, (1.0,)), strict=True)))
    rows = [
        {**dict(zip(wanted.axes, (x, y, 1.0), strict=True)), "reason": "",
         "answer": Answer.STOPPED if x > 1 and y > 4 else Answer.RIGHT}
        for x in xs for y in ys
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


def test_altered_verdicts_are_run_again(tmp_path: Path) -> None:
    case = Case("one", TAP, judge_by_tighter_run)
    path = tmp_path / "cells.jsonl"
    LineStore(path).keep(verdict_inputs(case), {"answer": Answer.STOPPED, "reason": ""})
    assert LineStore(path).load(verdict_inputs(case)) is not None
    row = json.loads(path.read_text())
    path.write_text(json.dumps({**row, "answer": Answer.RIGHT}) + "\n")
    assert LineStore(path).load(verdict_inputs(case)) is None


def test_random_scenes_are_not_timed_while_kernels_compile(
    tmp_path: Path, monkeypatch: Patch
) -> None:
    """On a fresh cache their first cells took half a minute, and were called wrong for it."""
    compiled: list[object] = []
    monkeypatch.setattr(command, "all_maps", lambda quick: ())
    monkeypatch.setattr(command, "compile_in_fresh_process", compiled.extend)
    monkeypatch.setattr(command, "call_isolated", lambda what, *_: compiled.append(what))
    command.run_stress(only="fuzz", out=tmp_path)
    assert {warm_up_choices, warm_up_kernels} <= {*compiled}


@pytest.mark.parametrize(
    ("given", "ignored"),
    [
        (("stress", "--peers", "--quick"), "--peers --quick"),
        (("stress", "--peers", "--only", "fuzz"), "--peers --only fuzz"),
        (("bench", "--skips", "--resume"), "--skips --resume"),
        (("bench", "--peers", "--resume"), "--peers --resume"),
    ],
)
def test_options_that_would_be_ignored_are_refused(
    given: tuple[str, ...], ignored: str, tmp_path: Path, fingertap: Run
) -> None:
    assert ignored in fingertap(*given, "--out", tmp_path).refusal
    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures("figures_kept")
def test_a_cell_has_its_answers_colour_at_its_place(tmp_path: Path) -> None:
    """All answers in their order from left to right below, and in the other order above."""
    whole = next(m for m in hcm_maps(quick=True) if m.name == "stiffness-step")
    along = tuple(float(x) for x in range(len(Answer)))
    wanted = replace(whole, axes={"x": along, "y": (4.0, 5.0)})
    answers = [*Answer], [*reversed(Answer)]
    draw_map(tmp_path / "m.png", wanted, [{"answer": a} for row in answers for a in row], "")
    axis = plt.gcf().axes[0]
    assert (axis.get_xlabel(), axis.get_ylabel()) == ("x", "y")
    (image,) = axis.images
    assert image.origin == "lower"
    colors = [[to_rgba(COLORS[answer]) for answer in row] for row in answers]
    np.testing.assert_allclose(image.to_rgba(image.get_array()), colors)


def test_what_mostly_limits_a_map_leaves_out_both_ends() -> None:
    """The middle eighteen of twenty cells are those of 5: two lie elsewhere."""
    assert _where("a size (m)", range(10), [0, *[5] * 18, 9]) == "a size 5"
