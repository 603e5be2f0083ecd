"""Work in other processes: a pool that hands out jobs, and one call in a fresh process.

Each process has a pipe of its own, which no other holds, and which closes when the process is
killed: a reader sees the end, even in the middle of a message. In the standard library's pool all
processes write to one pipe, which the command holds as well; one that is killed while it sends
leaves that pool, and with it the command, waiting for ever.

No process outlives its command. A process of the pool ends at once when the command fails or is
interrupted. The process of a single call handles an interrupt itself; what it had goes to files.
"""

import multiprocessing
import os
import resource
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, TypeVar, TypeVarTuple

from validation.errors import RunFailedError, UserError
from validation.harness.interrupts import ENDING, block_interrupts, heard_interrupts

Given = TypeVarTuple("Given")
R = TypeVar("R")

SPAWN = multiprocessing.get_context("spawn")  # inherits no threads of other libraries
GRACE_S = 2.0  # a keyboard interrupt reaches both processes: time for the other to end on its own
PATIENCE_S = 20.0  # time for an interrupted process to keep what it has
INTERRUPTED = 130  # exit code of a process that an interrupt ended
# Errors that a caller can handle; any other is a crash, whose trace the process prints.
HANDED_OVER = (UserError, RunFailedError, OSError)


def _end_with_parent() -> None:
    """End this process when its parent ends, even if the parent is killed without notice.

    Every ``multiprocessing`` child holds a handle that becomes ready when its parent ends. What the
    process has finished is already written in full.
    """
    parent = multiprocessing.parent_process()
    if parent is None:
        return
    ended = parent.sentinel

    def watch() -> None:
        wait([ended])
        os._exit(1)  # at once: an orphan has no one to return anything to

    threading.Thread(target=watch, name="end-with-parent", daemon=True).start()


def _serve(jobs: Connection) -> None:
    """In a worker process: answer jobs until there are no more."""
    _end_with_parent()
    while True:
        try:
            function, arguments = jobs.recv()
        except EOFError:
            return
        try:
            answer = True, function(*arguments)
        except Exception as error:
            error.add_note("".join(traceback.format_exception(error)))
            answer = False, error
        try:
            jobs.send(answer)
        except OSError:  # no one waits for it any more
            return
        except Exception as error:  # what can't be pickled has not been sent at all
            jobs.send((False, error))


class Workers:
    """A pool that hands out work; a process starts when a job first needs it."""

    def __init__(self, count: int) -> None:
        # only the command handles interrupts: its threads, and what they start, block them
        self._threads = ThreadPoolExecutor(count, "worker", block_interrupts)
        self._own = threading.local()
        self._starting = threading.Lock()
        self._running: dict[Connection, BaseProcess] = {}
        self._ended = False

    def submit(self, function: Callable[[*Given], R], *arguments: *Given) -> Future[R]:
        """Call a module-level function in a worker."""
        return self._threads.submit(self._call, function, arguments)

    def _call(self, function: Callable[..., R], arguments: tuple[Any, ...]) -> R:
        pipe = getattr(self._own, "pipe", None) or self._start()
        try:
            pipe.send((function, arguments))
            done, answer = pipe.recv()
        except (EOFError, OSError) as error:
            self._own.pipe = None  # another job starts another process
            process = self._running.pop(pipe)
            process.kill()
            _free(pipe, process)
            raise RunFailedError(
                "a worker process died (killed, or out of memory); files already written are kept:"
                " give the same command again"
            ) from error
        if not done:
            raise answer
        return answer

    def _start(self) -> Connection:
        """Start the process of the calling thread; return its pipe."""
        with self._starting:
            if self._ended:
                raise RunFailedError("the command ends")
            ours, theirs = SPAWN.Pipe()
            # a daemon: an exit without `finish` or `end` kills it and does not wait for its job
            process = SPAWN.Process(target=_serve, args=(theirs,), daemon=True)
            process.start()
            theirs.close()  # so that the pipe ends when the process does
            self._running[ours] = process
        self._own.pipe = ours
        return ours

    def finish(self) -> None:
        """Wait for the jobs, then for the processes."""
        self._threads.shutdown()
        while self._running:
            _free(*self._running.popitem())

    def end(self) -> None:
        """Drop waiting jobs, kill the processes, even if an interrupt comes meanwhile."""
        self._ended = True
        try:
            self._threads.shutdown(wait=False, cancel_futures=True)
            with self._starting:  # a process that is just being started counts too
                pass
        finally:
            for process in tuple(self._running.values()):
                process.kill()
        self.finish()


def _free(pipe: Connection, process: BaseProcess) -> None:
    """Wait for a process that gets no more jobs, or was killed; free its pipe."""
    pipe.close()
    process.join()


@contextmanager
def workers(count: int) -> Iterator[Workers]:
    """A pool of fresh processes, so that none inherits another library's threads.

    An error or an interrupt ends them at once; what they had stored by then is complete. A job
    whose process was killed or crashed raises `RunFailedError`.
    """
    pool = Workers(count)
    try:
        yield pool
        pool.finish()
    except BaseException:
        pool.end()
        raise


class CrashedError(Exception):
    """The process ended without an answer; the message says how."""


def _answer(pipe: Connection, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    try:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)
        _end_with_parent()
        try:
            with heard_interrupts():
                answer = (True, function(*arguments))
        except HANDED_OVER as error:
            answer = (False, error)
        pipe.send(answer)
        pipe.close()
    except (KeyboardInterrupt, BrokenPipeError):  # no one waits for the answer any more
        os._exit(INTERRUPTED)


def call_isolated(
    function: Callable[..., Any], *arguments: Any, limit_s: float | None = None
) -> Any:
    """Call a module-level function in a fresh process.

    limit_s : time after which the process is killed, s; None: never.

    Raises CrashedError: the process was killed, crashed, raised, or took longer than its limit.
    Raises UserError, RunFailedError, OSError: as the function raised it.
    """
    ours, theirs = SPAWN.Pipe(duplex=False)
    process = SPAWN.Process(target=_answer, args=(theirs, function, arguments))
    # An interrupt waits until the process can handle it; during its start it would print a trace.
    before = block_interrupts()
    try:
        process.start()
    except BaseException:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        raise
    interrupted = False
    try:
        # a waiting interrupt comes now; the process never got it: `_end` sends it another
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        theirs.close()  # so that the pipe ends when the process does
        if not ours.poll(limit_s):
            process.kill()
            raise CrashedError(f"it did not end within {limit_s:g} s")
        done, answer = ours.recv()
    except (EOFError, OSError):  # it was killed before, or in the middle of its answer
        process.join()
        code = process.exitcode or 0
        if code == INTERRUPTED:
            raise KeyboardInterrupt from None
        how = f"signal {-code}" if code < 0 else f"exit code {code}"
        raise CrashedError(f"its process ended abruptly ({how})") from None
    except KeyboardInterrupt:
        interrupted = True
        raise
    finally:
        ours.close()  # a process that is handing over its answer must not wait for a reader
        _end(process, interrupted)
    if not done:
        raise answer
    return answer


def _end(process: Any, interrupted: bool) -> None:
    """Wait for a process to end; one that is interrupted gets time to do so, and is then killed."""
    if interrupted:
        try:
            process.join(GRACE_S)
            if process.exitcode is None:
                # not SIGINT, which background jobs of a shell ignore
                os.kill(process.pid, signal.SIGTERM)
                process.join(PATIENCE_S)
        finally:  # another interrupt ends the wait
            process.kill()
    process.join()
    process.close()


def peak_memory_MB() -> float:
    """Largest resident set of the calling process so far, MB (1e6 bytes).

    Linux' ``ru_maxrss`` starts at the size of the process that spawned this one (it survives
    exec), which would charge a small run for its parent; ``VmHWM`` belongs to this program alone.
    """
    status = Path("/proc/self/status")
    if status.is_file():
        for line in status.read_text(encoding="ascii", errors="replace").splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024 / 1e6
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak * (1 if sys.platform == "darwin" else 1024) / 1e6
