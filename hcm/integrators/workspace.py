"""The integrator's coefficients, factors and scratch memory, and how they are made."""

from typing import NamedTuple

import numpy as np

from hcm.arrays import Floats, Ints
from hcm.beam.banded_ldl import HALF_BANDWIDTH, storage
from hcm.beam.chain import Chain
from hcm.compiled import kernel
from hcm.contact.contract import Law
from hcm.integrators.newton import Kept, nothing_kept


class Coefficients(NamedTuple):
    """alpha_m, alpha_f, beta, gamma, Newton's tolerance, `error`: see `local_error`.

    reuse : whether factors serve again (False: a factorization in every iteration).
    """

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    tolerance: float
    error: float
    reuse: bool


class Workspace(NamedTuple):
    """Factors kept between iterations and steps, with what they belong to, and scratch.

    factors : (w + n, w + 1). kept : what they belong to. rank_one : (w + n,) the factors' solution
    for the part outside them.
    right : (w + n,) right-hand side. increment : (n,) change of q over the step. cost : (2,)
    iterations and factorizations so far.
    """

    factors: Floats
    kept: Kept
    rank_one: Floats
    right: Floats
    increment: Floats
    cost: Ints


class Integrator(NamedTuple):
    """What a step needs besides the state: method, finger, contact's constants, memory."""

    co: Coefficients
    chain: Chain
    law: Law
    work: Workspace


@kernel
def trapezoidal(co: Coefficients) -> Coefficients:
    """The coefficients for a spectral radius of 1, which give the trapezoidal rule."""
    return Coefficients(0.5, 0.5, 0.25, 0.5, co.tolerance, 0.25 - 1 / 6, co.reuse)


def coefficients(spectral_radius: float, tolerance: float, reuse: bool = True) -> Coefficients:
    """Arnold and Bruls' optimal parameters for the spectral radius xi."""
    xi = spectral_radius
    alpha_m, alpha_f = (2 * xi - 1) / (xi + 1), xi / (xi + 1)
    beta = 0.25 * (1 + alpha_f - alpha_m) ** 2
    gamma, error = 0.5 + alpha_f - alpha_m, abs(beta + 0.5 * (alpha_m - alpha_f) - 1 / 6)
    return Coefficients(alpha_m, alpha_f, beta, gamma, tolerance, error, reuse)


def workspace(n: int) -> Workspace:
    """Allocate for n bordered unknowns, with no factors kept."""
    rank_one, right = np.zeros((2, HALF_BANDWIDTH + n))
    cost = np.zeros(2, dtype=np.int64)
    return Workspace(storage(n), nothing_kept(), rank_one, right, np.empty(n), cost)
