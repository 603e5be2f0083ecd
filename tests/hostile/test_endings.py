"""Runs that end early, or late with no room for their files: what is known is said and kept."""

import errno
import os
import resource
import signal
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.faults.commands import LONG, RUN, finish, start
from tests.hostile.oracle import left_over
from tests.processes import python
from tests.validation.commands import Make, Patch, Run, call_apart, fake_adapter
from validation.models.adapter import Outcome
from validation.runs import execute

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
EXPLICIT = LONG[:-1]  # without --resume
# Steps so short that the contact lasts for seconds.
SLOW = (*RUN, "--set", "solver.hcm.contact_step=1e-9", "--set", "solver.hcm.flight_step=1e-7")


def test_a_finished_run_prints_its_scalars_though_no_file_has_room(tmp_path: Path) -> None:
    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, 10_000))

    ended = call_apart(*RUN, "--out", tmp_path, preexec_fn=limited)
    assert ended.code == 1
    assert "soft, hcm: completed" in ended.out
    assert "peak Fn                        64.49" in ended.out
    store, error = (line for line in ended.err.splitlines() if "caution" not in line)
    assert "a result cannot be stored" in store
    assert "its files could not all be written (File too large)" in error
    assert error.endswith("the same command runs it again")
    folder = tmp_path / "run" / "soft-hcm"
    assert [path.name for path in folder.iterdir()] == ["summary.json"]
    assert "could not all be written" in (folder / "summary.json").read_text()
    assert left_over(tmp_path) == []


def full_disk(*_: object) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.parametrize("stored", [False, True])
def test_a_full_disk_names_what_goes_on(
    stored: bool, make_record: Make, monkeypatch: Patch, tmp_path: Path, fingertap: Run
) -> None:
    restart = tmp_path / "run" / "soft-fem3d" / "restart.npz"

    def run(scene: Any, progress: Any, checkpoint: Any) -> Outcome:
        assert checkpoint.path == restart
        restart.touch()
        return Outcome(replace(make_record(model="fem3d"), scene=scene.name))

    monkeypatch.setattr(execute, "adapter", lambda name: fake_adapter(run))
    monkeypatch.setattr("validation.harness.run_files.write_history", full_disk)
    if not stored:
        monkeypatch.setattr("validation.harness.stored_run.write_record", full_disk)
    ended = fingertap("run", "soft", "--model", "fem3d", "--out", tmp_path)
    assert ended.code == 1
    assert "soft, fem3d: completed" in ended.out
    line = ended.err.splitlines()[-1]
    assert "No space left on device" in line
    if stored:
        assert "the store has it" in line
        assert line.endswith("the same command reads it from there")
        assert not restart.exists()
    else:
        assert line.endswith(f"the same command with --resume goes on from {restart}")
    assert restart.with_name("summary.json").exists()


@pytest.mark.parametrize("how", SIGNALS)
def test_a_signal_names_what_was_kept_and_what_goes_on(how: signal.Signals, tmp_path: Path) -> None:
    restart = tmp_path / "run" / "soft-fem2d" / "restart.npz"
    process = start(EXPLICIT, tmp_path)
    deadline = time.monotonic() + 60
    while not restart.exists() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    process.send_signal(how)
    ended = finish(process)
    assert (ended.code, len(ended.lines)) == (1, 1), ended.error
    assert "interrupted" in ended.error
    assert f"the same command with --resume goes on from {restart}" in ended.error
    assert restart.exists()
    assert left_over(tmp_path) == []


@pytest.mark.parametrize("how", SIGNALS[1:])
def test_the_reduced_model_ends_with_a_word_too(how: signal.Signals, tmp_path: Path) -> None:
    process = start(SLOW, tmp_path)
    time.sleep(1.5)
    process.send_signal(how)
    ended = finish(process)
    assert (ended.code, len(ended.lines)) == (1, 1), ended.error
    assert "interrupted" in ended.error
    assert "--resume" not in ended.error
    assert left_over(tmp_path) == []


WRITING = """
import os, signal, sys
from pathlib import Path
from validation.harness.interrupts import heard_interrupts
from validation.harness.store import Store
from reference_fem.dynamics.restart import Restart, RestartFile
import numpy as np
folder, how = Path(sys.argv[1]), int(sys.argv[2])
def write(entry):
    (entry / "half").write_text("half")
    os.kill(os.getpid(), how)
try:
    with heard_interrupts():
        Store(folder / "store").keep({"a": 1}, write)
except KeyboardInterrupt as error:
    print(error, flush=True)
file = RestartFile(Restart(folder / "restart.npz"), {"mesh": "a"})
os.fsync = lambda number: os.kill(os.getpid(), how)
try:
    with heard_interrupts():
        file.write({"state": np.zeros(3)})
except KeyboardInterrupt as error:
    print(error, flush=True)
"""


@pytest.mark.parametrize("how", SIGNALS)
def test_what_a_signal_finds_half_written_is_removed(how: signal.Signals, tmp_path: Path) -> None:
    done = python("-c", WRITING, tmp_path, int(how))
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.split() == [how.name, how.name]
    assert left_over(tmp_path) == []
    assert [path.name for path in tmp_path.iterdir()] == ["store"]
