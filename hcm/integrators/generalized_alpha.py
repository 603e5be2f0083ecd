"""One step of the generalized-alpha method (paper, eqs. 27-28; Arnold and Bruls 2007, eqs. 11-13).

    q1 = q0 + h v0 + h^2 ((1/2 - beta) a0 + beta a1),   v1 = v0 + h ((1 - gamma) a0 + gamma a1),
    (1 - alpha_m) a1 + alpha_m a0 = (1 - alpha_f) q..1 + alpha_f q..0,

with alpha_m = (2 xi - 1)/(xi + 1), alpha_f = xi/(xi + 1), gamma = 1/2 + alpha_f - alpha_m,
beta = (1 + alpha_f - alpha_m)^2/4: order 2 in q, v and lam, spectral radius xi at infinite
frequency. The equations of motion hold at the step's end with q..1 and lam1 as unknowns.
"""

import numpy as np

from hcm.arrays import Floats
from hcm.assembly.equations import dissipation, move_chords, residual_from_chords, tangent
from hcm.assembly.state import Motion
from hcm.beam.banded_ldl import HALF_BANDWIDTH, factorize_rank_one, solve_rank_one
from hcm.beam.chain import Chain
from hcm.beam.drive import set_torques
from hcm.compiled import entry, inlined, kernel
from hcm.contact.contract import fill_column, has_rate_force, rate_power
from hcm.contact.law import ContactState
from hcm.integrators.newton import (
    ITERATIONS,
    converged,
    count_iterations,
    drop,
    is_finite,
    keep,
    largest_in_units,
    largest_size,
    of_mode,
)
from hcm.integrators.workspace import Coefficients, Integrator


@inlined
def solve_linear(
    q: Floats, weight: float, rate_weight: float, contact: ContactState, integrator: Integrator
) -> bool:
    """Overwrite work.right (scaled by D) with the solution; factorize unless the factors fit.

    A = S + u c e_y^T, S symmetric and factorized, u the unsymmetric factor, e_y the tip's Y (c =
    e_x for a tip without a radius).
    """
    _, chain, law, work = integrator
    kept, rank_one, y = work.kept, work.rank_one, HALF_BANDWIDTH + chain.tip + 1
    if not (kept.key[0] == weight and of_mode(contact, law, kept)):
        drop(kept)
        unsymmetric_factor = tangent(q, weight, rate_weight, chain, contact, law, work.factors)
        if unsymmetric_factor != 0.0:
            rank_one[:] = 0.0
            fill_column(q, chain.tip, chain.scale, contact, law, rank_one[HALF_BANDWIDTH:])
        if not factorize_rank_one(work.factors, unsymmetric_factor, y, rank_one, rank_one):
            return False
        keep(weight, unsymmetric_factor, contact, law, kept)
        work.cost[1] += 1
    solve_rank_one(work.factors, kept.key[4], y, rank_one, work.right)
    return True


@inlined
def update(
    h: float, co: Coefficients, old: Motion, new: Motion, chain: Chain, increment: Floats
) -> None:
    """Fill new.a, new.q, new.v and new.chords from new.acceleration (eqs. 27-28)."""
    new_part, old_part = (1.0 - co.alpha_f) / (1.0 - co.alpha_m), co.alpha_f / (1.0 - co.alpha_m)
    carried = co.alpha_m / (1.0 - co.alpha_m)
    q0, q1 = h * h * (0.5 - co.beta), h * h * co.beta
    v0, v1 = h * (1.0 - co.gamma), h * co.gamma
    for i in range(old.q.size):
        a0 = old.a[i]
        a1 = new_part * new.acceleration[i] + old_part * old.acceleration[i] - carried * a0
        dq = h * old.v[i] + (q0 * a0 + q1 * a1)
        new.a[i] = a1
        increment[i] = dq
        new.q[i] = old.q[i] + dq
        new.v[i] = old.v[i] + (v0 * a0 + v1 * a1)
    move_chords(old.chords, increment, chain, new.chords)


@kernel
def step(h: float, contact: ContactState, old: Motion, new: Motion, integrator: Integrator) -> bool:
    """Advance `old` by h into `new`, the contact staying in its mode.

    Newton's iteration on (q.., lam) with the exact tangent, whose factors are kept as long as each
    iteration shrinks the change by `SLOW_RATE`. Returns whether it converged; `new` is then finite.
    """
    co, chain, law, work = integrator
    n, right = old.q.size, work.right[HALF_BANDWIDTH:]
    weight = h * h * co.beta * (1.0 - co.alpha_f) / (1.0 - co.alpha_m)
    rate_weight = h * co.gamma * (1.0 - co.alpha_f) / (1.0 - co.alpha_m)
    for i in range(n):
        new.acceleration[i] = old.acceleration[i] + h * old.jerk[i]
    set_torques(old.drive, h, chain.torque)
    previous, fast, iterations, factorizations = np.inf, False, work.cost[0], work.cost[1]
    for _ in range(ITERATIONS):
        if not co.reuse:
            drop(work.kept)
        update(h, co, old, new, chain, work.increment)
        residual_from_chords(new.q, new.chords, new.v, new.acceleration, chain, contact, law, right)
        for i in range(n):
            right[i] *= -chain.scale[i]
        if not solve_linear(new.q, weight, rate_weight, contact, integrator):
            return False
        work.cost[0] += 1
        if not is_finite(right):
            return False
        for i in range(n):
            new.acceleration[i] += chain.scale[i] * right[i]
        change, largest = largest_size(right), largest_in_units(new.acceleration, chain.scale)
        done, slow = converged(
            change, previous, largest, fast or work.cost[1] > factorizations, chain.roundoff,
            co.tolerance, work.kept,
        )  # fmt: skip
        if done:
            break
        fast, previous = previous < np.inf and not slow, change
    else:
        return False
    update(h, co, old, new, chain, work.increment)
    count_iterations(work.cost[0] - iterations, work.kept)
    for i in range(n):
        new.jerk[i] = (new.acceleration[i] - old.acceleration[i]) / h
    for t in range(chain.torque.size):
        new.drive[0, t], new.drive[1, t] = chain.torque[t], old.drive[1, t]
    return True


@kernel
def local_error(h: float, old: Motion, new: Motion, integrator: Integrator) -> float:
    """Leading term of the step's error in q, m: h^2 |beta + (alpha_m - alpha_f)/2 - 1/6| |a1 - a0|.

    a is q.. delayed by (alpha_f - alpha_m) h (Arnold and Bruls, section 3), so eq. 27 reproduces
    h^3/6 of the jerk up to that factor. The largest value over the nodes, slopes times l.
    """
    largest, scale = 0.0, integrator.chain.scale
    for i in range(old.q.size):
        largest = max(largest, abs(new.a[i] - old.a[i]) / scale[i])
    return integrator.co.error * h * h * largest


@kernel
def material_loss(
    h: float, contact: ContactState, old: Motion, new: Motion, integrator: Integrator
) -> float:
    """Energy dissipated in the latest step, J: h v^T D v at its mean posture and velocity.

    For linear equations the trapezoidal rule (xi = 1) loses exactly that, whatever the step. What a
    tip radiates is added, by the trapezoidal rule in time.
    """
    _, chain, law, work = integrator
    lost = 0.0
    if chain.damped:
        lost = dissipation(old.q, old.chords, new.q, new.chords, work.increment, chain) / h
    if has_rate_force(law):
        before = rate_power(old.q, old.v, chain.tip, contact, law)
        lost += 0.5 * h * (before + rate_power(new.q, new.v, chain.tip, contact, law))
    return lost


@kernel
def change_step(ratio: float, motion: Motion) -> None:
    """Fit a to a step that changes by `ratio`: its delay behind q.. is proportional to h."""
    for i in range(motion.q.size):
        motion.a[i] = motion.acceleration[i] + ratio * (motion.a[i] - motion.acceleration[i])


@entry
def initial_acceleration(state: Motion, contact: ContactState, integrator: Integrator) -> bool:
    """Fill state.acceleration with the q.. and lam that solve the equations, and a with q.. ."""
    _, chain, law, work = integrator
    right = work.right[HALF_BANDWIDTH:]
    state.acceleration[:] = 0.0
    set_torques(state.drive, 0.0, chain.torque)
    residual_from_chords(
        state.q, state.chords, state.v, state.acceleration, chain, contact, law, right
    )
    for i in range(state.q.size):
        right[i] *= -chain.scale[i]
    solved = solve_linear(state.q, 0.0, 0.0, contact, integrator)
    for i in range(state.q.size):
        state.acceleration[i] = chain.scale[i] * right[i]
        state.a[i] = state.acceleration[i]
    return solved
