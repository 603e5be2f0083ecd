"""``fingertap run --resume``: a killed command continues to the result of an undisturbed one."""

import json
import signal
import subprocess
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray

from tests.processes import COMMAND, python, started
from tests.validation.commands import Run
from validation.errors import UserError
from validation.models.adapter import Checkpoint
from validation.models.solid import FEM2D
from validation.scenes.load import load_scene

SCENE = (
    *("run", "soft", "--model", "fem3d"),
    *("--set", "solver.fem.flight=explicit", "--set", "solver.fem.threads=1"),
    *("--set", "surface.height=0.06", "--set", "solver.fem.tip_size=3e-3"),
    *("--set", "solver.fem.section_size=3e-3", "--set", "solver.fem.axial_size=6e-3"),
)
OWN = ("wall_time_s", "peak_memory_MB", "provenance", "statistics")  # of each run, not of the tap


def result(out: Path) -> tuple[dict[str, Any], xarray.Dataset]:
    folder = out / "run" / "soft-fem3d"
    summary = json.loads((folder / "summary.json").read_text())
    with xarray.open_dataset(folder / "history.nc", engine="h5netcdf") as history:
        history.load()
    return {key: value for key, value in summary.items() if key not in OWN}, history


def test_killed_command_resumes_to_the_same_bits(tmp_path: Path, fingertap: Run) -> None:
    whole = python("-c", COMMAND, *SCENE, "--out", tmp_path / "whole")
    assert whole.returncode == 0
    out = tmp_path / "killed"
    restart = out / "run" / "soft-fem3d" / "restart.npz"
    with started("-c", COMMAND, *SCENE, "--out", out, stderr=subprocess.DEVNULL) as killed:
        deadline = time.monotonic() + 60
        while not restart.exists() and time.monotonic() < deadline:
            time.sleep(0.002)
        killed.kill()
    assert killed.returncode == -signal.SIGKILL
    assert not restart.with_name("summary.json").exists()
    left = restart.read_bytes()

    # Another scene does not take it, and leaves it where it is.
    other = fingertap(*SCENE, "--set", "surface.friction=0.4", "--out", out, "--resume")
    of_another = f"{restart}: the restart file belongs to another run: different surface;"
    assert of_another in other.refusal
    assert restart.read_bytes() == left

    resumed = python("-c", COMMAND, *SCENE, "--out", out, "--resume")
    assert (resumed.returncode, resumed.stderr) == (0, whole.stderr)  # cautions word for word
    assert not restart.exists()
    (one, one_history), (two, two_history) = result(tmp_path / "whole"), result(out)
    assert one == two
    assert set(one_history.variables) == set(two_history.variables)
    for name, values in one_history.variables.items():
        assert values.values.tobytes() == two_history[name].values.tobytes(), name
    fields = [
        {f.name: f.read_bytes() for f in (path / "run" / "soft-fem3d" / "fields").iterdir()}
        for path in (tmp_path / "whole", out)
    ]
    assert fields[0] == fields[1]


def test_damaged_restart_file_is_one_line(tmp_path: Path, fingertap: Run) -> None:
    folder = tmp_path / "run" / "soft-fem3d"
    folder.mkdir(parents=True)
    np.savez(folder / "restart.npz", state=np.zeros(3))
    line = fingertap(*SCENE, "--out", tmp_path, "--resume").refusal
    assert "restart.npz: the restart file is truncated or not a restart file" in line
    assert line.endswith("delete it or start without resuming")


def test_nothing_to_resume(tmp_path: Path, fingertap: Run) -> None:
    line = fingertap("run", "soft", "--model", "hcm", "--resume", "--out", tmp_path).refusal
    assert "--resume: hcm leaves no restart file" in line
    coarse = [a.replace("3e-3", "5e-3").replace("=explicit", "=rigid") for a in SCENE]
    ended = fingertap(*coarse, "--out", tmp_path, "--resume")
    assert ended.code == 0
    assert ended.err.startswith("fingertap: nothing to resume in ")
    assert "completed" in ended.out


def test_a_later_solve_of_a_run_held_to_an_accuracy_is_resumed_too(tmp_path: Path) -> None:
    """The second solve began again at every interrupt, though it is the longest."""
    scene = load_scene("soft", ("solver.fem.accuracy=0.01",))
    own = Checkpoint(tmp_path / "restart.npz")
    second = own.of_solve(2)

    def stop(share: float, what: str) -> None:
        if second.exists():
            raise KeyboardInterrupt

    stopped = FEM2D.run(scene, stop, own).record
    assert stopped.status == "INTERRUPTED"
    assert second.exists()
    saved = second.read_bytes()
    second.write_bytes(b"damaged")  # it was taken for a mesh that is refused, and solve 1 was kept
    with pytest.raises(UserError, match=r"restart-2\.npz: the restart file is truncated"):
        FEM2D.run(scene, None, replace(own, resume=True))
    second.write_bytes(saved)
    resumed = FEM2D.run(scene, None, replace(own, resume=True)).record
    whole = FEM2D.run(scene).record
    one, two = ({k: v for k, v in of.summary.items() if k not in OWN} for of in (resumed, whole))
    assert one == two
    assert resumed.errors == whole.errors
    users = tmp_path / "restart-backup.npz"
    for file in (users, tmp_path / ".restart.npz.7.partial"):
        file.touch()
    own.remove()
    assert list(tmp_path.iterdir()) == [users]
