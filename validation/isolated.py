"""A function call in a fresh process: its memory is its own, and its crash harms nobody else.

A process and a pipe rather than a process pool: nothing is shared between calls, and CPython's
pool can wait for ever where its only worker is killed (seen here, once in some ten runs).
"""

import multiprocessing
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

PATIENCE_S = 20.0  # for an interrupted process to hand over what it has


class CrashedError(Exception):
    """The process ended without an answer; the message says how."""


def _answer(pipe: Connection, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    pipe.send(function(*arguments))
    pipe.close()


def call_isolated(function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a module-level function in a process started from nothing.

    Raises
    ------
    CrashedError
        The process was killed, crashed, or raised.
    """
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_answer, args=(theirs, function, arguments))
    process.start()
    theirs.close()  # so that the pipe ends when the process does
    patience = None
    try:
        return ours.recv()
    except EOFError:
        process.join()
        code = process.exitcode or 0
        how = f"signal {-code}" if code < 0 else f"exit code {code}"
        raise CrashedError(f"its process ended abruptly ({how})") from None
    except KeyboardInterrupt:
        patience = PATIENCE_S
        raise
    finally:
        process.join(patience)
        process.kill()
        process.join()
        process.close()
        ours.close()
