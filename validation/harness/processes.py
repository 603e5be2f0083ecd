"""Work in other processes: a pool that hands out jobs, and one call in a fresh process.

Each process has a pipe of its own, which nobody else holds, and a process that is killed at any
moment closes it: whoever waits sees the end, of half a message too. With the standard library's
pool all processes write to one pipe, which the command holds as well; one that is killed while it
sends leaves that pool, and with it the command, to wait for ever.

No process outlives its command. A process of the pool ends at once when the command fails or is
interrupted. That of a single call answers an interrupt itself, and hands over what it has.
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
from typing import Any, ParamSpec, TypeVar

from validation.errors import RunFailedError, UserError
from validation.harness.interrupts import ENDING, block_interrupts, heard_interrupts

P = ParamSpec("P")
R = TypeVar("R")

SPAWN = multiprocessing.get_context("spawn")  # nothing of another library's threads is inherited
GRACE_S = 2.0  # an interrupt from the keyboard reaches both processes: time to end by itself
PATIENCE_S = 20.0  # for an interrupted process to keep what it has
INTERRUPTED = 130  # exit code of a process that ended by an interrupt
# What a caller can answer to; anything else is a crash, whose trace the process prints.
HANDED_OVER = (UserError, RunFailedError, OSError)


def _end_with_parent() -> None:
    """End this process when its parent ends, also by a SIGKILL, of which nothing else tells it.

    Every ``multiprocessing`` child holds a handle that becomes ready when its parent ends. What the
    process had finished is written whole already.
    """
    parent = multiprocessing.parent_process()
    if parent is None:
        return
    ended = parent.sentinel

    def watch() -> None:
        wait([ended])
        os._exit(1)  # at once: an orphan has nobody to hand anything over to

    threading.Thread(target=watch, name="end-with-parent", daemon=True).start()


def _serve(jobs: Connection) -> None:
    """In a worker process: answer jobs until there are no more."""
    _end_with_parent()
    while True:
        try:
            function, arguments, named = jobs.recv()
        except EOFError:
            return
        try:
            answer = True, function(*arguments, **named)
        except Exception as error:
            error.add_note("".join(traceback.format_exception(error)))
            answer = False, error
        try:
            jobs.send(answer)
        except OSError:  # nobody waits for it any more
            return
        except Exception as error:  # nothing of what can't be sent has been
            jobs.send((False, error))


class Workers:
    """What hands out work; a process starts when a job first waits for it."""

    def __init__(self, count: int) -> None:
        # the command alone answers an interrupt: threads, and what they start, leave it to that
        self._threads = ThreadPoolExecutor(count, "worker", block_interrupts)
        self._own = threading.local()
        self._starting = threading.Lock()
        self._processes: list[BaseProcess] = []
        self._pipes: list[Connection] = []
        self._ended = False

    def submit(self, function: Callable[P, R], *arguments: P.args, **named: P.kwargs) -> Future[R]:
        """Call a module-level function in a worker."""
        return self._threads.submit(self._call, (function, arguments, named))

    def _call(self, job: tuple[Callable[..., R], tuple[Any, ...], dict[str, Any]]) -> R:
        pipe = getattr(self._own, "pipe", None) or self._start()
        try:
            pipe.send(job)
            done, answer = pipe.recv()
        except (EOFError, OSError) as error:
            self._own.pipe = None  # another job starts another process
            raise RunFailedError(
                "a worker process died (killed, or out of memory); what was finished is kept:"
                " the same command goes on"
            ) from error
        if not done:
            raise answer
        result: R = answer
        return result

    def _start(self) -> Connection:
        """The process of the thread that calls."""
        with self._starting:
            if self._ended:
                raise RunFailedError("the command ends")
            ours, theirs = SPAWN.Pipe()
            # a daemon: an exit that nothing has prepared ends it rather than waits for its job
            process = SPAWN.Process(target=_serve, args=(theirs,), daemon=True)
            process.start()
            theirs.close()  # so that the pipe ends when the process does
            self._processes.append(process)
            self._pipes.append(ours)
        self._own.pipe = ours
        return ours

    def finish(self) -> None:
        """Wait for the jobs, then for the processes."""
        self._threads.shutdown()
        for pipe in self._pipes:
            pipe.close()
        for process in self._processes:
            process.join()

    def end(self) -> None:
        """Drop what waits, kill what runs; an interrupt on the way does not spare the processes."""
        self._ended = True
        try:
            self._threads.shutdown(wait=False, cancel_futures=True)
            with self._starting:  # a process that is being started is one of them
                pass
        finally:
            for process in self._processes:
                process.kill()
        self.finish()


@contextmanager
def workers(count: int) -> Iterator[Workers]:
    """Processes that start afresh, so that none inherits another library's threads.

    An error or an interrupt ends them at once; what they had stored by then is whole. A job of a
    process that was killed or crashed raises `RunFailedError`.
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
    except (KeyboardInterrupt, BrokenPipeError):  # nobody waits for the answer any more
        os._exit(INTERRUPTED)


def call_isolated(
    function: Callable[..., Any], *arguments: Any, limit_s: float | None = None
) -> Any:
    """Call a module-level function in a process started from nothing.

    limit_s : after which the process is killed; None: never.

    Raises CrashedError: the process was killed, crashed, raised, or took longer than its limit.
    Raises UserError, RunFailedError, OSError: as the function raised it.
    """
    ours, theirs = SPAWN.Pipe(duplex=False)
    process = SPAWN.Process(target=_answer, args=(theirs, function, arguments))
    # An interrupt waits until the process can answer it: it would print a trace of its start.
    before = block_interrupts()
    try:
        process.start()
    except BaseException:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        raise
    interrupted = False
    try:
        # one that has waited comes now, and never came to the process: `_end` sends it another
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        theirs.close()  # so that the pipe ends when the process does
        if not ours.poll(limit_s):
            process.kill()
            raise CrashedError(f"it did not end within {limit_s:g} s")
        done, answer = ours.recv()
    except EOFError:
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
    """Wait for a process's end, with patience for one that is interrupted."""
    if interrupted:
        try:
            process.join(GRACE_S)
            if process.exitcode is None:
                # not SIGINT, which a shell's job in the background ignores
                os.kill(process.pid, signal.SIGTERM)
                process.join(PATIENCE_S)
        finally:  # another interrupt is the end of patience
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
