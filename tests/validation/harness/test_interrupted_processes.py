"""An interrupt at the worst of moments: the command ends soon, and no process outlives it."""

import os
import signal
import subprocess
import time
from pathlib import Path

import pytest

from tests.faults.commands import orphans
from tests.processes import started

SOON_S = 25.0  # two starts of Python, two imports and all the grace that is given

# The interrupt comes while a large result is on its way, part of it sent.
SENDING = """
import os, signal, threading
from validation.harness.processes import workers
def large():
    data = b"x" * 400_000_000
    later = (float(os.environ["AFTER_S"]), os.kill, (os.getppid(), signal.SIGINT))
    threading.Timer(*later).start()
    return data
if __name__ == "__main__":
    with workers(1) as pool:
        pool.submit(large).result()
        threading.Event().wait(60)
"""
# The interrupt comes while the process starts, and waits until it has.
STARTING = """
import multiprocessing.context, os, signal, time
from validation.harness.processes import call_isolated
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
from validation.harness.processes import workers
if __name__ == "__main__":
    with workers(2) as pool:
        jobs = [pool.submit(time.sleep, 120) for _ in range(4)]
        threading.Timer(2.0, os.kill, (os.getpid(), signal.SIGINT)).start()
        jobs[0].result()
"""
# The command's whole group is interrupted, and once more while the workers are being killed; numpy
# brings a thread that takes signals which the main thread has blocked.
TWICE = """
import os, signal, threading, time
from concurrent.futures import as_completed
from multiprocessing.process import BaseProcess
import numpy
from validation.harness.interrupts import heard_interrupts
from validation.harness.processes import workers
kill = BaseProcess.kill
def killed(self):
    kill(self)
    os.killpg(0, signal.SIGINT)
    time.sleep(0.05)
if __name__ == "__main__":
    with heard_interrupts(), workers(2) as pool:
        jobs = [pool.submit(time.sleep, 120) for _ in range(6)]
        pool.submit(abs, 1)
        BaseProcess.kill = killed
        threading.Timer(2.0, os.killpg, (0, signal.SIGINT)).start()
        for job in as_completed(jobs):
            job.result()
"""
# The interrupt comes while the locks of the futures are taken.
LOCKING = """
import os, signal, time
from concurrent.futures import Future, wait
from validation.harness.interrupts import heard_interrupts
from validation.harness.processes import workers
class Condition:
    def __init__(self, condition):
        self.condition = condition
    def acquire(self):
        self.condition.acquire()
        os.kill(os.getpid(), signal.SIGINT)
    def __getattr__(self, name):
        return getattr(self.condition, name)
    def __enter__(self):
        return self.condition.__enter__()
    def __exit__(self, *error):
        return self.condition.__exit__(*error)
if __name__ == "__main__":
    with heard_interrupts(), workers(2) as pool:
        jobs = [pool.submit(time.sleep, 1) for _ in range(4)]
        for job in jobs:
            job._condition = Condition(job._condition)
        time.sleep(0.5)
        wait(jobs)
        time.sleep(120)
"""


# The command is killed while its worker waits for work.
IDLE = """
import os, time
from validation.harness.processes import workers
if __name__ == "__main__":
    with workers(1) as pool:
        print(pool.submit(os.getpid).result(), flush=True)
        time.sleep(60)
"""


def script(tmp_path: Path, code: str) -> Path:
    """A file: processes that are spawned import it again."""
    path = tmp_path / "command.py"
    path.write_text(code)
    return path


@pytest.mark.parametrize(
    ("code", "after_s"),
    [(SENDING, "0.1"), (SENDING, "0.25"), (SENDING, "0.4"), (STARTING, ""), (WORKING, ""),
     (TWICE, ""), (LOCKING, "")],
    ids=["sending-0.1", "sending-0.25", "sending-0.4", "starting", "working", "twice", "locking"],
)  # fmt: skip
def test_an_interrupted_command_ends_soon_and_whole(
    tmp_path: Path, code: str, after_s: str
) -> None:
    began, path = time.monotonic(), script(tmp_path, code)
    how = {"stderr": subprocess.PIPE, "start_new_session": True}
    process = started(path, env={"AFTER_S": after_s}, **how)
    try:
        _, error = process.communicate(timeout=SOON_S)
    finally:
        alive = process.poll() is None
        if alive:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
    assert time.monotonic() - began < SOON_S
    assert "KeyboardInterrupt" in error
    assert "Process Spawn" not in error  # no worker has anything to say
    assert not orphans(process.pid)


def test_a_worker_ends_with_its_command(tmp_path: Path) -> None:
    how = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "start_new_session": True}
    with started(script(tmp_path, IDLE), **how) as process:
        assert int(process.stdout.readline()) != process.pid
        process.kill()
        process.wait()
    assert not orphans(process.pid)
