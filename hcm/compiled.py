"""How the kernels of the step are compiled.

- Arrays are not reference-counted: a kernel takes and hands on dozens of them in tuples, and with
  a count of each a tap takes 1.3 times as long, to the same bits (measured on 15 elements). The
  price is that a kernel can't allocate; the caller in Python holds every array while it runs.
  `_nrt` is an option that numba doesn't promise to keep: pyproject.toml lets its next minor version
  in once tests/hcm/test_compiled.py passes with it.
- Divisions follow IEEE (infinity and NaN) instead of raising: what is not finite is found where
  Newton's iteration ends.
- a*b + c may be rounded once (`contract`), which is safe with NaN, unlike full fastmath.
- Machine code is cached on disk, and a kernel contains the code of those that it calls, so what is
  cached is stale once any file that the kernel's own imports is edited. numba compares the kernel's
  own file only; here it compares all of them (`source_stamp`).
"""

import functools
import hashlib
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import njit, typeof
from numba.core.caching import IndexDataCacheFile
from numba.extending import overload

PACKAGE = Path(__file__).parent
IMPORT = re.compile(rf"^\s*(?:from|import)\s+({PACKAGE.name}\b[\w.]*)", re.MULTILINE)


@functools.cache
def _source(file: Path) -> tuple[bytes, tuple[Path, ...]]:
    """A file's digest, and the files of this package that it imports; of a folder all files."""
    text = file.read_text(encoding="utf-8")
    imported: list[Path] = []
    for name in IMPORT.findall(text):
        path = PACKAGE.parent.joinpath(*name.split("."))
        imported += path.rglob("*.py") if path.is_dir() else [path.with_suffix(".py")]
    return hashlib.sha256(text.encode()).digest(), tuple(imported)


def source_stamp(file: Path) -> str:
    """Digest of a file and of all files of this package that it imports, directly or not."""
    found: dict[Path, bytes] = {}
    waiting = [file]
    while waiting:
        file = waiting.pop()
        if file not in found:
            found[file], imported = _source(file)
            waiting += imported
    return hashlib.sha256(b"".join(found[file] for file in sorted(found))).hexdigest()


class CacheFile(IndexDataCacheFile):
    """What is cached of one kernel: nothing where it was compiled for types that are gone."""

    def _load_index(self) -> dict[Any, str]:
        try:
            return super()._load_index()
        # the index names its types by module and class, and is read before its stamp is compared
        except (AttributeError, ImportError):
            return {}


def kernel_with(*fastmath: str, **options: object) -> Callable[[Callable[..., Any]], Any]:
    """`kernel` with these of LLVM's fast-math flags, and options of numba's own."""
    chosen: dict[str, Any] = {
        "cache": True,
        "error_model": "numpy",
        "fastmath": set(fastmath),
        "_nrt": False,
        **options,
    }

    def compiled(function: Callable[..., Any]) -> Any:
        dispatcher = njit(**chosen)(function)
        if chosen["cache"]:
            # private to numba, as is `_nrt`: the same test lets its next version in
            cache, stamp = dispatcher._cache, source_stamp(Path(function.__code__.co_filename))
            name = cache._impl.filename_base
            cache._cache_file = CacheFile(cache.cache_path, name, stamp)
        return dispatcher

    return compiled


# Compiles a function that allocates nothing.
kernel = kernel_with("contract")
# The same, for what has one caller in the innermost loop and becomes part of it: a call would hand
# over two hundred words, seven for each array in its tuples, which takes as long as a small kernel.
inlined = kernel_with("contract", inline="always")
# For what allocates its results, outside the step: arrays are counted, and each sum is rounded.
allocating = kernel_with(_nrt=True, error_model="python")


class ByKind:
    """Calls of a kernel from Python without numba's check of every type in its tuples.

    The check takes six times as long as passing the arguments (9.3 and 1.6 us of the loop's 43
    arrays and 50 numbers). In tuples that this package makes, types and layouts follow from their
    classes and from the `kind` that the caller gives. Arguments of other types would be misread,
    numbers too: code compiled for integers reads 0.5 as 0. The tests check each call (`looked_at`).
    """

    def __init__(self, kernel: Callable[..., Any]) -> None:
        self.kernel: Any = kernel
        self.entries: dict[Any, Callable[..., Any]] = {}

    def __call__(self, kind: Any, *args: Any) -> Any:
        """What the kernel returns; numba checks the types at the first call of a kind."""
        if entry := self.entries.get(kind):
            return entry(*args)
        result = self.kernel(*args)
        self.entries[kind] = self.looked_at(args)
        return result

    def looked_at(self, args: tuple[Any, ...]) -> Callable[..., Any]:
        """Machine code for arguments of just these types; KeyError where there is none."""
        found: Callable[..., Any] = self.kernel.overloads[tuple(map(typeof, args))].entry_point
        return found


def by_type(kind: type, special: Callable[..., Any], plain: Any) -> Callable[..., Any]:
    """A kernel that is `special` where an argument is of the named tuple `kind`, else `plain`:
    another kernel, or what is returned whatever the arguments are.

    Chosen while its caller is compiled: the choice costs nothing, and a run compiles one of them.
    """

    def chosen(*args: Any) -> Any:
        found = special if any(isinstance(arg, kind) for arg in args) else plain
        return found(*args) if callable(found) else found

    @overload(chosen)
    def choose(*args: Any) -> Callable[..., Any]:
        is_kind = any(getattr(arg, "instance_class", None) is kind for arg in args)
        found = special if is_kind else plain

        def call(*args: Any) -> Any:
            return found(*args)

        def same(*args: Any) -> Any:
            return found

        return call if callable(found) else same

    return chosen
