"""What the step's kernels ask of numba beyond what it promises: to be noticed with its versions."""

from collections.abc import Callable

import numba
import numpy as np
import pytest

from hcm.compiled import kernel_with

Decorator = Callable[[Callable[..., float]], Callable[..., float]]
KERNEL = kernel_with("contract", cache=False)  # a cached function's code can't be looked at


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
