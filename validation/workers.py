"""A pool of worker processes that ends when its command does, however that ends."""

import multiprocessing
import signal
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from typing import Any, ParamSpec, TypeVar

from validation.errors import RunFailedError
from validation.orphan import end_with_parent

GRACE_S = 0.5  # for idle workers to end by themselves
PATIENCE_S = 2.0  # for workers to hand over a result that they have begun to send

P = ParamSpec("P")
R = TypeVar("R")


def _begin() -> None:
    """An interrupt from the keyboard reaches every process: the command alone answers it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    end_with_parent()


def _job(call: Callable[[], R]) -> R:
    """A call that may be terminated; what comes after it, sending its result, may not.

    The pool's thread in the command reads results whole: of half a message it would wait for the
    other half for ever, and the command for that thread.
    """
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    try:
        return call()
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)


class Workers:
    """What hands out work."""

    def __init__(self, pool: ProcessPoolExecutor) -> None:
        self._pool = pool

    def submit(self, function: Callable[P, R], *arguments: P.args, **named: P.kwargs) -> Future[R]:
        """Call a module-level function in a worker."""
        return self._pool.submit(_job, partial(function, *arguments, **named))


def _end(children: list[Any]) -> None:
    """End processes: terminated while they work, killed if they outstay all patience."""
    idle_until = time.monotonic() + GRACE_S
    for child in children:
        child.join(max(0.0, idle_until - time.monotonic()))
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline and any(child.is_alive() for child in children):
        for child in children:
            child.terminate()
            child.join(0.05)
    for child in children:
        child.kill()


@contextmanager
def workers(count: int) -> Iterator[Workers]:
    """Processes that start afresh, so that none inherits another library's threads.

    An error or an interrupt ends them at once; what they had stored by then is whole.

    Raises
    ------
    RunFailedError
        A process was killed or crashed.
    """
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(count, mp_context=context, initializer=_begin)
    try:
        yield Workers(pool)
    except BaseException as error:
        # first what waits is dropped and the idle end: the pool's own thread stumbles over
        # cancelled work of processes that die
        children = multiprocessing.active_children()
        pool.shutdown(wait=False, cancel_futures=True)
        _end(children)
        if isinstance(error, BrokenProcessPool):
            raise RunFailedError(
                "a worker process died (killed, or out of memory); what was finished is kept:"
                " the same command goes on"
            ) from error
        raise
    pool.shutdown()
