"""A pool of worker processes that ends when its command does, however that ends."""

import multiprocessing
import signal
import time
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager

from validation.errors import RunFailedError
from validation.orphan import end_with_parent

GRACE_S = 0.5  # for idle workers to end by themselves


def _begin() -> None:
    """An interrupt from the keyboard reaches every process: the command alone answers it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()


@contextmanager
def workers(count: int) -> Iterator[Executor]:
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
        yield pool
    except BaseException as error:
        # first what waits is dropped and the idle end: the pool's own thread stumbles over
        # cancelled work of processes that die
        children = multiprocessing.active_children()
        pool.shutdown(wait=False, cancel_futures=True)
        deadline = time.monotonic() + GRACE_S
        for child in children:
            child.join(max(0.0, deadline - time.monotonic()))
            child.terminate()
        if isinstance(error, BrokenProcessPool):
            raise RunFailedError(
                "a worker process died (killed, or out of memory); what was finished is kept:"
                " the same command goes on"
            ) from error
        raise
    pool.shutdown()
