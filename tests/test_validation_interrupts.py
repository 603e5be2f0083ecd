"""An interrupt at the worst of moments: the command ends soon, and no process outlives it."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from faults.commands import orphans

ROOT = Path(__file__).parent.parent
SOON_S = 25.0  # two starts of Python, two imports and all the grace that is given

# The workers' half second of grace ends while a large result is on its way, half of it sent.
SENDING = """
import os, signal, time
from validation.workers import workers
def large():
    data = b"x" * 400_000_000
    os.kill(os.getppid(), signal.SIGINT)
    time.sleep(float(os.environ["AFTER_S"]))
    return data
if __name__ == "__main__":
    with workers(1) as pool:
        pool.submit(large).result()
        time.sleep(60)
"""
# The interrupt comes while the process starts, and waits until it has.
STARTING = """
import multiprocessing.context, os, signal, time
from validation.isolated import call_isolated
start = multiprocessing.context.SpawnProcess.start
def interrupted(self):
    start(self)
    os.kill(os.getpid(), signal.SIGINT)
if __name__ == "__main__":
    multiprocessing.context.SpawnProcess.start = interrupted
    call_isolated(time.sleep, 120)
"""
WORKING = """
import os, signal, threading, time
from validation.workers import workers
if __name__ == "__main__":
    with workers(2) as pool:
        jobs = [pool.submit(time.sleep, 120) for _ in range(4)]
        threading.Timer(2.0, os.kill, (os.getpid(), signal.SIGINT)).start()
        jobs[0].result()
"""


def ends(tmp_path: Path, code: str, **environment: str) -> None:
    script = tmp_path / "command.py"
    script.write_text(code)
    began = time.monotonic()
    process = subprocess.Popen(
        [sys.executable, str(script)], start_new_session=True, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
    )  # fmt: skip
    try:
        _, error = process.communicate(timeout=SOON_S)
    finally:
        alive = process.poll() is None
        if alive:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
    assert time.monotonic() - began < SOON_S
    assert "KeyboardInterrupt" in error
    assert not orphans(process.pid)


@pytest.mark.parametrize("after_s", ["0.1", "0.25", "0.4"])
def test_a_result_that_is_on_its_way_is_no_reason_to_wait(tmp_path: Path, after_s: str) -> None:
    ends(tmp_path, SENDING, AFTER_S=after_s)


def test_a_process_that_starts_is_told_too(tmp_path: Path) -> None:
    ends(tmp_path, STARTING)


def test_workers_end_in_their_work(tmp_path: Path) -> None:
    ends(tmp_path, WORKING)
