"""When a simplified Newton iteration stops, and how long its factors are kept.

Both integrators of the reduced model iterate with factors of an earlier tangent.
"""

from typing import NamedTuple

import numpy as np

from hcm.arrays import Floats, Ints
from hcm.compiled import kernel, kernel_with
from hcm.contact.contract import Law, stiffness_key
from hcm.contact.law import ContactState

ITERATIONS = 20
# Kept factors are given up once an iteration shrinks the change by less than this factor.
SLOW_RATE = 0.1
# Once kept factors have taken more iterations than this beyond those of the step that they were
# made in, new ones are made: one costs 2.6 to 2.7 (measured at 2 to 20 elements a phalanx).
SPARE_ITERATIONS = 2


class Kept(NamedTuple):
    """What kept factors belong to, and how well they have served.

    key : (5,) integrator weight or step (NaN: nothing kept), the contact's `stiffness_key`, and the
    factor of the part outside the factors. rate : (1,) last contraction that the factors gave, 1
    while unknown. age : (2,) iterations of the first step with these factors (0 before its end),
    and those beyond that in later steps.
    """

    key: Floats
    rate: Floats
    age: Ints


def nothing_kept() -> Kept:
    """Memory for what is kept."""
    return Kept(np.array([np.nan] * 5), np.array([1.0]), np.zeros(2, dtype=np.int64))


@kernel
def drop(kept: Kept) -> None:
    """Give the factors up."""
    kept.key[0] = np.nan


@kernel
def keep(
    size: float, unsymmetric_factor: float, contact: ContactState, law: Law, kept: Kept
) -> None:
    """Note what new factors belong to; size : integrator weight or step, as in `Kept`."""
    kept.key[1], kept.key[2], kept.key[3] = stiffness_key(contact, law)
    kept.key[0], kept.key[4] = size, unsymmetric_factor
    kept.rate[0] = 1.0
    kept.age[0] = kept.age[1] = 0


@kernel
def of_mode(contact: ContactState, law: Law, kept: Kept) -> bool:
    """Whether the factors are those of the contact's mode, if any are kept."""
    key, mode = kept.key, stiffness_key(contact, law)
    return key[1] == mode[0] and key[2] == mode[1] and key[3] == mode[2]


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
def count_iterations(iterations: int, kept: Kept) -> None:
    """Count a step's iterations, and drop factors that have come to cost more than new ones."""
    age = kept.age
    if age[0] == 0:
        age[0] = iterations
    else:
        age[1] += max(iterations - age[0], 0)
        if age[1] > SPARE_ITERATIONS:
            drop(kept)


@kernel
def converged(
    change: float, previous: float, largest: float, settled: bool, roundoff: float,
    tolerance: float, kept: Kept,
) -> tuple[bool, bool]:  # fmt: skip
    """Whether to stop after an iteration, and whether it was slow: its factors are then dropped.

    What is left after it is the change times rate/(1 - rate) (Hairer and Wanner 1996, section
    IV.8), the rate being that of the factors in use, here or in earlier steps.

    change, previous : largest change of this iteration and the one before (inf: none), m/s^2.
    largest : what `tolerance` is relative to. settled : whether a slow iteration below `roundoff`
    (m/s^2) may stop: the one before was fast, or its factors are new.
    """
    slow, left = False, kept.rate[0] ** 0.8  # a rate from an earlier step is trusted less
    if previous < np.inf:
        left = change / previous
        slow = left > SLOW_RATE
        if slow and change <= roundoff and settled:
            return True, slow
        kept.rate[0] = left
    done = change * min(1.0, left / max(1.0 - left, 0.5)) <= tolerance * largest
    if slow and not done:
        drop(kept)
    return done, slow
