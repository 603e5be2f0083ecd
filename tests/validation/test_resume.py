"""``fingertap run --resume``: a killed command continues to the result of an undisturbed one."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray

from tests.validation.commands import call, one_line
from validation.cli import main

ROOT = Path(__file__).parents[2]
CODE = "from validation.cli import main; main()"
SCENE = (
    *("run", "soft", "--model", "fem3d"),
    *("--set", "solver.fem.flight=explicit", "--set", "solver.fem.threads=1"),
    *("--set", "surface.height=0.06", "--set", "solver.fem.tip_size=3e-3"),
    *("--set", "solver.fem.section_size=3e-3", "--set", "solver.fem.axial_size=6e-3"),
)
OWN = ("wall_time_s", "peak_memory_MB", "provenance", "statistics")  # of each run, not of the tap


def command(*arguments: str) -> "subprocess.Popen[str]":
    environment = os.environ | {"PYTHONPATH": str(ROOT), "NUMBA_NUM_THREADS": "1"}
    return subprocess.Popen(
        [sys.executable, "-c", CODE, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
    )


def result(out: Path) -> tuple[dict[str, Any], xarray.Dataset]:
    folder = out / "run" / "soft-fem3d"
    summary = json.loads((folder / "summary.json").read_text())
    with xarray.open_dataset(folder / "history.nc", engine="h5netcdf") as history:
        history.load()
    return {key: value for key, value in summary.items() if key not in OWN}, history


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert call(*arguments) == 2
    return one_line(capsys)


def test_killed_command_resumes_to_the_same_bits(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with command(*SCENE, "--out", str(tmp_path / "whole")) as whole:
        _, said = whole.communicate(timeout=120)
    assert whole.returncode == 0
    out = tmp_path / "killed"
    restart = out / "run" / "soft-fem3d" / "restart.npz"
    with command(*SCENE, "--out", str(out)) as killed:
        deadline = time.monotonic() + 60
        while not restart.exists() and time.monotonic() < deadline:
            time.sleep(0.002)
        killed.kill()
    assert killed.returncode == -signal.SIGKILL
    assert not restart.with_name("summary.json").exists()
    left = restart.read_bytes()

    # Another scene does not take it, and leaves it where it is.
    other = ("--set", "surface.friction=0.4", "--out", str(out), "--resume")
    line = refused(capsys, *SCENE, *other)
    assert f"{restart}: the restart file belongs to another run: other surface;" in line
    assert restart.read_bytes() == left

    with command(*SCENE, "--out", str(out), "--resume") as resumed:
        _, error = resumed.communicate(timeout=120)
    assert (resumed.returncode, error) == (0, said)  # the cautions, word for word
    assert not restart.exists()
    (one, one_history), (two, two_history) = result(tmp_path / "whole"), result(out)
    assert one == two
    assert set(one_history.variables) == set(two_history.variables)
    for name, values in one_history.variables.items():
        assert values.values.tobytes() == two_history[name].values.tobytes(), name
    fields = [
        sorted((path / "run" / "soft-fem3d" / "fields").iterdir())
        for path in (tmp_path / "whole", out)
    ]
    assert [f.name for f in fields[0]] == [f.name for f in fields[1]]
    assert all(a.read_bytes() == b.read_bytes() for a, b in zip(*fields, strict=True))


def test_damaged_restart_file_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "run" / "soft-fem3d"
    folder.mkdir(parents=True)
    np.savez(folder / "restart.npz", state=np.zeros(3))
    line = refused(capsys, *SCENE, "--out", str(tmp_path), "--resume")
    assert "restart.npz: the restart file is truncated or no restart file" in line
    assert line.endswith("delete it or start without resuming")


def test_nothing_to_resume(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = refused(capsys, "run", "soft", "--model", "hcm", "--resume", "--out", str(tmp_path))
    assert "--resume: hcm runs in seconds" in line
    coarse = [a.replace("3e-3", "5e-3").replace("=explicit", "=rigid") for a in SCENE]
    main([*coarse, "--out", str(tmp_path), "--resume"])
    captured = capsys.readouterr()
    assert captured.err.startswith("fingertap: nothing to resume in ")
    assert "completed" in captured.out
