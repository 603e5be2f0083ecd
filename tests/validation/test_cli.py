import json
import os
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.processes import COMMAND, ROOT, python, started
from tests.validation.commands import Capture, Make, Patch, Run, Use
from validation.errors import RunFailedError, UserError
from validation.harness.console import say_error
from validation.harness.quantities import SOLID_KEYS, SUMMARY_KEYS

HCM = ("run", "soft", "--model", "hcm")


def read(text: str) -> dict[str, Any]:
    """JSON proper: without NaN and infinity."""
    found: dict[str, Any] = json.loads(text, parse_constant=lambda name: pytest.fail(name))
    return found


def test_json_is_the_contracts_object_and_nothing_else(
    fake_model: Use, fingertap: Run, tmp_path: Path, monkeypatch: Patch
) -> None:
    monkeypatch.chdir(tmp_path)
    fake_model()
    ended = fingertap(*HCM, "--json")
    assert (ended.code, ended.err) == (0, "")
    assert ended.out.startswith("{")
    result = read(ended.out)
    assert tuple(result) == ("scene", "model", *SUMMARY_KEYS, "error_estimates")
    assert result["scene"] == "soft"
    assert result["reverse_slip"] is False
    assert result["peak_memory_MB"] > 10  # of this process, Python and numpy alone need more
    assert list(tmp_path.iterdir()) == []


def test_a_run_says_what_an_accuracy_chose(
    fake_model: Use, make_record: Make, fingertap: Run, tmp_path: Path
) -> None:
    """On the terminal, in JSON, and when it is read back."""
    choice = {"setting": "flight", "value": "rigid", "reason": "skipped: 0.0008 of the tap"}
    held = {"wanted": 1e-3, "expected": 4e-4, "choices": [choice]}
    fake_model(replace(make_record(), accuracy=held))
    for _ in range(2):
        shown = fingertap(*HCM, "--accuracy", "1e-3", "--out", tmp_path).out
        assert "relative error                 expected 0.0004, wanted 0.001\n" in shown
        assert "    flight                       rigid (skipped: 0.0008 of the tap)\n" in shown
    assert "read back" in shown
    printed = fingertap(*HCM, "--accuracy", "1e-3", "--out", tmp_path, "--json").out
    assert read(printed)["accuracy"] == held


def test_json_has_null_for_what_a_model_does_not_have(
    fake_model: Use, make_record: Make, fingertap: Run
) -> None:
    run = make_record(model="fem3d", variant="fast", ok=False, status="UNSTABLE")
    odd = run.with_summary(peak_stress_R_Pa=float("nan"), energy_residual=float("inf"), steps=None)
    fake_model(odd)
    ended = fingertap("run", "soft", "--model", "fem3d", "--json")
    assert ended.code == 1
    result = read(ended.out)
    assert tuple(result) == ("scene", "model", *SUMMARY_KEYS, *SOLID_KEYS, "error_estimates")
    lacking = ("peak_stress_R_Pa", "energy_residual", "steps")
    assert [result[key] for key in lacking] == [None] * 3
    assert result["elements"] == 4000


def test_a_run_writes_its_files_and_a_readable_table(
    fake_model: Use, fingertap: Run, tmp_path: Path, monkeypatch: Patch
) -> None:
    monkeypatch.chdir(tmp_path)
    fake_model()
    ended = fingertap(*HCM, "--set", "surface.friction=0.7")
    assert ended.code == 0
    folder = tmp_path / "out" / "run" / "soft-hcm"
    files = {"summary.json", "history.nc", "curves.csv", "curves.csv.toml"}
    assert {path.name for path in folder.iterdir()} == files
    assert "peak Fn                        64 N" in ended.out
    assert "contact duration               200 us" in ended.out
    assert str(Path("out/run/soft-hcm")) in ended.out


def test_a_failed_run_keeps_what_it_had(
    fake_model: Use, make_record: Make, fingertap: Run, tmp_path: Path
) -> None:
    fake_model(make_record(ok=False, status="NOT_REACHED", message="the tip went up; push down"))
    ended = fingertap(*HCM, "--out", tmp_path, "--json")
    assert ended.code == 1
    assert json.loads(ended.out)["scene"] == "soft"
    folder = tmp_path / "run" / "soft-hcm"
    assert "the tip went up; push down" in ended.line
    assert str(folder) in ended.line
    assert json.loads((folder / "summary.json").read_text())["status"] == "NOT_REACHED"


def test_a_folder_in_a_files_place_is_named(
    fake_model: Use, make_record: Make, fingertap: Run, tmp_path: Path
) -> None:
    fake_model(make_record())
    taken = tmp_path / "run" / "soft-hcm" / "curves.csv"
    taken.mkdir(parents=True)
    ended = fingertap(*HCM, "--out", tmp_path)
    assert (ended.code, "peak Fn" in ended.out) == (1, True)
    assert f"could not all be written ({taken}: Is a directory)" in ended.line


def test_a_crashing_solver_is_one_line_and_its_trace_is_kept(
    fake_model: Use, make_record: Make, fingertap: Run, tmp_path: Path
) -> None:
    fake_model(make_record())
    assert fingertap(*HCM, "--set", "surface.friction=0.1", "--out", tmp_path).code == 0
    fake_model(error=ZeroDivisionError("a\nb"))
    ended = fingertap(*HCM, "--out", tmp_path)
    assert ended.code == 1
    assert "ZeroDivisionError: a b" in ended.line
    # no other run's numbers beside it
    assert [path.name for path in (tmp_path / "run" / "soft-hcm").iterdir()] == ["error.txt"]
    trace = tmp_path / "run" / "soft-hcm" / "error.txt"
    assert str(trace) in ended.line
    assert "Traceback" in trace.read_text()


@pytest.mark.parametrize(
    ("error", "code"),
    [(UserError("bad"), 2), (RunFailedError("failed"), 1), (KeyboardInterrupt(), 1)],
)
def test_exit_codes(
    fake_model: Use, fingertap: Run, tmp_path: Path, error: BaseException, code: int
) -> None:
    fake_model(error=error)
    ended = fingertap(*HCM, "--out", tmp_path)
    assert (ended.code, ended.err.count("\n")) == (code, 1)


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["run", "sotf", "--model", "hcm"], "did you mean soft?"),
        (["run", "soft", "--model", "abaqus"], "abaqus"),
        (["run", "soft"], "--model"),
        (["run", "--model", "hcm"], "scene"),
        ([*HCM, "--set", "surface.friction=-1"], "surface.friction"),
        ([*HCM, "--set"], "--set"),
        ([*HCM, "--accuracy", "0"], "solver.hcm.accuracy = 0: must be a number, >= 1e-06"),
        ([*HCM, "--accuracy", "50%"], "50%"),
        ([*HCM, "--accuracy", "None"], "solver.hcm.accuracy = 'None': must be a number, >="),
        ([*HCM, "--set", "solver.accuracy=nine"], 'and <= 0.1, or "none"; 1e-3 is 0.1 %'),
        ([*HCM, "--accuracy", "1e-2", "--set", "solver.accuracy=1e-4"], "two accuracies"),
        ([*HCM, "--accuracy", "1e-2", "--set", "solver.hcm={accuracy=1e-4}"], "two accuracies"),
        ([*HCM, "--accuracy", "1e-2", "--set", "solver={hcm={accuracy=1e-4}}"], "two accuracies"),
        ([*HCM, "--accuracy", " "], "--accuracy ' ': is empty"),
        (["run", "/", "--model", "hcm"], "scene '/': cannot be read (is a folder); give the path"),
        (["run", "/dev/null", "--model", "hcm"], "(is not a file); give the path"),
        ([*HCM, "--set", "surface.heigth=0.1"], "did you mean surface.height?"),
        ([*HCM, "--set", "material.elements=3"], "did you mean finger.elements?"),
        ([*HCM, "--colour"], "--colour"),
        (["tap"], "tap"),
        ([*HCM, "--out", "/proc/none"], "/proc/none"),
        ([*HCM, "--out", __file__], "choose a folder"),
        (["validate", "--out", "/proc/none"], "/proc/none"),
    ],
)
def test_bad_input_is_refused_before_anything_runs(
    fake_model: Use, fingertap: Run, arguments: list[str], part: str
) -> None:
    fake_model(error=AssertionError("a solve was started"))
    line = fingertap(*arguments).refusal
    assert part.lower() in line.lower()
    assert "Traceback" not in line


def test_an_error_is_one_line_whatever_its_text(capsys: Capture) -> None:
    say_error("a\nb\n  c")
    assert capsys.readouterr().err == "fingertap: error: a b c\n"


def test_scene_names_stay_inside_the_output_folder(
    fake_model: Use, fingertap: Run, tmp_path: Path
) -> None:
    fake_model()
    odd = tmp_path / "..a b$.toml"
    odd.write_text((ROOT / "validation" / "scenes" / "soft.toml").read_text())
    assert fingertap("run", odd, "--model", "hcm", "--out", tmp_path / "out").code == 0
    (folder,) = (tmp_path / "out" / "run").iterdir()
    assert folder.name.startswith("a_b_-hcm-")  # a digest ends it: other names leave as much


def test_a_process_shows_no_traceback() -> None:
    done = python("-c", COMMAND, *HCM, "--set", "material.poisson_ratio=0.5")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1
    assert "material.poisson_ratio = 0.5" in done.stderr


def test_help_is_light() -> None:
    code = """
import sys
from validation.cli import main
from validation.harness.console import say_error
try:
    main(["--help"])
finally:
    heavy = {"vtk", "vtkmodules", "gmsh", "numba", "pyvista", "numpy", "pydantic", "pandas",
             "matplotlib", "xarray", "hcm", "reference_fem", "meshes"} & set(sys.modules)
    print("HEAVY", sorted(heavy))
"""
    done = python("-c", code, env={"COLUMNS": "100"})
    assert "HEAVY []" in done.stdout
    assert "validate" in done.stdout


def test_a_reader_that_has_seen_enough_ends_a_command_quietly() -> None:
    """As ``| head`` does: nothing is lost, and nothing is wrong."""
    reading, writing = os.pipe()
    os.close(reading)
    command = started("-c", COMMAND, "schema", stdout=writing, stderr=subprocess.PIPE)
    os.close(writing)
    assert (command.communicate(timeout=60)[1], command.returncode) == ("", 0)
