"""Stated errors on their way from a run to the terminal, JSON and a store."""

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest

from tests.validation.commands import Make, Run
from validation.harness.console import summary_text
from validation.harness.quantities import ESTIMATED
from validation.harness.stored_run import read_record, write_record
from validation.harness.uncertainty import two_digits, with_error

ERRORS = {
    "contact_time_s": math.inf,
    "tip_velocity_at_contact_m_per_s": (0.012, math.inf),
    "peak_normal_force_N": 0.3217,
}


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (95.1523, 0.4, "95.2 +- 0.4"),
        (95.1523, 0.41, "95.2 +- 0.5"),  # never smaller than it is
        (95.1523, 0.123, "95.15 +- 0.13"),
        (95.1523, 17.0, "95 +- 17"),
        (95.1523, 430.0, "100 +- 500"),
        (1234567.0, 2.5, "1234570 +- 10"),
        (-2.239, 0.05, "-2.24 +- 0.05"),
        (136.1070001, 1e-9, "136.107 +- 0.001"),  # six digits, and the error no smaller
        (95.1523, math.inf, "95.2 +- ?"),
        (95.1523, None, "95.1523"),
        (95.1523, 0.0, "95.1523"),
        (95.1523, 1e-310, "95.1523"),  # a power of ten beyond floating point
        (0.0, 0.02, "0.00 +- 0.02"),
        (99.97, 0.0999999999999, "99.97 +- 0.10"),
        (1.26248e-9, 4.3e-13, "1.2625e-09 +- 5e-13"),
        (7.2184e7, 3.9e4, "7.218e+07 +- 4e+04"),
        (7.2184e7, 1.23e6, "7.22e+07 +- 1.3e+06"),
        (-0.0, None, "0"),
        (-0.0, math.inf, "0 +- ?"),
        (-3e-6, 2e-7, "-3.0e-06 +- 2e-07"),
        (0.0, 2e-7, "0e+00 +- 2e-07"),
        (2e-9, 4.1e-6, "0e+00 +- 5e-06"),
    ],
)
def test_an_error_decides_the_digits(value: float, error: float | None, text: str) -> None:
    assert with_error(value, error) == text


def test_numbers_without_an_error_have_digits_of_their_own(make_record: Make) -> None:
    assert [with_error(v, None, 3) for v in (0.00130786, 969.167, 2286.4)] == [
        "0.00131", "969", "2290"
    ]  # fmt: skip
    record = make_record()
    shown = summary_text(replace(record, summary={**record.summary, "wall_time_s": 0.0123456}))
    assert "  solve time                     0.0123 s\n" in shown


def test_how_large_something_is_needs_no_power_of_ten() -> None:
    values = (0.526, 9.96, 155.1, 2286.0)
    assert [two_digits(value) for value in values] == ["0.53", "10", "160", "2300"]


def test_the_terminal_and_json_show_errors(make_record: Make) -> None:
    record = make_record(errors=ERRORS)
    text = summary_text(record)
    assert "  time of first contact          136 +- ? ms\n" in text
    assert "  tip velocity at contact        1.800 +- 0.012, -1.65 +- ? m/s\n" in text
    assert "  peak Fn                        64.0 +- 0.4 N\n" in text
    assert "  contact duration               200 us\n" in text
    printed = record.to_json()["error_estimates"]
    assert json.loads(json.dumps(printed, allow_nan=False)) == {
        "contact_time_s": None,
        "tip_velocity_at_contact_m_per_s": [0.012, None],
        "peak_normal_force_N": 0.3217,
    }
    assert make_record().to_json()["error_estimates"] == {}


@pytest.mark.parametrize("errors", [ERRORS, {}])
def test_errors_are_read_back_as_they_were(
    errors: dict[str, object], make_record: Make, tmp_path: Path
) -> None:
    write_record(tmp_path, make_record(errors=errors))
    assert read_record(tmp_path).errors == errors


@pytest.mark.parametrize("model", ["hcm", "fem2d", "fem3d"])
def test_every_model_states_the_errors_of_its_main_numbers(model: str, fingertap: Run) -> None:
    coarse = ("--set", "solver.fem.preset=fast")
    printed = json.loads(fingertap("run", "soft", "--model", model, "--json", *coarse).out)
    assert set(printed["error_estimates"]) == set(ESTIMATED)
    assert None not in printed["error_estimates"].values()


def test_no_estimate_leaves_them_out(fingertap: Run) -> None:
    ended = fingertap("run", "soft", "--model", "hcm", "--json", "--no-estimate")
    assert ended.code == 0
    assert json.loads(ended.out)["error_estimates"] == {}
    ended = fingertap("run", "soft", "--model", "hcm", "--set", "solver.hcm.estimate=3")
    assert "solver.hcm.estimate" in ended.refusal
