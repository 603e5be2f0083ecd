"""Two commands at once on one folder of results: the second is refused until the first is done."""

import subprocess
from pathlib import Path

import pytest

from tests.processes import started
from tests.validation.commands import Run
from tests.validation.sweep.plans import written
from validation.harness.files import exclusive_folder

HOLD = """
import pathlib, sys
from validation.harness.files import (exclusive_folder)
with exclusive_folder(pathlib.Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""
SOFT_3D = ("soft", "--model", "fem3d")


@pytest.mark.parametrize(
    ("command", "folder"),
    [
        (("sweep",), "sweep/plan"),
        (("run", *SOFT_3D), "run/soft-fem3d"),
        (("render", *SOFT_3D), "run/soft-fem3d"),
        (("render", *SOFT_3D), "render"),
        (("study",), "study"),
        (("calibrate", "--quick"), "calibration"),
        (("stress", "--quick"), "stress/quick"),
        (("stress", "--peers"), "stress"),
        (("compare", *SOFT_3D, "--set", "surface.friction=0"),
         "compare/soft-fem3d-surface.friction=0"),
        (("converge", *SOFT_3D, "--quick"), "converge/soft-fem3d-quick"),
        (("validate", "soft"), "validate"),
        (("waterfall", "soft"), "waterfall/soft"),
        (("evidence", "--quick"), "evidence"),
        (("identify", "contact", "soft"), "identify"),
        (("bench", "--quick"), "bench"),
        (("paper",), "paper"),
    ],
    ids=lambda value: value[0] if isinstance(value, tuple) else "",
)  # fmt: skip
def test_a_second_command_is_refused(
    command: tuple[str, ...], folder: str, tmp_path: Path, fingertap: Run
) -> None:
    """Runs of two scenes were mixed: one's summary beside the other's curves and fields."""
    if command == ("sweep",):
        command = ("sweep", str(written(tmp_path)))
    (tmp_path / folder).mkdir(parents=True)
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with started("-c", HOLD, tmp_path / folder, **pipes) as first:
        assert first.stdout is not None
        assert first.stdout.readline() == "held\n"
        ended = fingertap(*command, "--out", tmp_path)
        first.kill()
    assert ended.code == 2
    assert f"{tmp_path / folder}: another command is writing" in ended.err
    assert {path.name for path in (tmp_path / folder).iterdir()} <= {
        ".in_use", "runs", "figures", "renders"
    }  # fmt: skip
    with exclusive_folder(tmp_path / folder):
        pass
