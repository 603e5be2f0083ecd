"""``fingertap compare``: the differences a setting makes; what skipping the flight adds (slow)."""

import json
import re
from importlib import resources
from pathlib import Path

import pandas as pd
import pytest

from tests.validation.commands import Make, Patch, Run, call
from validation.compare.command import difference_lines, difference_table
from validation.models.adapter import Outcome

HCM = ("compare", "soft", "--model", "hcm")


def column(table: pd.DataFrame, name: str = "difference_percent") -> pd.Series:
    return table.set_index("quantity")[name]


def test_differences_are_relative_to_the_scene_as_it_is(make_record: Make) -> None:
    table = difference_table(make_record(peak=50.0), make_record(peak=51.0, duration=1.9e-4))
    percent = column(table)
    assert percent["peak_normal_force_N"] == pytest.approx(2.0)
    assert percent["peak_tangential_force_N"] == pytest.approx(2.0)  # larger in magnitude
    assert percent["contact_duration_s"] == pytest.approx(-5.0)
    assert percent["contact_time_s"] == 0.0
    assert str(percent["tip_velocity_y_m_per_s"]) == "0.0"  # of a negative number, not "-0.0"
    assert column(table, "scene")["tip_velocity_y_m_per_s"] == -1.65
    assert "elements" not in percent  # hcm has none


def test_stated_errors_stand_beside_the_difference(make_record: Make) -> None:
    errors = {"peak_normal_force_N": 0.5, "contact_time_s": float("inf")}
    table = difference_table(make_record(peak=50.0, errors=errors), make_record(errors=errors))
    # after 64 +- 0.5, before 50 +- 0.5: 63.5/50.5 and 64.5/49.5 of it
    assert column(table, "error_percent")["peak_normal_force_N"] == pytest.approx(2.28)
    assert column(table, "error_percent")["contact_time_s"] == float("inf")
    assert pd.isna(column(table, "error_percent")["contact_duration_s"])
    assert "error_percent" not in difference_table(make_record(errors=errors), make_record())
    both = [make_record(errors={"contact_duration_s": 4e-6}) for _ in range(2)]
    percent = column(difference_table(*both), "error_percent")
    # 2 % of 0.2 ms each, though the duration is shown in us
    assert percent["contact_duration_s"] == pytest.approx(4.0)


def test_equal_numbers_are_told_of_taps_alone(make_record: Make) -> None:
    """Runs that do not touch have none that a change could move."""
    for touches in (True, False):
        both = [make_record() for _ in range(2)]
        for record in both:
            if not touches:
                record.summary["contact_time_s"] = None
        said = list(difference_lines(*both, difference_table(*both)))
        assert any("no number differs" in line for line in said) is touches


def test_what_a_run_lacks_is_empty(make_record: Make) -> None:
    lacking = make_record()
    lacking.summary["peak_normal_force_N"] = None
    table = difference_table(make_record(), lacking)
    assert pd.isna(column(table)["peak_normal_force_N"])
    assert column(table, "scene")["peak_normal_force_N"] == 64.0


@pytest.fixture
def fake_runs(monkeypatch: Patch, make_record: Make) -> None:
    """A model whose peak is the friction coefficient's hundredfold, and fails without friction."""

    def solve(scene, model, folder, progress, checkpoint):  # type: ignore[no-untyped-def]
        friction = scene.tables.surface.friction
        ok = friction > 0
        message = "it is wet" * (friction > 0.5) if ok else "slid away; add friction"
        status = "COMPLETED" if ok else "NEWTON_FAILED"
        return Outcome(make_record(peak=100 * friction, ok=ok, status=status, message=message))

    monkeypatch.setattr("validation.runs.command.solve", solve)


@pytest.mark.usefixtures("fake_runs")
def test_both_runs_and_the_table_are_kept(tmp_path: Path, fingertap: Run) -> None:
    ended = fingertap(*HCM, "--set", "surface.friction=0.6", "--out", tmp_path)
    assert ended.code == 0
    assert re.search(r"peak Fn +50 N +60 N +20 %", ended.out)
    assert "no number differs" not in ended.out
    assert ended.err == "fingertap: caution: changed: it is wet\n"
    (folder,) = (tmp_path / "compare").iterdir()
    assert folder.name == "soft-hcm-surface.friction=0.6"
    table = pd.read_csv(folder / "differences.csv")
    assert column(table)["peak_normal_force_N"] == pytest.approx(20.0)
    assert all((folder / which / "summary.json").is_file() for which in ("scene", "changed"))
    as_json = fingertap(*HCM, "--set", "surface.friction=0.6", "--out", tmp_path, "--json")
    assert as_json.err.endswith(ended.err)
    printed = json.loads(as_json.out)
    assert printed["changes"] == ["surface.friction=0.6"]
    percent = {row["quantity"]: row["difference_percent"] for row in printed["differences"]}
    assert percent["peak_normal_force_N"] == pytest.approx(20.0)


@pytest.mark.usefixtures("fake_runs")
def test_a_key_that_the_model_does_not_read_is_told(tmp_path: Path, fingertap: Run) -> None:
    ended = fingertap(*HCM, "--set", "material.poisson_ratio=0.41", "--out", tmp_path)
    assert (ended.code, "no number differs: hcm may not use" in ended.out) == (0, True)


def test_no_number_has_more_digits_than_its_error_leaves(make_record: Make) -> None:
    errors = {"peak_normal_force_N": 0.5}
    runs = make_record(peak=50.123, errors=errors), make_record(peak=50.1, errors=errors)
    lines = difference_lines(*runs, difference_table(*runs))
    (line,) = (one.strip() for one in lines if "peak Fn  " in one)
    assert re.split(" {2,}", line) == ["peak Fn", "50.1 +- 0.5 N", "50.1 +- 0.5 N", "0.0 +- 2.0 %"]


@pytest.mark.usefixtures("fake_runs")
def test_a_failed_run_and_nothing_to_change(tmp_path: Path, fingertap: Run) -> None:
    ended = fingertap(*HCM, "--set", "surface.friction=0", "--out", tmp_path)
    assert ended.code == 1
    assert "compare soft, changed: slid away; add friction; partial results are in " in ended.err
    assert re.search(r"^  no results of +a run that is NEWTON_FAILED$", ended.out, re.MULTILINE)
    given = (*HCM, "--set", "surface.friction=0", "--out", tmp_path, "--json")
    statuses = json.loads(fingertap(*given).out)["status"]
    assert statuses == {"scene": "COMPLETED", "changed": "NEWTON_FAILED"}
    ended = fingertap(*HCM, "--out", tmp_path)
    assert ended.code == 2
    assert "nothing to change; give --set KEY=VALUE" in ended.err
    ended = fingertap(*HCM, "--set", "surface.friction=0.50", "--out", tmp_path)
    assert ended.code == 2
    assert "--set surface.friction=0.50: the scene has that already" in ended.err


def test_both_runs_are_held_to_an_accuracy(tmp_path: Path, fingertap: Run) -> None:
    given = (*HCM, "--set", "surface.friction=0.6", "--accuracy", "1e-2")
    ended = fingertap(*given, "--out", tmp_path)
    assert ended.code == 0
    (folder,) = (tmp_path / "compare").iterdir()
    for which in ("scene", "changed"):
        summary = json.loads((folder / which / "summary.json").read_text())
        assert summary["accuracy"]["wanted"] == 1e-2
    ended = fingertap(*given, "--set", "solver.accuracy=1e-3", "--out", tmp_path)
    assert (ended.code, "two accuracies; leave one out" in ended.err) == (2, True)


@pytest.mark.usefixtures("fake_runs")
def test_finished_runs_are_read_back(tmp_path: Path, fingertap: Run) -> None:
    """The scene as it is, too, for another change: a pair that was stopped goes on."""
    changes = ("surface.friction=0.6", "surface.friction=0.6", "surface.friction=0.7")
    said = [fingertap(*HCM, "--set", one, "--out", tmp_path).err for one in changes]
    assert [text.count("has this run") for text in said] == [0, 2, 1]
    fresh = fingertap(*HCM, "--set", changes[0], "--out", tmp_path, "--fresh")
    assert "has this run" not in fresh.err


# Measured, in percent. The flight: on the fast mesh, the whole 0.134 s by 155,000 explicit steps in
# about a minute; the finger's elastic vibration in flight is all that is left out. The holes: 3.5 %
# of the mass are gone, from the hinges; some of it is the coarse mesh, whose nodes meet the surface
# elsewhere: on the ls-dyna-like one the peak changes by +0.35 %, the impulse by -0.62 %, the
# duration by +0.17 %, the time of contact by -0.10 %.
FLIGHT = {
    "contact_time_s": 3.2e-5, "tip_velocity_x_m_per_s": 0.0062, "tip_velocity_y_m_per_s": 0.0040,
    "peak_normal_force_N": -0.017, "normal_impulse_N_s": -0.011, "contact_duration_s": 0.0,
}  # fmt: skip
# Of a duration, which is whole steps: round-off decides which is the last.
A_STEP = 0.25
HOLES = {"contact_time_s": -0.102, "peak_normal_force_N": 1.26, "normal_impulse_N_s": -0.51,
         "contact_duration_s": 1.32}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "measured", "absolute", "relative"),
    [
        ("solver.fem.flight=explicit", FLIGHT, 0.01, 0.3),
        ("solver.fem.shaft_radius=2.5e-3", HOLES, 0.05, 0.2),
    ],
    ids=["skipping the flight", "holes for shafts"],
)
def test_what_a_shortcut_changes(
    change: str, measured: dict[str, float], absolute: float, relative: float, tmp_path: Path
) -> None:
    text = resources.files("validation.scenes").joinpath("soft.toml").read_text("utf-8")
    scene = tmp_path / "fast.toml"
    scene.write_text(f'{text}\n[solver.fem]\npreset = "fast"\n', encoding="utf-8")
    assert call("compare", scene, "--model", "fem3d", "--set", change, "--out", tmp_path) == 0
    (path,) = (tmp_path / "compare").glob("*/differences.csv")
    percent = column(pd.read_csv(path))
    for quantity, value in measured.items():
        allowed = absolute + relative * abs(value)
        allowed += A_STEP if quantity == "contact_duration_s" else 0.0
        assert percent[quantity] == pytest.approx(value, abs=allowed), quantity
