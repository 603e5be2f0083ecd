"""An interrupt that Python swallows comes again.

A handler may run within a finalizer, a weak reference's callback (every import has one) or a call
back from C (llvmlite's, while compiled code is loaded). No exception leaves those: Python prints
"Exception ignored" and goes on, and so would a command that was told to stop.
"""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

SOON_S = 0.05  # by then the call that swallowed the interrupt has returned


@contextmanager
def heard_interrupts() -> Iterator[None]:
    """While it lasts, send the main thread a swallowed interrupt again."""
    ordinary = sys.unraisablehook
    main_thread = threading.main_thread().ident or 0

    def send_again(unraisable: "sys.UnraisableHookArgs") -> None:
        if not issubclass(unraisable.exc_type, KeyboardInterrupt):
            ordinary(unraisable)
            return
        timer = threading.Timer(SOON_S, signal.pthread_kill, (main_thread, signal.SIGINT))
        timer.daemon = True
        timer.start()

    sys.unraisablehook = send_again
    try:
        yield
    finally:
        sys.unraisablehook = ordinary
