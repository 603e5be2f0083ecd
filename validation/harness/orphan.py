"""A worker process ends with the command that started it, also when that one is killed.

Nothing tells a child of its parent's SIGKILL: it would go on computing for nobody, or wait for
work for ever. Every ``multiprocessing`` child holds a handle that becomes ready when its parent
ends; a thread waits for it. What the worker had finished is written whole already.
"""

import multiprocessing
import os
import threading
from multiprocessing.connection import wait


def end_with_parent() -> None:
    """Call in a worker process, once, before its work."""
    parent = multiprocessing.parent_process()
    if parent is None:
        return
    sentinel = parent.sentinel

    def watch() -> None:
        wait([sentinel])
        os._exit(1)  # at once: an orphan has nobody to hand anything over to

    threading.Thread(target=watch, name="end-with-parent", daemon=True).start()
