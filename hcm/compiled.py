"""How the kernels of the step are compiled.

- Arrays are not reference-counted: a kernel takes and passes on dozens of them in tuples, and
  counting them makes a tap take 1.3 times as long, with the same bits (measured on 15 elements).
  The price is that a kernel can't allocate; the caller in Python holds every array while it runs.
  `_nrt` is an option that numba doesn't promise to keep: pyproject.toml admits numba's next minor
  version once tests/hcm/test_compiled.py passes with it.
- Divisions follow IEEE (infinity and NaN) instead of raising: values that are not finite are found
  at the end of Newton's iteration.
- No kernel has code for calls from C, and those that only kernels call (`kernel`) have none of
  their own at all (`hcm.linked`). A first tap compiles in 45 s of processor and 0.63 GB (measured).
- a*b + c may be rounded once (`contract`), which is safe with NaN, unlike full fastmath.
- Machine code of entries is cached on disk, and contains the code of what they call, so that it is
  stale once any file that the entry's file imports is edited. By itself numba compares the entry's
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
from numba.core.registry import CPUDispatcher
from numba.extending import overload

from hcm.linked import LinkedCompiler, OwnCompiler

PACKAGE = Path(__file__).parent
IMPORT = re.compile(rf"^\s*(?:from|import)\s+({PACKAGE.name}\b[\w.]*)", re.MULTILINE)


@functools.cache
def _source(file: Path) -> tuple[bytes, tuple[Path, ...]]:
    """A file's digest, and the files of this package that it imports (all files of a folder)."""
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
    """Cache index of one kernel; empty if it names types that no longer exist."""

    def _load_index(self) -> dict[Any, str]:
        try:
            return super()._load_index()
        # the index names its types by module and class, and is read before its stamp is compared
        except (AttributeError, ImportError):
            return {}


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
        return njit(**options)(self.py_func)


def options_of(*fastmath: str, **options: object) -> dict[str, object]:
    """Options of numba for a kernel with these LLVM fast-math flags and `options`."""
    ours = {
        "error_model": "numpy",
        "fastmath": {*fastmath},
        "no_cfunc_wrapper": True,
        "_nrt": False,
        "pipeline_class": OwnCompiler,
    }
    return {**ours, **options}


def entry_with(
    *fastmath: str, cache: bool = True, **options: object
) -> Callable[[Callable[..., Any]], Any]:
    """`entry` with these LLVM fast-math flags and numba options."""

    def compiled(function: Callable[..., Any]) -> Any:
        dispatcher = njit(cache=cache, **options_of(*fastmath, **options))(function)
        if cache:
            # private to numba, as `_nrt` is: the same test checks it with the next version
            found, stamp = dispatcher._cache, source_stamp(Path(function.__code__.co_filename))
            name = found._impl.filename_base
            found._cache_file = CacheFile(found.cache_path, name, stamp)
        return dispatcher

    return compiled


# Compiles a function that allocates nothing, and that Python calls too.
entry = entry_with("contract")


def linked_options(*fastmath: str, **options: object) -> dict[str, object]:
    """`options_of` a function that only kernels call."""
    own = {"no_cpython_wrapper": True, "pipeline_class": LinkedCompiler}
    return options_of(*fastmath, **own, **options)


def kernel_with(*fastmath: str, **options: object) -> Callable[[Callable[..., Any]], Any]:
    """`kernel` with these LLVM fast-math flags and numba options."""

    def compiled(function: Callable[..., Any]) -> Any:
        dispatcher = njit(**linked_options(*fastmath, **options))(function)
        dispatcher.__class__ = InnerKernel
        return dispatcher

    return compiled


# The same for functions that only kernels call.
kernel = kernel_with("contract")
# The same for a function with one caller in the innermost loop, of which it becomes part: a call
# would pass two hundred words, seven for each array in its tuples, in the time of a small kernel.
inlined = kernel_with("contract", inline="always")
# For functions outside the step that allocate their results: arrays are counted, each sum rounded.
allocating = entry_with(_nrt=True, error_model="python")


class ByKind:
    """Call a kernel from Python without numba's check of every type in its tuples.

    The check takes six times as long as passing the arguments (9.3 and 1.6 us of the loop's 43
    arrays and 50 numbers). In tuples that this package makes, types and layouts follow from their
    classes and from the `kind` that the caller gives. Arguments of other types would be misread,
    numbers too: code compiled for integers reads 0.5 as 0. The tests check each call (`looked_at`).
    """

    def __init__(self, kernel: Callable[..., Any]) -> None:
        if isinstance(kernel, InnerKernel):
            raise TypeError(f"{kernel.__name__}: must be an entry, which has code for calls")
        self.kernel: Any = kernel
        self.entries: dict[Any, Callable[..., Any]] = {}

    def __call__(self, kind: Any, *args: Any) -> Any:
        """Call the kernel; numba checks the types at the first call of a kind only."""
        if entry := self.entries.get(kind):
            return entry(*args)
        result = self.kernel(*args)
        self.entries[kind] = self.looked_at(args)
        return result

    def looked_at(self, args: tuple[Any, ...]) -> Callable[..., Any]:
        """Machine code for arguments of exactly these types; raises KeyError if there is none."""
        found: Callable[..., Any] = self.kernel.overloads[tuple(map(typeof, args))].entry_point
        return found


def by_type(kind: type, special: Any, plain: Any) -> Callable[..., Any]:
    """Return a kernel that is `special` if an argument is of the named tuple `kind`, else `plain`:
    another kernel, or a constant that is returned whatever the arguments are.

    Both are compiled as by `kernel`. The choice is made while the caller is compiled: it costs
    nothing, and a run compiles only one.
    """
    for one in (special, plain):
        if callable(one) and not isinstance(one, InnerKernel):
            raise TypeError(f"{one}: must be compiled by kernel, as which it is compiled here")

    def chosen(*args: Any) -> Any:
        found = special if any(isinstance(arg, kind) for arg in args) else plain
        return found(*args) if callable(found) else found

    # not strict: kernels name their arguments, `choose` does not
    @overload(chosen, strict=False, jit_options=linked_options("contract"))
    def choose(*args: Any) -> Callable[..., Any]:
        is_kind = any(getattr(arg, "instance_class", None) is kind for arg in args)
        found = special if is_kind else plain

        def same(*args: Any) -> Any:
            return found

        return found.py_func if callable(found) else same

    return chosen
