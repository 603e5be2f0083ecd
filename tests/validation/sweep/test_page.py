"""What a sweep's page says of numbers that are known."""

import math
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
from scipy.stats import qmc

from tests.validation.sweep.plans import PLAN, written
from validation.sweep import dataset, page
from validation.sweep.dataset import Output, Pair
from validation.sweep.figures import draw_map
from validation.sweep.page import (
    command,
    endings,
    outputs,
    pairs,
    sensitivities,
    table,
    variables,
    worst,
    write_report,
)
from validation.sweep.plan import Plan, read_plan
from validation.sweep.points import PointTable, points_of

MODELS = '["hcm", { model = "hcm", variant = "b" }, "fem3d"]'
PEAKS = (100.0, 50.0, 200.0, 80.0)
OFF = (0.01, -0.03, 0.0, 0.5)  # of the first model, relative


def swept(tmp_path: Path, models: str = MODELS) -> tuple[Plan, PointTable, xarray.Dataset]:
    """Four scenes: hcm is off by `OFF`, its variant by nothing; on the last one fem3d failed."""
    plan = read_plan(written(tmp_path, PLAN.replace('["hcm"]', models)))

    def run(peak: float, status: str = "COMPLETED") -> dataset.SweepResult:
        summary = {"peak_normal_force_N": peak, "tip_velocity_at_contact_m_per_s": [1.0, -2.0]}
        errors = {
            "peak_normal_force_N": 1.0,
            "contact_time_s": None,
            "tip_velocity_at_contact_m_per_s": [None, 0.1],
        }
        return dataset.solved(
            {"status": status, "message": "", "processor": "", "spent_s": 1.0,
             "summary": summary, "errors": errors}
        )  # fmt: skip

    rows = [
        [run(peak * (1 + off)), run(peak), run(peak, "COMPLETED" if off < 0.5 else "UNBALANCED")]
        for peak, off in zip(PEAKS, OFF, strict=True)
    ]
    points = points_of(plan)
    return plan, points, dataset.build(plan, points, rows)


def test_reduced_models_are_compared_with_references(tmp_path: Path) -> None:
    plan, _, data = swept(tmp_path)
    chosen = pairs(plan)
    assert [(pair.own, pair.base) for pair in chosen] == [(0, 2), (1, 2)]
    row = table(data, chosen)[0]
    assert row["models"] == "hcm against fem3d"
    assert row["scenes"] == 3
    assert row["median (%)"] == pytest.approx(1.0)
    assert row["largest (%)"] == pytest.approx(3.0)
    assert row["bias (%)"] == pytest.approx(-2.0 / 3.0)
    assert row["within 2 % (%)"] == pytest.approx(200.0 / 3.0)
    assert row["within 5 % (%)"] == 100.0
    # by 1, 1.5 and 0 N, where both state 1 N: sqrt(2) together
    assert row["beyond both stated errors (%)"] == pytest.approx(100.0 / 3.0)


def test_models_that_state_no_errors_are_not_beyond_them(tmp_path: Path) -> None:
    plan, _, data = swept(tmp_path)
    name = "peak_normal_force_N_error"
    (row, *_) = table(data.assign({name: data[name] * [1.0, 1.0, np.nan]}), pairs(plan))
    assert row["scenes"] == 3
    assert "beyond both stated errors (%)" not in row
    # an error that is not known says as little: the first scene alone, whose 1 N lies within
    (row, *_) = table(data.assign({name: data[name] * [1.0, 1.0, np.inf]}), pairs(plan))
    assert "beyond both stated errors (%)" not in row


def test_a_table_shows_what_any_of_its_rows_has(tmp_path: Path) -> None:
    plan, points, data = swept(tmp_path)
    status = data["status"].copy(data=data["status"].values)
    status[:, 0] = "REFUSED"  # the first pair has no scene, the second has three
    page = write_report(tmp_path, plan, points, data.assign(status=status)).read_text()
    assert "<th>95 of 100 below (%)</th>" in page


def test_a_report_of_fewer_models_leaves_no_table_of_more(tmp_path: Path) -> None:
    plan, points, data = swept(tmp_path)
    page = write_report(tmp_path, plan, points, data).read_text()
    assert (
        "3 % at most; of the 3 with stated errors 33 % differ by more than these together." in page
    )
    assert "<th>surface.friction first</th>" in page or "material.youngs_modulus" in page
    assert "youngs modulus" not in page
    assert (tmp_path / "worst-1.csv").exists()
    fewer = read_plan(written(tmp_path))
    write_report(tmp_path, fewer, points, data.isel(model=[0]))
    kept = {path.name for path in tmp_path.iterdir()}
    assert not {name for name in kept if name.startswith(("parity", "worst", "differences"))}
    assert "map-0.png" in kept


def test_the_page_says_what_is_not_drawn_and_why_there_are_no_indices(tmp_path: Path) -> None:
    plan, points, data = swept(tmp_path, MODELS.replace('"b"', '"$x^$"'))
    tip = [f"tip.{name}" for name in ("restitution", "tangential_ratio", "normal_stiffness")]
    others = ["finger.length", "material.density", "material.poisson_ratio", "surface.incline"]
    many = {key: [0.3, 0.31, 0.32, 0.33] for key in (*others, *tip)}
    every = PointTable({**points.columns, **many})
    page = write_report(tmp_path, plan, every, data).read_text()
    assert "Only the first 8 variables are drawn, not tip.normal_stiffness." in page
    assert "None: they need 10 completed points a variable, and numbers that differ." in page


def test_without_a_reference_the_first_model_is_one(tmp_path: Path) -> None:
    _, points, data = swept(tmp_path)
    plan = read_plan(written(tmp_path, PLAN.replace('["hcm"]', MODELS.replace(', "fem3d"', ""))))
    assert [(pair.own, pair.base) for pair in pairs(plan)] == [(1, 0)]
    plan = read_plan(written(tmp_path))
    assert pairs(plan) == []
    found = next(outputs(plan, data, []))
    assert found.values[:3] == pytest.approx(np.array(PEAKS[:3]) * (1 + np.array(OFF[:3])))
    assert not found.signed
    assert set(variables(points)) == {"surface.friction", "material.youngs_modulus"}


def test_lists_and_words_are_variables_too(tmp_path: Path) -> None:
    """Lists were told apart by their last component: others vanished, the rest took their share."""
    found = variables(
        PointTable(
            {
                "drive.torques": [[0, 0, 0], [0.01, 0, 0], [0, 0, 0]],
                "finger.length": [[1, 2], [2, 1], [2, 2]],
                "solver.hcm.assumptions": ["paper", "refined", "paper"],
                "material.youngs_modulus": [1e8, 2e8, 1e8],
                "surface.friction": [0.5, 0.5, 0.5],
                "tip.restitution": [1, 1.0, 0.5],
                "gravity": [0.0, -0.0, 9.81],
            }
        )
    )
    assert {name: column.tolist() for name, column in found.items()} == {
        "drive.torques": [0.0, 0.01, 0.0],
        "finger.length, by its first appearance": [1, 2, 3],
        "solver.hcm.assumptions, by its first appearance": [1, 2, 1],
        "material.youngs_modulus": [1e8, 2e8, 1e8],
        "tip.restitution": [1.0, 1.0, 0.5],
        "gravity": [0.0, 0.0, 9.81],
    }
    draw_map(tmp_path / "map.png", found, Output("peak Fn", "peak Fn (N)", np.ones(3), False))
    assert (tmp_path / "map.png").exists()


def test_the_worst_scene_comes_first_with_its_command(tmp_path: Path) -> None:
    plan, points, data = swept(tmp_path)
    rows = list(worst(plan, points, data, Pair(0, 2, "")))
    assert [row["scene"] for row in rows] == [1, 0, 2]
    said = data["message"].astype(object).copy()
    said.values[1] = ["it is wet", "not compared", "it is coarse"]
    told = worst(plan, points, data.assign(message=said), Pair(0, 2, ""))
    doubts = [row["what the runs caution against"] for row in told]
    assert doubts == [f"{plan.solvers[0].label}: it is wet; fem3d: it is coarse", "", ""]
    own, base = rows[0]["run again"].split(" && ")
    assert own == f"{command(plan, points, 1, 0)} --out out/own"
    words = shlex.split(base)
    assert words[:5] == ["fingertap", "run", "soft", "--model", "fem3d"]
    # a sweep has fixed settings where its plan asks for no accuracy, `run` does not
    fixed = shlex.split(own)[:7]
    assert fixed == ["fingertap", "run", "soft", "--model", "hcm", "--accuracy", "none"]
    held = read_plan(written(tmp_path, PLAN.replace("[set]", "[set]\n'solver.accuracy' = 0.05")))
    assert "--accuracy" not in command(held, points, 1, 0)
    assert "finger.elements=2" in words
    assert f"surface.friction={points.columns['surface.friction'][1]!r}" in words


def test_the_worst_ten_of_more_are_listed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plan, points, data = swept(tmp_path)
    monkeypatch.setattr(page, "WORST", 2)
    rows = list(worst(plan, points, data, Pair(0, 2, "")))
    assert [row["scene"] for row in rows] == [1, 0]
    assert rows[0]["largest of force, impulse, duration (%)"] == pytest.approx(3.0)


def test_the_page_says_why_most_runs_were_refused(tmp_path: Path) -> None:
    _, _, data = swept(tmp_path)
    status, message = (data[name].astype(object).copy() for name in ("status", "message"))
    status.values[:, 0] = ["REFUSED", "REFUSED", "COMPLETED", "REFUSED"]
    message.values[:, 0] = ["torques = 1.5 N m", "other", "a caution", "torques = 2e-3 N m"]
    told = [*endings(data.assign(status=status, message=message), ["a", "b", "c"])][:2]
    assert told == [
        {"model": "a", "status": "COMPLETED", "scenes": 1},
        {"model": "a", "status": "REFUSED", "scenes": 3, "most often": "torques = 1.5 N m"},
    ]


def test_an_error_that_nobody_knows_is_infinite(tmp_path: Path) -> None:
    _, _, data = swept(tmp_path)
    assert np.isinf(data["tip_velocity_x_m_per_s_error"].values).all()
    assert np.isinf(data["contact_time_s_error"].values).all()
    assert (data["tip_velocity_y_m_per_s_error"].values == 0.1).all()
    assert dataset.solved(None).status == dataset.NOT_SOLVED
    assert math.isnan(dataset.solved(None).spent_s)


def test_what_lies_within_both_errors_together_is_not_beyond(tmp_path: Path) -> None:
    """1.2 N is more than either 1 N, and 25 N of 75 less than 28.3 N, but not so of 50 N."""
    plan, _, data = swept(tmp_path)
    name = "peak_normal_force_N"
    off = data[name].copy(data=[[101.2, 0, 100], [75, 0, 50], [201.5, 0, 200], [1, 0, 1]])
    known = data[name].copy(data=[[1.0] * 3, [20.0] * 3, [1.0] * 3, [1.0] * 3])
    (row, *_) = table(data.assign({name: off, f"{name}_error": known}), pairs(plan))
    assert row["beyond both stated errors (%)"] == pytest.approx(100.0 / 3.0)  # 1.5 N alone


def test_the_pages_lead_counts_runs_and_quotes_medians(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Peaks 1, 3 and 0 % apart; of twelve runs fem3d's last did not complete."""
    told: dict[str, Any] = {}
    for name in ("draw_distribution", "draw_parity", "draw_map"):
        monkeypatch.setattr(page, name, lambda *given: None)
    monkeypatch.setattr(page.page, "write_page", lambda path, name, given: told.update(given))
    plan, points, data = swept(tmp_path)
    write_report(tmp_path, plan, points, data)
    runs, first, *_ = told["lead"]
    assert runs == "11 of 12 runs completed."
    assert "1 % apart in the median of 3 scenes, 3 % at most" in first
    (row, *_) = table(data, pairs(plan))
    # linear between 1 %, below which lies the middle, and 3 %: nine tenths of the way
    assert row["95 of 100 below (%)"] == pytest.approx(2.8)


def test_the_worst_of_a_scene_is_in_percent_of_the_quantity_that_it_names(tmp_path: Path) -> None:
    """Impulses 4 % apart on the first scene alone, beside peaks 1, 3 and 0 % apart."""
    plan, points, data = swept(tmp_path)
    impulse = np.ones(data["peak_normal_force_N"].shape)
    impulse[0, 0] = 1.04
    given = data.assign(normal_impulse_N_s=(("scene", "model"), impulse))
    rows = list(worst(plan, points, given, Pair(0, 2, "")))
    percent = [row["largest of force, impulse, duration (%)"] for row in rows]
    assert percent == pytest.approx([4.0, 3.0, 0.0])
    assert [row["in"] for row in rows[:2]] == ["normal impulse", "peak Fn"]
    # what is drawn over the variables: signed percent, or one model's numbers as tables show them
    peaks, *_ = outputs(plan, given, [Pair(0, 2, "")])
    assert (peaks.short, peaks.signed) == ("difference (%)", True)
    assert peaks.values[:3] == pytest.approx([1.0, -3.0, 0.0])
    _, impulses, *_ = outputs(plan, given, [])
    assert impulses.short == "normal impulse (mN s)"
    assert impulses.values == pytest.approx([1040.0, 1000.0, 1000.0, 1000.0])


def test_a_row_of_indices_tells_first_order_from_total() -> None:
    """y = (x1 - 1/2)(x2 - 1/2): all of its variance is of both together."""
    x = qmc.Sobol(2, rng=np.random.default_rng(3)).random(128)
    values = np.prod(x - 0.5, axis=1)
    values[:2] = np.nan
    (row,) = sensitivities(dict(zip("ab", x.T, strict=True)), [Output("y", "y", values, False)])
    assert row["scenes"] == "126 of 128"
    for name in "ab":
        assert row[f"{name} first"] == pytest.approx(0.0, abs=0.1)
        assert row[f"{name} total"] == pytest.approx(1.0, abs=0.1)
