"""gmsh behind a context manager: one model in, one model out, whatever happens between."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType

from meshes.errors import MeshError

_OPTIONS = {
    "General.Terminal": 0,
    "General.Verbosity": 0,
    "General.NumThreads": 1,  # several threads may number nodes differently from run to run
    "Geometry.AutoCoherence": 0,
    "Mesh.ElementOrder": 1,
    "Mesh.RandomSeed": 1,
    "Mesh.Renumber": 0,
}

# gmsh keeps its state per process, so two threads must not build at the same time.
_LOCK = threading.Lock()


@contextmanager
def gmsh_session(name: str) -> Iterator[ModuleType]:
    """Yield the gmsh module with an empty model of that name, and clean up afterwards.

    gmsh is initialized without signal handlers (so that it works outside the main thread) and
    finalized at the end; if the caller had it running already, only our model is removed and the
    caller's options and current model are put back.

    Raises
    ------
    MeshError
        If gmsh cannot be loaded or reports an error of its own.
    """
    try:
        import gmsh
    except (ImportError, OSError) as error:
        raise MeshError(
            f"gmsh cannot be loaded ({error}): on Debian or Ubuntu install libgl1 libglu1-mesa "
            "libxft2 libxcursor1 libxinerama1 libgomp1"
        ) from error
    with _LOCK:
        ours = not gmsh.isInitialized()
        if ours:
            gmsh.initialize(readConfigFiles=False, interruptible=False)
        before = {key: gmsh.option.getNumber(key) for key in _OPTIONS}
        current = gmsh.model.getCurrent()
        try:
            for key, value in _OPTIONS.items():
                gmsh.option.setNumber(key, value)
            gmsh.model.add(name)
            yield gmsh
        finally:
            if ours:
                gmsh.finalize()
            else:
                gmsh.model.remove()
                for key, value in before.items():
                    gmsh.option.setNumber(key, value)
                if current in gmsh.model.list():
                    gmsh.model.setCurrent(current)
