"""Stated errors against true ones: random scenes, how two solves are compared, what is counted."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib import pyplot as plt

from validation.errors import UserError
from validation.harness.figures import GREY, ORANGE
from validation.harness.record import RunRecord
from validation.scenes.load import load_scene
from validation.studies.calibration.command import calibrate
from validation.studies.calibration.report import (
    ACCURACY_QUANTITIES,
    Row,
    accuracy_kept,
    draw,
    misses,
    numbers_of,
    table,
    write_report,
)
from validation.studies.calibration.scenes import KINDS, case
from validation.studies.calibration.solves import solve_case
from validation.studies.stated_errors import true_errors

RUN = RunRecord(
    "soft", "hcm", "", "COMPLETED", True, "",
    {"peak_normal_force_N": 100.0, "tip_velocity_at_contact_m_per_s": (3.0, -4.0),
     "contact_time_s": 0.1, "normal_impulse_N_s": None},
    {"peak_normal_force_N": 1.0, "tip_velocity_at_contact_m_per_s": (0.1, 0.2)},
)  # fmt: skip


@pytest.mark.parametrize("model", ["hcm", "fem3d"])
def test_cases_are_scenes_by_turns_and_start_as_they_say(model: str) -> None:
    cases = [case(model, number) for number in range(120)]
    assert cases == [case(model, number) for number in range(120)]
    assert [c.kind for c in cases] == list(KINDS) * 30
    for c in cases:
        tables = load_scene("soft", c.overrides).tables
        assert any(tables.torque_rows[0]) == (c.kind == "driven")
        assert (tables.start_state is not None) == (c.kind == "tilted")


def test_what_two_solves_differ_by() -> None:
    """By the velocity's components over the speed; what the tight solve lacks is infinitely off."""
    tight = RUN.with_summary(peak_normal_force_N=102.5)
    found = true_errors(RUN.summary, RUN.errors, tight.summary)
    assert found["peak_normal_force_N"] == (1.0, 2.5, 100.0)
    assert found["tip_velocity_y_m_per_s"] == (0.2, 0.0, 5.0)
    assert set(found) == {"peak_normal_force_N", "tip_velocity_x_m_per_s", "tip_velocity_y_m_per_s"}
    gone = true_errors(RUN.summary, RUN.errors, RUN.with_summary(peak_normal_force_N=None).summary)
    assert gone["peak_normal_force_N"].true == math.inf
    without = RUN.with_summary(peak_normal_force_N=None).summary
    lost = true_errors(without, {}, RUN.summary)
    assert lost["peak_normal_force_N"].true == math.inf
    unknown = RUN.with_summary(peak_normal_force_N=math.nan).summary
    assert true_errors(RUN.summary, RUN.errors, unknown)["peak_normal_force_N"].true == math.inf


def rows(*numbers: tuple[float, float], caution: str = "", doubt: str = "") -> list[Row]:
    """A scene for each pair of stated and true error of a peak of 100 N."""
    return [
        (n, case("hcm", n), {"status": "COMPLETED", "tight_status": "COMPLETED",
                             "caution": caution, "tight_caution": doubt,
                             "numbers": {"peak": (*pair, 100.0)}})
        for n, pair in enumerate(numbers)
    ]  # fmt: skip


COUNTS: list[tuple[list[Row], int, int]] = [
    (rows((1.0, 1.99)), 0, 0),
    (rows((1.0, 2.1)), 1, 1),
    (rows((1.0, 2.1), caution="estimated errors beyond 1 %"), 1, 0),
    (rows((1.5, 2.5)), 0, 1),
    (rows((0.0, 0.0009)), 0, 0),  # below what the tight solve knows
    (rows((math.inf, 50.0), (1.0, math.inf)), 1, 2),
]


@pytest.mark.parametrize(("found", "missed", "silent"), COUNTS)
def test_what_is_missed_and_what_is_silent(found: list[Row], missed: int, silent: int) -> None:
    counted = table(numbers_of(found))[-1]
    assert counted["numbers"] == len(found)
    assert counted["more than 2 stated errors off"] == missed
    assert counted["2 % wrong and silent"] == silent


def test_tight_solves_with_a_caution_are_counted_apart() -> None:
    judged = {row["quantity"]: row for row in table(numbers_of(
        [*rows((1.0, 1.0), (1.0, 5.0)), *rows((1.0, 5.0), doubt="it touches elsewhere")]
    ))}  # fmt: skip
    expected = {"all": (3, 2), "judged without a caution": (2, 1), "of scenes: driven": (1, 1)}
    for name, (number, missed) in expected.items():
        assert judged[name]["numbers"] == number
        assert judged[name]["more than 2 stated errors off"] == missed


def test_runs_that_say_they_fall_short_are_counted_apart() -> None:
    """Four at 1e-2: kept, far off and said so, far off in silence, judged by a doubtful solve."""

    def row(number: int, error: float, expected: float | None, doubt: str = "") -> Row:
        numbers = dict.fromkeys(ACCURACY_QUANTITIES, (0.0, error, 1.0))
        result = {"status": "COMPLETED", "numbers": numbers, "expected": expected, "caution": "",
                  "tight_caution": doubt, "seconds": (1.0, 1.0)}  # fmt: skip
        return number, case("hcm", number, 1e-2), result

    found = [row(0, 5e-3, 8e-3), row(1, 0.05, 0.06), row(4, 0.04, None), row(5, 0.02, 0.0, "?")]
    by = {entry["scenes"]: entry for entry in accuracy_kept(found)}
    assert list(by) == ["falls", "driven", "judged without a caution", "all"]
    shares = {name: (entry["number"], round(entry["within (%)"]), entry["beyond 3 times"],
                     entry["say they keep it"], round(entry["of these within (%)"]),
                     entry["of these beyond 3 times"]) for name, entry in by.items()}  # fmt: skip
    assert shares == {
        "falls": (2, 50, 1, 2, 50, 1),
        "driven": (2, 0, 1, 1, 0, 0),
        "judged without a caution": (3, 33, 2, 2, 50, 1),
        "all": (4, 25, 2, 3, 33, 1),
    }


def test_the_report_names_scenes_that_can_be_run_again(tmp_path: Path) -> None:
    found = rows((1.0, 5.0), (1.0, 0.5))
    listed = misses(numbers_of(found))
    assert [row["scene"] for row in listed] == [0]
    assert tuple(listed[0]["overrides"].split("; ")) == case("hcm", 0).overrides
    line = write_report(tmp_path, "hcm", found, {"peak": "peak force"})
    assert "2 numbers: 1 (50 %) more than 2 times" in line
    page = (tmp_path / "hcm.html").read_text(encoding="utf-8")
    assert "Stated against true errors" in page
    assert "data:image/svg+xml" in page
    write_report(tmp_path, "hcm", [], {"peak": "peak force"})


def test_a_scene_of_each_outcome() -> None:
    sound = case("hcm", 4)
    found = solve_case(sound)
    assert (found.status, found.tight_status) == ("COMPLETED", "COMPLETED")
    assert len(found.numbers) == 9
    for stated, true, _ in found.numbers.values():
        assert true <= 2.0 * stated
    high = replace(sound, overrides=(*sound.overrides, "drive.gravity=-9.8"))
    assert solve_case(high).numbers == {}
    broken = replace(sound, overrides=(*sound.overrides, "finger.length=-1"))
    assert solve_case(broken).status == "REFUSED"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"scenes": 0}, "--scenes 0 --first 0: must be 1 or more"),
        ({"scenes": 3, "quick": True}, "--quick --scenes 3: two numbers of scenes; leave one out"),
        ({"model": "fem3d", "accuracy": 5e-3}, "--accuracy 0.005: must be 0.0067 or more"),
    ],
)
def test_no_or_two_numbers_of_scenes_are_refused(
    arguments: dict[str, Any], said: str, tmp_path: Path
) -> None:
    with pytest.raises(UserError, match=said):
        calibrate(out=tmp_path, **arguments)


@pytest.mark.parametrize("accuracy", [math.nan, 7.0, -1.0])
def test_an_accuracy_that_no_run_can_keep_is_refused(accuracy: float, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"solver\.accuracy = .*: must be"):
        calibrate(scenes=1, accuracy=accuracy, out=tmp_path)
    assert not list(tmp_path.iterdir())


def test_the_worst_miss_comes_first_in_percent() -> None:
    """Relative errors of 100 N: 1 and 5 %, 0.5 and 20 %."""
    listed = misses(numbers_of(rows((1.0, 5.0), (0.5, 20.0))))
    shown = [[row[name] for name in ("scene", "stated (%)", "true (%)")] for row in listed]
    assert shown == [pytest.approx([1, 0.5, 20.0]), pytest.approx([0, 1.0, 5.0])]


def test_medians_are_of_stated_over_true() -> None:
    found = table(numbers_of(rows((2.0, 1.0), (4.0, 1.0), (3.0, 0.5))))[-1]
    assert found["stated / true, median"] == pytest.approx(4.0)
    assert found["true error, median (%)"] == pytest.approx(1.0)


def test_a_run_keeps_its_accuracy_in_the_worst_of_its_numbers() -> None:
    names = list(ACCURACY_QUANTITIES)
    numbers = dict.fromkeys(names, (0.0, 1e-3, 1.0)) | {names[-1]: (0.0, 0.05, 1.0)}
    result = {"status": "COMPLETED", "numbers": numbers, "expected": None, "caution": "",
              "tight_caution": "", "seconds": (1.0, 1.0)}  # fmt: skip
    found = accuracy_kept([(0, case("hcm", 0, 1e-2), result)])[-1]
    assert (found["within (%)"], found["largest"]) == pytest.approx((0.0, 5.0))


@pytest.mark.usefixtures("figures_kept")
def test_true_errors_are_drawn_over_stated_ones_and_misses_stand_out(tmp_path: Path) -> None:
    found = numbers_of(rows((1.0, 1.5), (1.0, 5.0), (math.inf, 1.0)))
    draw(tmp_path / "c.png", found, {"peak": "peak force"})
    same, twice, kept, missed = plt.gcf().axes[0].lines
    for line, times in ((same, 1.0), (twice, 2.0)):
        assert line.get_ydata() == pytest.approx(times * line.get_xdata())
    assert kept.get_xydata() == pytest.approx(np.array([[0.01, 0.015], [10.0, 0.01]]))
    assert missed.get_xydata() == pytest.approx(np.array([[0.01, 0.05]]))
    assert (kept.get_color(), missed.get_color()) == (GREY, ORANGE)
    # falls and driven, and the third scene, tilted, whose error is not known
    counted = {row["quantity"]: row for row in table(found)}
    shares = [counted[f"of scenes: {kind}"]["share (%)"] for kind in KINDS[:3]]
    assert shares == [0.0, 100.0, 0.0]
    assert counted["all"]["share (%)"] == pytest.approx(100.0 / 3.0)
    assert counted["all"]["nothing stated"] == 1
