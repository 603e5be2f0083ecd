"""An interrupt at the worst of moments: the command ends soon, and no process outlives it."""

import importlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pytest
from faults.commands import orphans

import hcm
from validation import cli, compare_command, render_command
from validation.bench.timing import shortest
from validation.interrupts import PATIENCE_S, heard_interrupts
from validation.ladder import runs
from validation.models.adapter import Outcome
from validation.models.hcm import translate, warm_up
from validation.record import RunRecord
from validation.scenes.load import load_scene

ROOT = Path(__file__).parent.parent
SOON_S = 25.0  # two starts of Python, two imports and all the grace that is given

# The interrupt comes while a large result is on its way, part of it sent.
SENDING = """
import os, signal, threading
from validation.workers import workers
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


# The command's whole group is interrupted, and once more while the workers are being killed; numpy
# brings a thread that takes signals which the main thread has blocked.
TWICE = """
import os, signal, threading, time
from concurrent.futures import as_completed
from multiprocessing.process import BaseProcess
import numpy
from validation.interrupts import heard_interrupts
from validation.workers import workers
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
from validation.interrupts import heard_interrupts
from validation.workers import workers
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
    assert "Process Spawn" not in error  # no worker has anything to say
    assert not orphans(process.pid)


@pytest.mark.parametrize("after_s", ["0.1", "0.25", "0.4"])
def test_a_result_that_is_on_its_way_is_no_reason_to_wait(tmp_path: Path, after_s: str) -> None:
    ends(tmp_path, SENDING, AFTER_S=after_s)


def test_a_process_that_starts_is_told_too(tmp_path: Path) -> None:
    ends(tmp_path, STARTING)


def test_workers_end_in_their_work(tmp_path: Path) -> None:
    ends(tmp_path, WORKING)


@pytest.mark.parametrize("script", [TWICE, LOCKING])
def test_no_interrupt_leaves_a_pool_half_ended(tmp_path: Path, script: str) -> None:
    ends(tmp_path, script)


class Finalized:
    """What raises where no exception can leave."""

    def __init__(self, error: BaseException) -> None:
        self.error = error

    def __del__(self) -> None:
        raise self.error


def _import_and_sleep(name: str) -> None:
    with heard_interrupts():
        importlib.import_module(name)
        time.sleep(60.0)


def _swallow(error: BaseException, seconds: float) -> None:
    with heard_interrupts():
        Finalized(error)
        time.sleep(seconds)


def test_an_interrupt_that_python_swallows_comes_again() -> None:
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        _swallow(KeyboardInterrupt(), 60.0)
    assert time.monotonic() - began < SOON_S


def test_other_errors_in_finalizers_are_reported_as_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    reported: list[type[BaseException]] = []
    monkeypatch.setattr(sys, "unraisablehook", lambda args: reported.append(args.exc_type))
    ordinary = sys.unraisablehook
    _swallow(ZeroDivisionError(), 0.2)
    assert reported == [ZeroDivisionError]
    assert sys.unraisablehook is ordinary


# A library that takes whatever is raised for a part that is missing.
SWALLOWS = """
import os, signal, time
os.kill(os.getpid(), signal.SIGINT)
try:
    time.sleep(0.5)
    WHOLE = True
except:
    WHOLE = False
"""
HANGS = """
import os, signal, time
os.kill(os.getpid(), signal.SIGINT)
time.sleep(60)
"""


@pytest.mark.parametrize("library", [SWALLOWS, HANGS])
def test_an_interrupt_waits_for_an_import_but_not_for_ever(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, library: str
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "interrupted_library.py").write_text(library)
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        _import_and_sleep("interrupted_library")
    took = time.monotonic() - began
    module = sys.modules.pop("interrupted_library", None)
    if library is SWALLOWS:
        assert module is not None
        assert module.WHOLE
        assert took < PATIENCE_S
    else:
        assert PATIENCE_S < took < SOON_S


def test_an_interrupt_that_waits_until_the_end_is_not_forgotten(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("validation.interrupts.SOON_S", 60.0)
    (tmp_path / "interrupted_library.py").write_text(SWALLOWS)
    with pytest.raises(KeyboardInterrupt), heard_interrupts():
        importlib.import_module("interrupted_library")
    assert sys.modules.pop("interrupted_library").WHOLE


def test_an_interrupted_run_is_neither_warmth_nor_measurement(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def interrupt(fraction: float, doing: str) -> None:
        raise KeyboardInterrupt

    simulate = partial(hcm.simulate, **translate(load_scene("soft")), progress=interrupt)
    assert simulate().status is hcm.Status.INTERRUPTED
    with pytest.raises(KeyboardInterrupt):
        shortest(simulate, 1.0)
    monkeypatch.setattr(hcm, "simulate", lambda **given: simulate())
    with pytest.raises(KeyboardInterrupt):
        warm_up()


def test_what_needs_a_whole_run_keeps_an_interrupted_one_and_ends(
    make_record: Callable[..., RunRecord], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    outcome = Outcome(make_record(model="fem3d", status="INTERRUPTED", ok=False))
    for module in (compare_command, render_command):
        monkeypatch.setattr(module, "solve", lambda *_: outcome)
    with pytest.raises(KeyboardInterrupt):
        compare_command._run(load_scene("soft"), "fem3d", tmp_path / "compared")
    with pytest.raises(KeyboardInterrupt):
        render_command._run("soft", "fem3d", (), tmp_path)
    assert (tmp_path / "compared" / "summary.json").exists()
    assert (tmp_path / "run" / "soft-fem3d" / "summary.json").exists()
    with pytest.raises(KeyboardInterrupt):
        runs._completed(outcome.record)


def test_handlers_of_others_are_left_alone() -> None:
    def theirs(number: int, frame: object) -> None:
        raise AssertionError

    for handler in (signal.SIG_IGN, theirs):
        before = signal.signal(signal.SIGINT, handler)
        try:
            with heard_interrupts():
                assert signal.getsignal(signal.SIGINT) is handler
        finally:
            signal.signal(signal.SIGINT, before)
    alarm = signal.getsignal(signal.SIGALRM)
    with heard_interrupts():
        assert signal.getsignal(signal.SIGINT) is not signal.default_int_handler
        signal.setitimer(signal.ITIMER_REAL, 60.0)
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    assert signal.getsignal(signal.SIGALRM) is alarm
    signal.setitimer(signal.ITIMER_REAL, 60.0)
    try:
        with heard_interrupts():
            assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
        assert signal.getitimer(signal.ITIMER_REAL)[0] > 0.0
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    with ThreadPoolExecutor(1) as threads:
        assert threads.submit(_heard_in_a_thread).result()


def _heard_in_a_thread() -> bool:
    with heard_interrupts():
        return signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_the_command_line_hears_interrupts(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        assert signal.getsignal(signal.SIGINT) is not signal.default_int_handler
        Finalized(KeyboardInterrupt())
        time.sleep(60.0)

    monkeypatch.setattr(cli, "app", interrupted)
    with pytest.raises(SystemExit) as ended:
        cli.main(["run", "soft"])
    assert ended.value.code == 1
    assert "interrupted" in capsys.readouterr().err
