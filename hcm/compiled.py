"""How the kernels of the step are compiled.

- Arrays are not reference-counted: a kernel takes and hands on dozens of them in tuples, and with
  a count of each a tap takes 1.3 times as long, to the same bits (measured on 15 elements). The
  price is that a kernel can't allocate; the caller in Python holds every array while it runs.
  `_nrt` is an option that numba doesn't promise to keep: pyproject.toml lets its next minor version
  in once tests/hcm/test_compiled.py passes with it.
- Divisions follow IEEE (infinity and NaN) instead of raising: what is not finite is found where
  Newton's iteration ends.
- a*b + c may be rounded once (`contract`), which is safe with NaN, unlike full fastmath.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit


def kernel_with(*fastmath: str, **options: object) -> Callable[[Callable[..., Any]], Any]:
    """`kernel` with these of LLVM's fast-math flags, and options of numba's own."""
    chosen: dict[str, Any] = {
        "cache": True,
        "error_model": "numpy",
        "fastmath": set(fastmath),
        "_nrt": False,
        **options,
    }
    return lambda function: njit(**chosen)(function)


# Compiles a function that allocates nothing; its machine code is cached beside its file.
kernel = kernel_with("contract")
# The same, for what has one caller in the innermost loop and becomes part of it: a call would hand
# over two hundred words, seven for each array in its tuples, which takes as long as a small kernel.
inlined = kernel_with("contract", inline="always")
