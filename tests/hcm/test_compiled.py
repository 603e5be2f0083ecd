"""What the step's kernels ask of numba beyond what it promises: to be noticed with its versions."""

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numba
import numpy as np
import pytest
from numba.core.compiler import CompileResult
from numba.core.dispatcher import Dispatcher

import hcm
import hcm.compiled
from hcm.compiled import ByKind, InnerKernel, by_type, entry_with, kernel_with

Decorator = Callable[[Callable[..., float]], Callable[..., float]]
KERNEL = entry_with("contract", cache=False)  # a cached function's code can't be looked at


def handed_on(decorator: Decorator) -> Callable[..., float]:
    """Compile a loop that hands slices of arrays on in a tuple, as the step does."""

    @decorator
    def first(pair: tuple[np.ndarray, np.ndarray], i: int) -> float:
        return pair[0][i:][0] * pair[1][i]

    @decorator
    def outer(a: np.ndarray, b: np.ndarray) -> float:
        total = 0.0
        for i in range(a.size):
            total += first((a, b), i)
        return total

    return outer


def counts(function: Callable[..., float]) -> bool:
    code = function.inspect_llvm().values()  # type: ignore[attr-defined]
    return any("NRT_incref" in text or "NRT_decref" in text for text in code)


def test_kernels_count_no_references() -> None:
    x = np.arange(3.0)
    plain, ours = handed_on(numba.njit), handed_on(KERNEL)
    assert plain(x, x) == ours(x, x) == 5.0
    assert counts(plain)  # else this test sees nothing
    assert not counts(ours)


def test_a_kernel_that_allocates_is_refused() -> None:
    """Without counts nobody would free what it allocates."""

    @KERNEL
    def allocating(n: int) -> float:
        return np.empty(n).size

    with pytest.raises(numba.TypingError, match="empty"):
        allocating(3)


def test_a_kind_is_looked_at_once() -> None:
    @KERNEL
    def last(x: np.ndarray) -> float:
        return x[x.size - 1]

    by_kind, numbers = ByKind(last), {"floats": np.arange(3.0), "counts": np.arange(3)}
    for _ in range(2):
        for kind, x in numbers.items():
            assert by_kind(kind, x) == 2
    assert len({*by_kind.entries.values()}) == 2
    # an array of another type or layout would be misread: all tests look for one
    for other in (numbers["counts"], np.arange(6.0)[::2]):
        with pytest.raises((AssertionError, KeyError)):
            by_kind("floats", other)


def test_what_has_no_code_for_such_a_call_is_refused() -> None:
    def same(x: float) -> float:
        return x

    inner, entry = kernel_with()(same), entry_with(cache=False)(same)
    with pytest.raises(TypeError, match="must be an entry"):
        ByKind(inner)
    with pytest.raises(TypeError, match="must be compiled by kernel"):
        by_type(hcm.compiled.ByKind, inner, entry)


def test_what_only_kernels_call_is_code_of_its_callers_alone() -> None:
    """The caller is compiled as one piece, and its kernel has no machine code."""

    @kernel_with()
    def double(x: float) -> float:
        return x + x

    @KERNEL
    def twice(x: float) -> float:
        return double(double(x))

    assert twice(1.5) == 6.0
    own, callers = (function.overloads[numba.float64,] for function in (double, twice))
    engine = callers.library.codegen._engine
    assert engine.is_symbol_defined(callers.fndesc.mangled_name)
    assert not engine.is_symbol_defined(own.fndesc.mangled_name)
    assert " call " not in body_of(callers)
    assert double(1.5) == 3.0  # a test may call it, too


def test_a_kernel_rounds_alike_whatever_was_compiled_before() -> None:
    """numba keeps its power of a whole number by its types alone, compiled as first asked for."""

    def power(x: float, n: int) -> float:
        return x**n

    for flags, contracts in ((("contract",), True), ((), False)):
        compiled = entry_with(*flags, cache=False)(power)
        assert compiled(1.5, 3) == 3.375
        assert ("fmul contract" in "".join(compiled.inspect_llvm().values())) == contracts


def body_of(compiled: CompileResult) -> str:
    """The text of a function in LLVM's language, as it is after optimization."""
    return str(compiled.library.get_function(compiled.fndesc.mangled_name))


def test_every_entry_is_stamped_with_the_files_that_it_is_compiled_from() -> None:
    kernels = {
        kernel
        for module in pkgutil.walk_packages(hcm.__path__, "hcm.")
        for kernel in vars(importlib.import_module(module.name)).values()
        if isinstance(kernel, Dispatcher) and not isinstance(kernel, InnerKernel)
    }
    assert len(kernels) > 25
    for kernel in kernels:
        stamp = hcm.compiled.source_stamp(Path(kernel.py_func.__code__.co_filename))
        assert kernel._cache._cache_file._source_stamp == stamp, kernel


def test_whole_numbers_are_read_as_the_numbers_that_they_are() -> None:
    """Kernels that are called by kind are compiled for the first numbers that they get: whole ones
    before all others give the same bits.
    """
    rod = hcm.Phalanx(1, 1 / 16, 10**12, 1000, 2)
    runs = []
    for number in (int, float):
        table = hcm.TorqueTable(
            (number(0), 0.125, number(1)), ((number(0),), (number(1),), (number(2),))
        )
        fall = hcm.Drive(gravity=number(10), table=table)
        for surface, drive in (
            (hcm.Surface(0.5, number(0)), hcm.Drive(gravity=number(10))),
            (hcm.Surface(0.5, number(0)), fall),
        ):
            for flight in ("rigid", "elastic"):
                settings = hcm.Settings(
                    flight=flight, flight_tolerance=number(0), flight_step=1 / 1024,
                    max_flight_time=number(1), estimate=False,
                )  # fmt: skip
                start = hcm.RigidStart((number(0),), (number(1),), number(0))
                run = hcm.simulate(
                    hcm.Finger((replace(rod, length=number(1), density=number(1000)),)),
                    surface, hcm.Tip(number(10**5)), drive, settings, start=start,
                )  # fmt: skip
                assert run.status is hcm.Status.COMPLETED
                runs.append((run.summary, run.history.normal_force_N.tobytes()))
    assert runs[: len(runs) // 2] == runs[len(runs) // 2 :]
