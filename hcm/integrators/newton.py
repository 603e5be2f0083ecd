"""When a simplified Newton iteration stops, and how long its factors are kept.

Both integrators of the reduced model iterate with factors of an earlier tangent.
"""

import numpy as np

from hcm.arrays import Floats, Ints
from hcm.compiled import kernel, kernel_with

ITERATIONS = 20
# Kept factors are given up once an iteration shrinks the change by less than this factor.
SLOW_RATE = 0.1
# Once kept factors have taken more iterations than this beyond those of the step that they were
# made in, new ones are made: one costs 2.6 to 2.7 (measured at 2 to 20 elements a phalanx).
SPARE_ITERATIONS = 2


@kernel_with("nnan", "nsz")
def largest_size(x: Floats) -> float:
    """Max |x_i|; meaningless if one is NaN (ask `is_finite` first), so that it is vectorised."""
    largest = 0.0
    for i in range(x.size):
        largest = max(largest, abs(x[i]))
    return largest


@kernel_with("nnan", "nsz")
def largest_in_units(x: Floats, unit: Floats) -> float:
    """Max |x_i|/unit_i; meaningless if one is NaN, like `largest_size`."""
    largest = 0.0
    for i in range(x.size):
        largest = max(largest, abs(x[i]) / unit[i])
    return largest


@kernel_with("reassoc")
def is_finite(x: Floats) -> bool:
    """Whether all of x is finite: any NaN or infinity makes the sum of sizes NaN or infinite."""
    total = 0.0
    for i in range(x.size):
        total += abs(x[i])
    return total < np.inf


@kernel
def count_iterations(iterations: int, age: Ints, key: Floats) -> None:
    """Count a step's iterations, and drop factors that have come to cost more than new ones."""
    if age[0] == 0:
        age[0] = iterations
    else:
        age[1] += max(iterations - age[0], 0)
        if age[1] > SPARE_ITERATIONS:
            key[0] = np.nan


@kernel
def converged(
    change: float, previous: float, largest: float, settled: bool, roundoff: float,
    tolerance: float, rate: Floats,
) -> tuple[bool, bool]:  # fmt: skip
    """Whether to stop after an iteration, and whether it was slow.

    What is left after it is the change times rate/(1 - rate) (Hairer and Wanner 1996, section
    IV.8), the rate being that of the factors in use, here or in earlier steps.

    change, previous : largest change of this iteration and the one before (inf: none), m/s^2.
    largest : what `tolerance` is relative to. settled : whether a slow iteration below `roundoff`
    (m/s^2) may stop: the one before was fast, or its factors are new. rate : (1,), updated.
    """
    slow, left = False, rate[0] ** 0.8  # a rate from an earlier step is trusted less
    if previous < np.inf:
        left = change / previous
        slow = left > SLOW_RATE
        if slow and change <= roundoff and settled:
            return True, slow
        rate[0] = left
    return change * min(1.0, left / max(1.0 - left, 0.5)) <= tolerance * largest, slow
