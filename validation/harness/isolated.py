"""A function call in a fresh process: its memory is its own, and its crash harms nobody else.

A process and a pipe rather than a process pool: nothing is shared between calls, and CPython's
pool can wait for ever where its only worker is killed (seen here, once in some ten runs).
"""

import multiprocessing
import os
import signal
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

from validation.errors import RunFailedError, UserError
from validation.harness.interrupts import block_interrupts, heard_interrupts
from validation.harness.orphan import end_with_parent

GRACE_S = 2.0  # an interrupt from the keyboard reaches both processes: time to end by itself
PATIENCE_S = 20.0  # for an interrupted process to keep what it has
INTERRUPTED = 130  # exit code of a process that ended by an interrupt
# What a caller can answer to; anything else is a crash, whose trace the process prints.
HANDED_OVER = (UserError, RunFailedError, OSError)


class CrashedError(Exception):
    """The process ended without an answer; the message says how."""


def _answer(pipe: Connection, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    try:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        end_with_parent()
        try:
            with heard_interrupts():
                answer = (True, function(*arguments))
        except HANDED_OVER as error:
            answer = (False, error)
        pipe.send(answer)
        pipe.close()
    except (KeyboardInterrupt, BrokenPipeError):  # nobody waits for the answer any more
        os._exit(INTERRUPTED)


def call_isolated(function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a module-level function in a process started from nothing.

    Raises
    ------
    CrashedError
        The process was killed, crashed, or raised.
    UserError, RunFailedError, OSError
        As the function raised it.
    """
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_answer, args=(theirs, function, arguments))
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
                os.kill(process.pid, signal.SIGINT)
                process.join(PATIENCE_S)
        finally:  # another interrupt is the end of patience
            process.kill()
    process.join()
    process.close()
