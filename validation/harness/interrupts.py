"""An interrupt ends a command once, and only where that is safe.

Ctrl-C, a batch system's SIGTERM and the SIGHUP of a closed terminal are treated alike: a run
returns what it has, half-written files are removed, and one line says what is kept.

Python raises `KeyboardInterrupt` wherever it happens to be. While a module is imported or compiled
code is loaded, that may be in a callback of a weak reference or from C, which no exception leaves
(Python prints "Exception ignored" and goes on); in a `try` whose `except:` then takes a part of a
library for missing; or in code half loaded by LLVM, which crashes when it is called. All were seen:
of 220 interrupted commands 3 ran on to their end and 7 crashed.

Noting an interrupt, and obeying it only where progress is reported, would need no look at frames.
But imports, meshing, statics, figures and timed runs report none for seconds: there it would have
to wait for a deadline, and then raise anywhere (a plane run took up to 4.4 s to end instead of 3.1,
with ten interrupts of each kind on a busy machine).
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
SOON_S = 0.005  # time between two checks whether an interrupt can be obeyed
PATIENCE_S = 3.0  # for imports and loading; after that, compiling is interrupted wherever it is
# For the clean-up after an interrupt, which another (`timeout` sends two) would leave half done.
ONCE_S = 1.5
# Parts of file names: an interrupt waits while code of such files runs, that is imports, compiled
# code, and result files (one that is half open complains when it is dropped).
UNSAFE = ("<frozen importlib.", "/numba/", "/llvmlite/", "/h5netcdf/")
# Where `concurrent.futures` takes the locks of all futures that it awaits, and would keep them.
LOCKS = "_AcquireFutures."

Result = TypeVar("Result")


def unless_interrupted(result: Result) -> Result:
    """Return a run's result if it was not interrupted: a partial one must not pass for a whole one.

    Raises KeyboardInterrupt: the run was interrupted.
    """
    status = getattr(result, "status", None)
    if getattr(status, "name", status) == "INTERRUPTED":
        raise KeyboardInterrupt
    return result


def block_interrupts() -> set[Any]:
    """Block interrupts in this thread and what it starts; return the signals blocked before.

    The resource tracker of `multiprocessing` is started first, as its start unblocks interrupts
    again.
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
    """In this context interrupts wait until it is safe, and one that was swallowed comes again.

    A signal that is ignored (``nohup``) or has another handler is left alone; nothing changes
    outside the main thread, or if the system's timer is in use.

    Raises KeyboardInterrupt: with the signal's name, as soon as it is safe; at the end if an
        interrupt still waits then.
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
        # the system's timer: to start a thread takes locks that the main thread may hold
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
