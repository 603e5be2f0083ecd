"""Worker processes that end when their command does, however that ends.

A thread each hands a process its jobs and waits for its answers, over a pipe that nobody else
holds. Hence a process may be killed at any moment: of half a message its thread sees the end. With
the standard library's pool all processes write to one pipe, which the command holds too; a process
that is killed while it sends leaves that pool, and with it the command, to wait for ever.
"""

import multiprocessing
import threading
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, ParamSpec, TypeVar

from validation.errors import RunFailedError
from validation.harness.interrupts import block_interrupts
from validation.harness.orphan import end_with_parent

P = ParamSpec("P")
R = TypeVar("R")


def _serve(jobs: Connection) -> None:
    """In a worker process: answer jobs until there are no more."""
    end_with_parent()
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
        context = multiprocessing.get_context("spawn")
        with self._starting:
            if self._ended:
                raise RunFailedError("the command ends")
            ours, theirs = context.Pipe()
            # a daemon: an exit that nothing has prepared ends it rather than waits for its job
            process = context.Process(target=_serve, args=(theirs,), daemon=True)
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
