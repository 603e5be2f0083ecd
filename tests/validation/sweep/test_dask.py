"""A Dask cluster on loopback: the serial dataset, whatever is lost on the way."""

import importlib.util
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.processes import COMMAND, python, started
from tests.validation.commands import Run
from tests.validation.sweep.plans import written
from tests.validation.sweep.test_sweep import TWO, lines, opened
from validation.sweep import executor

needs_dask = pytest.mark.skipif(
    importlib.util.find_spec("distributed") is None, reason="the extra dask is not installed"
)


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        port: int = found.getsockname()[1]
    return port


class Wire:
    """A connection to a port by another one, which can be cut."""

    def __init__(self, port: int) -> None:
        self._to = port
        self._ends: list[socket.socket] = []
        self._door = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._door.getsockname()[1]
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self) -> None:
        while True:
            try:
                here, _ = self._door.accept()
            except OSError:
                return
            there = socket.create_connection(("127.0.0.1", self._to))
            self._ends += [here, there]
            for one, other in ((here, there), (there, here)):
                threading.Thread(target=self._pass_on, args=(one, other), daemon=True).start()

    def _pass_on(self, one: socket.socket, other: socket.socket) -> None:
        try:
            while content := one.recv(65536):
                other.sendall(content)
        except OSError:
            pass
        finally:
            other.close()

    def cut(self) -> None:
        for end in self._ends:
            with ExitStack() as quietly:
                quietly.push(lambda kind, error, trace: kind is not None)
                end.shutdown(socket.SHUT_RDWR)
        self._ends.clear()

    def close(self) -> None:
        self._door.close()
        self.cut()


@contextmanager
def cluster(folder: Path, workers: int, threads: int = 1) -> Iterator[tuple[int, list[int]]]:
    """A scheduler's port, and the processes of its workers and, last, its own."""
    port, quiet = free_port(), {"stdout": -3, "stderr": -3, "cwd": folder}
    address = f"tcp://127.0.0.1:{port}"
    with ExitStack() as processes:

        def start(*words: object) -> int:
            process = started("-m", *words, **quiet)
            processes.callback(process.wait)
            processes.callback(process.kill)
            return int(process.pid)

        scheduler = start("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", port,
                          "--no-dashboard")  # fmt: skip
        pids = [
            start("distributed.cli.dask_worker", address, "--host", "127.0.0.1", "--no-nanny",
                  "--nthreads", threads, "--no-dashboard", "--local-directory", folder)
            for _ in range(workers)
        ]  # fmt: skip
        yield port, [*pids, scheduler]


def dask_and_serial(folder: Path, number: int) -> None:
    """Sweep on a cluster that loses a worker, then the connection; and in one process here."""
    path = written(folder, TWO.replace("number = 4", f"number = {number}"))
    words = ("-c", COMMAND, "sweep", path)
    with cluster(folder, 2) as (port, pids):
        wire = Wire(port)
        address = f"tcp://127.0.0.1:{wire.port}"
        process = started(*words, "--dask", address, "--out", folder / "cluster")
        kept = folder / "cluster" / "sweep" / "plan" / "results.jsonl"
        for share, harm in ((0.2, lambda: os.kill(pids[0], signal.SIGKILL)), (0.5, wire.cut)):
            while process.poll() is None and not (
                kept.exists() and kept.read_bytes().count(b"\n") >= share * 2 * number
            ):
                time.sleep(0.02)
            assert process.poll() is None, "it ended before all harm was done"
            harm()
        assert process.wait(600) == 0
        wire.close()
    assert python(*words, "--workers", "1", "--out", folder / "here", timeout=600).returncode == 0
    assert opened(folder / "cluster").identical(
        opened(folder / "here").assign_attrs(opened(folder / "cluster").attrs)
    )
    assert len(lines(folder / "cluster")) == 2 * number


@needs_dask
def test_a_cluster_computes_the_same(tmp_path: Path) -> None:
    dask_and_serial(tmp_path, 300)


@needs_dask
@pytest.mark.slow
def test_two_thousand_scenes_with_losses_are_the_same(tmp_path: Path) -> None:
    dask_and_serial(tmp_path, 2000)


@needs_dask
def test_a_scheduler_that_dies_ends_the_sweep_with_one_line(tmp_path: Path) -> None:
    """It waited for ever, and ended in the client's traceback; what was solved is kept."""
    path = written(tmp_path, TWO.replace("number = 4", "number = 2000"))
    quickly = "import validation.sweep.executor as of; of.CONNECT_S = of.COUNTED_S = 2.0"
    with cluster(tmp_path, 1) as (port, pids):
        address, kept = f"tcp://127.0.0.1:{port}", tmp_path / "sweep" / "plan" / "results.jsonl"
        words = ("sweep", path, "--dask", address, "--out", tmp_path)
        process = started("-c", f"{quickly}; {COMMAND}", *words, stderr=subprocess.PIPE)
        while process.poll() is None and not (kept.exists() and kept.stat().st_size > 0):
            time.sleep(0.02)
        os.kill(pids[-1], signal.SIGKILL)
        _, err = process.communicate(timeout=120)
    assert process.returncode == 1, err
    assert "the scheduler was lost; what was finished is kept" in err
    assert "Traceback" not in err
    assert lines(tmp_path)


def test_a_cluster_that_loses_its_last_worker_says_so_once(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It waited in silence."""
    monkeypatch.setattr(executor, "COUNTED_S", 0.0)
    counts = iter([2, 2, 0, 0, 1, 0])
    count = executor._count_of(SimpleNamespace(nthreads=lambda: range(next(counts))), "tcp://here")
    assert [count() for _ in range(3)] == [2, 0, 0]
    assert capsys.readouterr().err.count("tcp://here: has no workers left; waiting") == 1
    assert [count() for _ in range(3)] == [1, 0, 0]  # no answer: the last known
    assert capsys.readouterr().err.count("has no workers left") == 1


@needs_dask
def test_a_cluster_that_cannot_be_used_is_refused(
    tmp_path: Path, fingertap: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("validation.sweep.executor.CONNECT_S", 0.5)
    path = written(tmp_path)
    nobody = f"tcp://127.0.0.1:{free_port()}"
    folder = tmp_path / "sweep" / "plan"
    ended = fingertap("sweep", path, "--dask", nobody, "--out", tmp_path)
    assert "no scheduler answers" in ended.refusal
    assert not any(folder.glob("sweep.*"))
    page = folder / "index.html"  # an earlier sweep's, which a mistyped address deleted
    page.write_text("finished", encoding="utf-8")
    with monkeypatch.context() as patch:  # a client that refuses an address takes a minute to end
        patch.setattr("distributed.Client", None)
        for address in ("carrier-pigeon://loft", "nonsense", "http://127.0.0.1:8787", "tcp://a:b"):
            ended = fingertap("sweep", path, "--dask", address, "--out", tmp_path)
            assert "no scheduler answers" in ended.refusal
    assert page.read_text(encoding="utf-8") == "finished"
    monkeypatch.setattr("validation.sweep.executor.CONNECT_S", 30.0)
    with cluster(tmp_path, 1, threads=2) as (port, _):
        address = f"tcp://127.0.0.1:{port}"
        ended = fingertap("sweep", path, "--dask", address, "--out", tmp_path)
    assert ended.code == 2
    assert "has 2 threads: must have 1" in ended.err


def test_without_dask_it_says_what_to_install(
    tmp_path: Path, fingertap: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    ended = fingertap("sweep", written(tmp_path), "--dask", "tcp://here:1", "--out", tmp_path)
    assert ended.code == 2
    assert "pip install 'fingertap[dask]'" in ended.err
