"""Limits and variables that a shell gives a process, refused if no model could run with them.

numba, LLVM and OpenBLAS do not survive these: they end in traces, crashes, or retry for minutes.
"""

import os
import resource
import sys

from validation.errors import UserError

# Address space. hcm crashed below 0.6 GB, the solid models below 1.0 GB (tried with `ulimit -v` in
# steps of 0.1 GB on two cores); OpenBLAS takes some 30 MB more for each further core.
LEAST_ADDRESS_SPACE = 10**9


def open_closed_streams() -> None:
    """Open closed standard streams on the null device.

    Otherwise libraries would write to any file that took a closed stream's number, and Python would
    print to standard output what is meant for a missing standard error.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):  # in order of number
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115 - stays


def refuse_unusable_surroundings() -> None:
    """Refuse limits and environment variables with which numba or OpenBLAS cannot work.

    Raises UserError: one line: the limit or the variable, its value, what is allowed and what to
        do.
    """
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit != resource.RLIM_INFINITY and limit < LEAST_ADDRESS_SPACE:
        raise UserError(
            f"ulimit -v {limit // 1024}: must be at least {LEAST_ADDRESS_SPACE // 1024}, which the "
            "compiled code's libraries need; raise the limit, or set none"
        )
    threads = os.environ.get("NUMBA_NUM_THREADS")
    if threads is not None and not (threads.isdecimal() and int(threads) > 0):
        raise UserError(
            f"NUMBA_NUM_THREADS = {threads!r}: must be a whole number >= 1; set it so or unset it"
        )
    if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        raise UserError(
            f"NUMBA_DISABLE_JIT = {os.environ['NUMBA_DISABLE_JIT']!r}: must be 0: "
            "the models' kernels run compiled only; unset it"
        )
