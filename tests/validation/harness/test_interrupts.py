"""Interrupts that Python swallows, that come too early, or that a solver answers."""

import importlib
import signal
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pytest

import hcm
from tests.validation.commands import Capture, Make, Patch
from validation import cli
from validation.compare.command import compare
from validation.harness.interrupts import PATIENCE_S, heard_interrupts
from validation.harness.timing import shortest
from validation.models.adapter import Outcome
from validation.models.hcm import HCM, hcm_scene
from validation.scenes.load import load_scene
from validation.validate.ladder import runs

SOON_S = 25.0  # for what takes far longer where the interrupt is lost


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


def test_other_errors_in_finalizers_are_reported_as_ever(monkeypatch: Patch) -> None:
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
    tmp_path: Path, monkeypatch: Patch, library: str
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "interrupted_library.py").write_text(library)
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        _import_and_sleep("interrupted_library")
    took = time.monotonic() - began
    module = sys.modules.pop("interrupted_library", None)
    if library is SWALLOWS:
        assert module.WHOLE
        assert took < PATIENCE_S
    else:
        assert PATIENCE_S < took < SOON_S


def test_an_interrupt_that_waits_until_the_end_is_not_forgotten(
    tmp_path: Path, monkeypatch: Patch
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("validation.harness.interrupts.SOON_S", 60.0)
    (tmp_path / "interrupted_library.py").write_text(SWALLOWS)
    with pytest.raises(KeyboardInterrupt), heard_interrupts():
        importlib.import_module("interrupted_library")
    assert sys.modules.pop("interrupted_library").WHOLE


def test_an_interrupted_run_is_neither_warmth_nor_measurement(
    monkeypatch: Patch,
) -> None:
    def interrupt(fraction: float, doing: str) -> None:
        raise KeyboardInterrupt

    scene = hcm_scene(load_scene("soft"), estimate=False)
    simulate = partial(hcm.simulate_scene, scene, progress=interrupt)
    assert simulate().status is hcm.Status.INTERRUPTED
    with pytest.raises(KeyboardInterrupt):
        shortest(simulate, 1.0)
    monkeypatch.setattr(hcm, "simulate_within", lambda *given, **_: simulate())
    with pytest.raises(KeyboardInterrupt):
        HCM.warm_up()


def test_what_needs_a_whole_run_keeps_an_interrupted_one_and_ends(
    make_record: Make, monkeypatch: Patch, tmp_path: Path
) -> None:
    outcome = Outcome(make_record(model="fem3d", status="INTERRUPTED", ok=False))
    monkeypatch.setattr("validation.runs.command.solve", lambda *_: outcome)
    with pytest.raises(KeyboardInterrupt):
        compare("soft", model="fem3d", overrides=("surface.friction=0.4",), out=tmp_path)
    (kept,) = tmp_path.glob("compare/*/*/summary.json")
    assert kept.parent.name == "scene"
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


def test_the_command_line_hears_interrupts(monkeypatch: Patch, capsys: Capture) -> None:
    def interrupted(*_: object, **__: object) -> None:
        assert signal.getsignal(signal.SIGINT) is not signal.default_int_handler
        Finalized(KeyboardInterrupt())
        time.sleep(60.0)

    monkeypatch.setattr(cli, "app", interrupted)
    with pytest.raises(SystemExit) as ended:
        cli.main(["run", "soft"])
    assert ended.value.code == 1
    assert "interrupted" in capsys.readouterr().err
