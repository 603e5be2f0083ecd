"""What numba compiles when a kernel runs for the first time, reported while it happens."""

import contextlib
from collections.abc import Callable, Iterator
from typing import Any


@contextlib.contextmanager
def compiling_reported(progress: Callable[[float, str], None] | None) -> Iterator[None]:
    """Call `progress` with each kernel's name as numba begins to compile it.

    Code that is loaded from the cache beside the sources is not compiled, and nothing is reported.
    """
    if progress is None:
        yield
        return
    from numba.core import event

    tell = progress

    class Listener(event.Listener):
        """Names every kernel as its turn comes; those that it calls are compiled within it."""

        def __init__(self) -> None:
            self.depth = 0

        def on_start(self, event: Any) -> None:
            self.depth += 1
            function = event.data["dispatcher"].py_func
            tell(0.0, f"first run: compiling {function.__module__}.{function.__name__}")

        def on_end(self, event: Any) -> None:
            self.depth -= 1
            if self.depth == 0:
                tell(0.0, "compiled; kept for the next run")

    with event.install_listener("numba:compile", Listener()):
        yield
