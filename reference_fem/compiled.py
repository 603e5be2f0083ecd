"""numba's `njit`, whose cache on disk notices every edit that matters.

A cached kernel contains the code of the functions that it calls, but numba compares the kernel's
own file only. Here a cached kernel is stale once any file in its folder, which holds its overloads
(see `elements.loops`), or any file of this package that those import has changed.
"""

import functools
import hashlib
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core.registry import CPUDispatcher
from numba.extending import overload

from reference_fem.linked import LinkedCompiler, OwnCompiler

# Threads that spin while they wait for each other make a run on a busy machine 10 to 20 times
# slower; libgomp reads this as it is loaded, by the first mesh (gmsh) or the first kernel.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

PACKAGE = Path(__file__).parent
_IMPORT = re.compile(rf"^\s*(?:from|import)\s+({PACKAGE.name}\b[\w.]*)", re.MULTILINE)


class InnerKernel(CPUDispatcher):
    """A kernel without code of its own: the first call from Python compiles some."""

    def __call__(self, *args: Any) -> Any:
        """Call the kernel from Python, as the tests do."""
        return self.entry(*args)

    @functools.cached_property
    def entry(self) -> Callable[..., Any]:
        """The kernel with code for calls from Python, not cached on disk."""
        own = ("nopython", "inline", "no_cpython_wrapper")
        options = {name: value for name, value in self.targetoptions.items() if name not in own}
        return numba.njit(**options)(self.py_func)


# Options of all kernels. A kernel that states no fast-math flags or error model takes those of the
# caller for which it is compiled first.
OPTIONS = {
    "error_model": "numpy",
    "fastmath": set[str](),
    "no_cfunc_wrapper": True,
    "pipeline_class": OwnCompiler,
}


def njit(**options: object) -> Callable[[Callable[..., Any]], Any]:
    """`numba.njit` with these options, whose cache is stamped with a digest of the sources."""
    options = {**OPTIONS, **options}

    def decorate(function: Callable[..., Any]) -> Any:
        dispatcher = numba.njit(**options)(function)
        if options.get("cache"):
            stamp = source_stamp(Path(function.__code__.co_filename))
            # Private to numba; a test shows that the version in use still reads them.
            file = dispatcher._cache._cache_file
            file._source_stamp = stamp
            file._load_index = functools.partial(_readable_index, file._load_index)
        return dispatcher

    return decorate


def _readable_index(load: Callable[[], dict[Any, Any]]) -> dict[Any, Any]:
    """Load a cache's index; empty if it names a type that has moved since it was written."""
    try:
        return load()
    except (ImportError, AttributeError):
        return {}


def source_stamp(file: Path) -> str:
    """SHA-256 of a file's folder and all files of this package imported there, directly or not."""
    digests: dict[Path, bytes] = {}
    waiting = [*file.parent.rglob("*.py")]
    while waiting:
        path = waiting.pop()
        if path not in digests:
            digests[path], imported = _digest_and_imports(path)
            waiting += imported
    return hashlib.sha256(b"".join(digests[path] for path in sorted(digests))).hexdigest()


@functools.cache
def _digest_and_imports(file: Path) -> tuple[bytes, tuple[Path, ...]]:
    """A file's digest, and the package's files that it imports: all of them for a folder."""
    text = file.read_text(encoding="utf-8")
    imported: list[Path] = []
    for name in _IMPORT.findall(text):
        path = PACKAGE.parent.joinpath(*name.split("."))
        imported += path.rglob("*.py") if path.is_dir() else [path.with_suffix(".py")]
    return hashlib.sha256(text.encode()).digest(), tuple(imported)


# Fast-math flags of the elements' kernels. No nnan or ninf: a NaN in the displacement must reach
# the audit, not be optimised away.
SAFE_MATH = {"contract", "nsz"}
entry = njit(cache=True, fastmath=SAFE_MATH)
# Options of what only kernels call.
LINKED = {**OPTIONS, "no_cpython_wrapper": True, "pipeline_class": LinkedCompiler}


def inner(**options: object) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function that only kernels call, with these options of numba."""

    def decorate(function: Callable[..., Any]) -> Any:
        dispatcher = numba.njit(**{**LINKED, **options})(function)
        dispatcher.__class__ = InnerKernel
        return dispatcher

    return decorate


def use_for(asked: Any, kind: type, code: Callable[..., Any], **options: object) -> None:
    """Have kernels call `code` for `asked` where its first argument is of the named tuple `kind`.

    It is found by its type as the caller is compiled: nothing is looked up at run time, and the
    callers stay in numba's cache, which closures over kernels would not.
    """

    def choose(first: Any, *rest: Any) -> Any:
        return code if getattr(first, "instance_class", None) is kind else None

    overload(asked, strict=False, jit_options={**LINKED, **options})(choose)


kernel = inner(fastmath=SAFE_MATH)
inlined = inner(fastmath=SAFE_MATH, forceinline=True)
