"""One step of the generalized-alpha method (paper, eqs. 27-28; Arnold and Bruls 2007, eqs. 11-13).

    q1 = q0 + h v0 + h^2 ((1/2 - beta) a0 + beta a1),   v1 = v0 + h ((1 - gamma) a0 + gamma a1),
    (1 - alpha_m) a1 + alpha_m a0 = (1 - alpha_f) q..1 + alpha_f q..0,

with alpha_m = (2 xi - 1)/(xi + 1), alpha_f = xi/(xi + 1), gamma = 1/2 + alpha_f - alpha_m,
beta = (1 + alpha_f - alpha_m)^2/4: order 2 in q, v and lam, spectral radius xi at infinite
frequency. The equations of motion hold at the step's end with q..1 and lam1 as unknowns.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from hcm.banded_lu import factorize, solve
from hcm.equations import residual, tangent
from hcm.layout import HALF_BANDWIDTH, Chain, Law
from hcm.lumped_contact import Contact, contact_tangent

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

ITERATIONS = 20
# Kept factors are given up once an iteration shrinks the change by less than this factor: a fresh
# factorization costs about as much as three iterations.
SLOW = 0.1


class Coefficients(NamedTuple):
    """alpha_m, alpha_f, beta, gamma, Newton's tolerance, and `error`: see `local_error`."""

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    tolerance: float
    error: float


class Motion(NamedTuple):
    """State of the integrator: q, v, bordered acceleration (q.., lam) and a, each (n,)."""

    q: Floats
    v: Floats
    acceleration: Floats
    a: Floats


class Workspace(NamedTuple):
    """LU factors kept between iterations and steps, with what they belong to, and scratch.

    band : (n, 3 w + 1); pivots : (n,). key : (4,) integrator weight (NaN: nothing kept) and
    dF_c/dq. right : (n,) right-hand side. cost : (2,) iterations and factorizations so far.
    """

    band: Floats
    pivots: Ints
    key: Floats
    right: Floats
    cost: Ints


def coefficients(spectral_radius: float, tolerance: float) -> Coefficients:
    """Arnold and Bruls' optimal parameters for the spectral radius xi."""
    xi = spectral_radius
    alpha_m, alpha_f = (2 * xi - 1) / (xi + 1), xi / (xi + 1)
    beta = 0.25 * (1 + alpha_f - alpha_m) ** 2
    return Coefficients(
        alpha_m,
        alpha_f,
        beta,
        0.5 + alpha_f - alpha_m,
        tolerance,
        abs(beta + 0.5 * (alpha_m - alpha_f) - 1 / 6),
    )


def workspace(n: int) -> Workspace:
    """Allocate for n bordered unknowns, with no factors kept."""
    return Workspace(
        np.empty((n, 3 * HALF_BANDWIDTH + 1)),
        np.empty(n, dtype=np.int64),
        np.full(4, np.nan),
        np.empty(n),
        np.zeros(2, dtype=np.int64),
    )


@njit(cache=True)
def solve_linear(
    q: Floats, weight: float, chain: Chain, contact: Contact, law: Law, work: Workspace
) -> bool:
    """Overwrite work.right (scaled by D) with the solution; factorize unless the factors fit."""
    dtx, dty, dny = contact_tangent(contact, law)
    key = work.key
    if not (key[0] == weight and key[1] == dtx and key[2] == dty and key[3] == dny):
        key[0] = np.nan
        tangent(q, weight, chain, contact, law, work.band)
        if not factorize(work.band, work.pivots):
            return False
        key[0], key[1], key[2], key[3] = weight, dtx, dty, dny
        work.cost[1] += 1
    solve(work.band, work.pivots, work.right)
    return True


@njit(cache=True)
def update(h: float, co: Coefficients, old: Motion, new: Motion) -> None:
    """Fill new.a, new.q and new.v from new.acceleration (eqs. 27-28)."""
    for i in range(old.q.size):
        a0 = old.a[i]
        a1 = (
            (1.0 - co.alpha_f) * new.acceleration[i]
            + co.alpha_f * old.acceleration[i]
            - co.alpha_m * a0
        ) / (1.0 - co.alpha_m)
        new.a[i] = a1
        new.q[i] = old.q[i] + h * old.v[i] + h * h * ((0.5 - co.beta) * a0 + co.beta * a1)
        new.v[i] = old.v[i] + h * ((1.0 - co.gamma) * a0 + co.gamma * a1)


@njit(cache=True)
def step(
    h: float,
    co: Coefficients,
    old: Motion,
    new: Motion,
    chain: Chain,
    contact: Contact,
    law: Law,
    work: Workspace,
) -> bool:
    """Advance `old` by h into `new`, the contact staying in its mode.

    Newton's iteration on (q.., lam) with the exact tangent, whose factors are kept as long as each
    iteration shrinks the change by `SLOW`. Returns whether it converged; `new` is then finite.
    """
    n = old.q.size
    weight = h * h * co.beta * (1.0 - co.alpha_f) / (1.0 - co.alpha_m)
    for i in range(n):
        new.acceleration[i] = old.acceleration[i]
    previous, fast = np.inf, False
    factorizations = work.cost[1]
    for _ in range(ITERATIONS):
        update(h, co, old, new)
        residual(new.q, new.acceleration, chain, contact, law, work.right)
        for i in range(n):
            work.right[i] *= -chain.scale[i]
        if not solve_linear(new.q, weight, chain, contact, law, work):
            return False
        work.cost[0] += 1
        change, largest = 0.0, 0.0
        for i in range(n):
            new.acceleration[i] += chain.scale[i] * work.right[i]
            change = max(change, abs(work.right[i]))
            largest = max(largest, abs(new.acceleration[i] / chain.scale[i]))
        if not np.isfinite(change):
            return False
        slow = change > SLOW * previous
        good_factors = fast or work.cost[1] > factorizations
        stalled = slow and good_factors and change <= chain.roundoff
        if change <= co.tolerance * largest or stalled:
            update(h, co, old, new)
            return True
        if slow:
            work.key[0] = np.nan
        fast = change <= SLOW * previous < np.inf
        previous = change
    return False


@njit(cache=True)
def local_error(h: float, co: Coefficients, old: Motion, new: Motion, chain: Chain) -> float:
    """Leading term of the step's error in q, m: h^2 |beta + (alpha_m - alpha_f)/2 - 1/6| |a1 - a0|.

    a is q.. delayed by (alpha_f - alpha_m) h (Arnold and Bruls, section 3), so eq. 27 reproduces
    h^3/6 of the jerk up to that factor. The largest value over the nodes, slopes times l.
    """
    largest = 0.0
    for i in range(old.q.size):
        largest = max(largest, abs(new.a[i] - old.a[i]) / chain.scale[i])
    return co.error * h * h * largest


@njit(cache=True)
def change_step(ratio: float, motion: Motion) -> None:
    """Fit a to a step that changes by `ratio`: its delay behind q.. is proportional to h."""
    for i in range(motion.q.size):
        motion.a[i] = motion.acceleration[i] + ratio * (motion.a[i] - motion.acceleration[i])


@njit(cache=True)
def initial_acceleration(
    motion: Motion, chain: Chain, contact: Contact, law: Law, work: Workspace
) -> bool:
    """Fill motion.acceleration with the q.. and lam that the equations ask for, and a with q.. ."""
    for i in range(motion.q.size):
        motion.acceleration[i] = 0.0
    residual(motion.q, motion.acceleration, chain, contact, law, work.right)
    for i in range(motion.q.size):
        work.right[i] *= -chain.scale[i]
    solved = solve_linear(motion.q, 0.0, chain, contact, law, work)
    for i in range(motion.q.size):
        motion.acceleration[i] = chain.scale[i] * work.right[i]
        motion.a[i] = motion.acceleration[i]
    return solved
