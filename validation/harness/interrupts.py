"""An interrupt ends a command once, and where that is safe.

Ctrl-C, a batch system's SIGTERM and the SIGHUP of a closed terminal are one thing here: what runs
returns what it has, half-written files are removed, and one line says what is kept.

Python raises `KeyboardInterrupt` wherever it happens to be. While a module is imported or compiled
code is loaded, that may be a weak reference's callback or one from C, which no exception leaves
(Python prints "Exception ignored" and goes on); an `except:` that takes a missing part of a library
for the reason; or code that LLVM has half loaded, which crashes when it is called. All were seen:
of 220 interrupted commands 3 ran on to their end and 7 crashed.

To note an interrupt, and to obey it only where progress is reported, would need no look at frames.
But imports, meshing, statics, figures and timed runs report none for seconds: there it would have
to wait for a deadline, and then raise anywhere (at most 4.4 s in the place of 3.1 to the end of a
plane run, ten interrupts of each on a busy machine).
"""

import math
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, TypeVar

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
SOON_S = 0.005  # between two looks whether an interrupt can be obeyed
PATIENCE_S = 3.0  # for imports and loading; compiling is then interrupted where it is
# For what an interrupt has begun to end: another (`timeout` sends two) would leave it half done.
ONCE_S = 1.5
# Parts of the names of files in whose calls an interrupt waits: imports, compiled code, and result
# files (one that is half open complains when it is dropped).
UNSAFE = ("<frozen importlib.", "/numba/", "/llvmlite/", "/h5netcdf/")
# Where `concurrent.futures` takes the locks of all futures that it waits for, and would keep them.
LOCKS = "_AcquireFutures."

Result = TypeVar("Result")


def unless_interrupted(result: Result) -> Result:
    """A run's result. An interrupted solver returns what it has: who needs it whole does not go on.

    Raises KeyboardInterrupt: the run was interrupted.
    """
    status = getattr(result, "status", None)
    if getattr(status, "name", status) == "INTERRUPTED":
        raise KeyboardInterrupt
    return result


def block_interrupts() -> set[Any]:
    """Keep interrupts from this thread and what it starts; returns the signals blocked before.

    The tracker of `multiprocessing`'s resources comes first: where it is started, interrupts are
    let through again.
    """
    from multiprocessing import resource_tracker

    resource_tracker.ensure_running()
    return signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)


def _safe(frame: FrameType | None) -> bool:
    """Whether nothing is being imported, loaded or written."""
    while frame is not None:
        code = frame.f_code
        if any(part in code.co_filename for part in UNSAFE) or code.co_qualname.startswith(LOCKS):
            return False
        frame = frame.f_back
    return True


@contextmanager
def heard_interrupts() -> Iterator[None]:
    """While it lasts, interrupts wait for imports, and one that was swallowed comes again.

    A signal that is ignored (``nohup``) or someone else's to answer stays as it is; where the
    system's timer is in use, it changes nothing.

    Raises KeyboardInterrupt: when that is safe, with the signal's name; at the latest, of an
        interrupt that still waits, at the end.
    """
    on_main = threading.current_thread() is threading.main_thread()
    ordinary_answers = (signal.default_int_handler, signal.SIG_DFL)
    heard = {s: a for s in ENDING if (a := signal.getsignal(s)) in ordinary_answers}
    if not on_main or not heard or signal.getitimer(signal.ITIMER_REAL)[0] > 0.0:
        yield
        return
    name = ""
    waiting_since: float | None = None
    raised = -math.inf
    ordinary = sys.unraisablehook

    def again() -> None:
        # a timer of the system's: a thread's start takes locks that the main thread may hold
        signal.setitimer(signal.ITIMER_REAL, SOON_S)

    def interrupt(number: int, frame: FrameType | None) -> None:
        nonlocal waiting_since, raised, name
        now = time.monotonic()
        if number in ENDING:
            if now - raised < ONCE_S:
                return
            name = signal.Signals(number).name
        since = now if waiting_since is None else waiting_since
        if _safe(frame) or now - since > PATIENCE_S:
            waiting_since, raised = None, now
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            raise KeyboardInterrupt(name)
        waiting_since = since
        again()

    def swallowed(unraisable: "sys.UnraisableHookArgs") -> None:
        nonlocal waiting_since
        if issubclass(unraisable.exc_type, KeyboardInterrupt):
            waiting_since = time.monotonic()
            again()
        else:
            ordinary(unraisable)

    of_timer = signal.signal(signal.SIGALRM, interrupt)
    for number in heard:
        signal.signal(number, interrupt)
    sys.unraisablehook = swallowed
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        sys.unraisablehook = ordinary
        for number, answer in heard.items():
            signal.signal(number, answer)
        signal.signal(signal.SIGALRM, of_timer)
    if waiting_since is not None:
        raise KeyboardInterrupt(name)
