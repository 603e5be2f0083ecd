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

from hcm.banded_lu import HALF_BANDWIDTH, factorize, solve
from hcm.equations import fill_chords, residual_from_chords, tangent
from hcm.layout import Chain, Law
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
    """State of the integrator: q, v, bordered acceleration (q.., lam) and a, each (n,).

    chords : (N, 2) of the elements, summed up from the steps' increments. jerk : (n,) slope of the
    acceleration over the step that led here, which only predicts the next acceleration.
    """

    q: Floats
    v: Floats
    acceleration: Floats
    a: Floats
    chords: Floats
    jerk: Floats


class Workspace(NamedTuple):
    """LU factors kept between iterations and steps, with what they belong to, and scratch.

    band : (n, 2 w + 1). key : (4,) integrator weight (NaN: nothing kept) and dF_c/dq. right : (n,)
    right-hand side. increment : (n,) change of q over the step. rate : (1,) last contraction that
    the factors gave, 1 while unknown. cost : (2,) iterations and
    factorizations so far.
    """

    band: Floats
    key: Floats
    right: Floats
    increment: Floats
    rate: Floats
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


def motion(chain: Chain, q: Floats, v: Floats) -> Motion:
    """A state with coordinates q and velocities v (n,), accelerations zero."""
    chords = np.empty((chain.first.size, 2))
    fill_chords(q, chain, chords)
    n = q.size
    return Motion(q.copy(), v.copy(), np.zeros(n), np.zeros(n), chords, np.zeros(n))


def workspace(n: int) -> Workspace:
    """Allocate for n bordered unknowns, with no factors kept."""
    return Workspace(
        np.empty((n, 2 * HALF_BANDWIDTH + 1)),
        np.full(4, np.nan),
        np.empty(n),
        np.empty(n),
        np.ones(1),
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
        if not factorize(work.band):
            return False
        key[0], key[1], key[2], key[3] = weight, dtx, dty, dny
        work.rate[0] = 1.0
        work.cost[1] += 1
    solve(work.band, work.right)
    return True


@njit(cache=True)
def update(
    h: float,
    co: Coefficients,
    old: Motion,
    new: Motion,
    chain: Chain,
    increment: Floats,
) -> None:
    """Fill new.a, new.q, new.v and new.chords from new.acceleration (eqs. 27-28)."""
    new_part, old_part = (
        (1.0 - co.alpha_f) / (1.0 - co.alpha_m),
        co.alpha_f / (1.0 - co.alpha_m),
    )
    carried = co.alpha_m / (1.0 - co.alpha_m)
    for i in range(old.q.size):
        a0 = old.a[i]
        a1 = new_part * new.acceleration[i] + old_part * old.acceleration[i] - carried * a0
        dq = h * old.v[i] + h * h * ((0.5 - co.beta) * a0 + co.beta * a1)
        new.a[i] = a1
        increment[i] = dq
        new.q[i] = old.q[i] + dq
        new.v[i] = old.v[i] + h * ((1.0 - co.gamma) * a0 + co.gamma * a1)
    for e in range(chain.first.size):
        a, b, length = chain.first[e], chain.second[e], chain.length[e]
        for c in range(2):
            new.chords[e, c] = old.chords[e, c] + (increment[b + c] - increment[a + c]) / length


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
        new.acceleration[i] = old.acceleration[i] + h * old.jerk[i]
    previous, fast, factorizations = np.inf, False, work.cost[1]
    for _ in range(ITERATIONS):
        update(h, co, old, new, chain, work.increment)
        residual_from_chords(new.q, new.chords, new.acceleration, chain, contact, law, work.right)
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
        # what is left after this iteration: the change times rate/(1 - rate) (Hairer and Wanner
        # 1996, section IV.8), the rate being that of the factors in use, here or in earlier steps
        slow = False
        if previous < np.inf:
            rate = change / previous
            slow = rate > SLOW
            if slow and change <= chain.roundoff and (fast or work.cost[1] > factorizations):
                break
            fast = not slow
            work.rate[0] = rate
        # a rate from an earlier step is trusted less
        left = work.rate[0] if previous < np.inf else work.rate[0] ** 0.8
        if change * min(1.0, left / max(1.0 - left, 0.5)) <= co.tolerance * largest:
            break
        if slow:
            work.key[0] = np.nan
        previous = change
    else:
        return False
    update(h, co, old, new, chain, work.increment)
    for i in range(n):
        new.jerk[i] = (new.acceleration[i] - old.acceleration[i]) / h
    return True


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
    state: Motion, chain: Chain, contact: Contact, law: Law, work: Workspace
) -> bool:
    """Fill state.acceleration with the q.. and lam that the equations ask for, and a with q.. ."""
    for i in range(state.q.size):
        state.acceleration[i] = 0.0
    residual_from_chords(state.q, state.chords, state.acceleration, chain, contact, law, work.right)
    for i in range(state.q.size):
        work.right[i] *= -chain.scale[i]
    solved = solve_linear(state.q, 0.0, chain, contact, law, work)
    for i in range(state.q.size):
        state.acceleration[i] = chain.scale[i] * work.right[i]
        state.a[i] = state.acceleration[i]
    return solved
