"""One step of Gauss collocation (`gauss_tableau` has the coefficients).

    Q_i = q0 + c_i h v0 + h^2 B_i,   B_i = sum_j abar_ij A_j,   abar = a a,
    M A_i + Phi_q^T lam_i - F(Q_i, V_i) = 0,   Phi_q A_i = 0,   V_i = v0 + h sum_j a_ij A_j,
    q1 = q0 + h v0 + h^2 sum_ij b_i a_ij A_j,   v1 = v0 + h sum_j b_j A_j:

order 2 s, symplectic (a quadratic invariant stays to round-off, energy does not drift), symmetric,
stable at any step (Hairer, Lubich and Wanner 2006, sections II.1.3, IV.2.1, VI.4).

The stages are solved for by Newton's iteration (`gauss_systems`).
"""

import numpy as np

from hcm.assembly.equations import (
    depends_on_velocity,
    dissipated_power,
    move_chords,
    residual_from_chords,
)
from hcm.assembly.state import Motion
from hcm.beam.banded_ldl import HALF_BANDWIDTH, solve
from hcm.beam.drive import set_torques
from hcm.compiled import inlined, kernel
from hcm.contact.law import FLIGHT, ContactState
from hcm.integrators.gauss_systems import (
    close_hinges,
    combine,
    fits,
    measure_turns,
    phalanx_end,
    refactorize,
    solve_all,
    turn_back,
    turn_forth,
)
from hcm.integrators.gauss_tableau import GaussIntegrator
from hcm.integrators.newton import (
    ITERATIONS,
    converged,
    count_iterations,
    drop,
    is_finite,
    largest_in_units,
    largest_size,
)


@kernel
def move_velocities(h: float, old: Motion, integrator: GaussIntegrator) -> None:
    """Fill gauss.v from gauss.unknown (B)."""
    table, gauss = integrator.tableau, integrator.gauss
    combine(table.a_inverse, gauss.unknown, gauss.v)
    for i in range(table.c.size):
        velocity = gauss.v[i]
        for m in range(velocity.size):
            velocity[m] = old.v[m] + h * velocity[m]


@inlined
def move_stages(h: float, old: Motion, integrator: GaussIntegrator) -> None:
    """Fill gauss.stage (A), gauss.q, gauss.v and gauss.chords from gauss.unknown (B)."""
    chain, table, gauss = integrator.chain, integrator.tableau, integrator.gauss
    combine(table.a_squared_inverse, gauss.unknown, gauss.stage)
    for i in range(table.c.size):
        place, b, chords, along = gauss.q[i], gauss.unknown[i], gauss.chords[i], table.c[i] * h
        for m in range(place.size):
            place[m] = along * old.v[m] + h * h * b[m]
        move_chords(old.chords, place, chain, chords)
        for m in range(place.size):
            place[m] += old.q[m]
    if depends_on_velocity(chain, integrator.law):
        move_velocities(h, old, integrator)


@kernel
def finish(
    h: float, old: Motion, new: Motion, contact: ContactState, integrator: GaussIntegrator
) -> bool:
    """Fill `new` from B (q and v by quadrature, the rest by `accelerate`); return if it is finite.

    new.a is the step's mean acceleration, from which the next step guesses its stages: a continued
    polynomial would amplify what the iteration has left of the stiffest modes.
    """
    chain, gauss, ends = integrator.chain, integrator.gauss, integrator.tableau.ends
    moved = integrator.work.increment
    for m in range(moved.size):
        to_q, to_v = 0.0, 0.0
        for j in range(ends.shape[1]):
            to_q += ends[0, j] * gauss.unknown[j, m]
            to_v += ends[1, j] * gauss.unknown[j, m]
        moved[m] = h * old.v[m] + h * h * to_q
        new.q[m] = old.q[m] + moved[m]
        new.v[m] = old.v[m] + h * to_v
        new.a[m] = to_v
    move_chords(old.chords, moved, chain, new.chords)
    if contact.normal_mode != FLIGHT:  # of the last iteration's unknowns: events are sought in them
        move_velocities(h, old, integrator)
    return accelerate(h, old, new, contact, integrator)


@kernel
def accelerate(
    h: float, old: Motion, new: Motion, contact: ContactState, integrator: GaussIntegrator
) -> bool:
    """Fill q.. and lam of `new` by the equations at its q and v; return if they are finite."""
    chain, gauss = integrator.chain, integrator.gauss
    for m in range(new.q.size):
        new.jerk[m] = new.acceleration[m] = 0.0
    right = gauss.real_right[HALF_BANDWIDTH:]
    law = integrator.law
    set_torques(old.drive, h, chain.torque)
    for t in range(chain.torque.size):
        new.drive[0, t], new.drive[1, t] = chain.torque[t], old.drive[1, t]
    residual_from_chords(new.q, new.chords, new.v, new.acceleration, chain, contact, law, right)
    for m in range(right.size):
        right[m] *= -chain.scale[m]
    solve(gauss.mass_factors, gauss.real_right)
    for m in range(right.size):
        new.acceleration[m] = chain.scale[m] * right[m]
    return is_finite(right)


@kernel
def step(
    h: float, contact: ContactState, old: Motion, new: Motion, integrator: GaussIntegrator
) -> bool:
    """Advance `old` by h into `new`. Returns whether the iteration converged.

    It stops, and keeps or drops its factors, as generalized-alpha's does; the largest change of B
    is compared with the largest B after the first change. In a step that is long for the stiffest
    modes an acceleration's round-off would move a stage far: h^2 B is the smaller one's.
    """
    co, chain, work = integrator.co, integrator.chain, integrator.work
    table, gauss = integrator.tableau, integrator.gauss
    stages, n = gauss.unknown.shape
    for i in range(stages):
        for m in range(n):
            gauss.stage[i, m] = old.a[m]
    combine(table.a_squared, gauss.stage, gauss.unknown)
    set_torques(old.drive, 0.5 * h, chain.torque)
    roundoff, largest = min(chain.roundoff, chain.place_roundoff / (h * h)), 0.0
    previous, fast, iterations, factorizations = np.inf, False, work.cost[0], work.cost[1]
    for iteration in range(ITERATIONS):
        if not co.reuse:
            drop(gauss.kept)
        move_stages(h, old, integrator)
        if not fits(h, contact, integrator):
            if not refactorize(h, gauss.q[stages // 2], contact, integrator):
                return False
            measure_turns(gauss, chain)
        elif iteration == 0:
            measure_turns(gauss, chain)
        for i in range(stages):
            set_torques(old.drive, table.c[i] * h, chain.torque)
            residual_from_chords(
                gauss.q[i], gauss.chords[i], gauss.v[i], gauss.stage[i], chain, contact,
                integrator.law, gauss.residual[i],
            )  # fmt: skip
        turn_back(gauss.turns, chain, gauss.residual)
        combine(table.forward, gauss.residual, gauss.change)
        solve_all(chain.tip, table, gauss)
        combine(table.backward, gauss.change, gauss.residual)
        work.cost[0] += 1
        change = 0.0
        for i in range(stages):
            if not is_finite(gauss.residual[i]):
                drop(gauss.kept)
                return False
            change = max(change, largest_size(gauss.residual[i]))
        turn_forth(gauss.turns, chain, gauss.residual)
        for i in range(stages):
            for m in range(n):
                gauss.unknown[i, m] += gauss.residual[i, m]
            if iteration == 0:
                largest = max(largest, largest_in_units(gauss.unknown[i], chain.scale))
        close_hinges(chain, gauss.unknown)
        done, slow = converged(
            change, previous, largest, fast or work.cost[1] > factorizations, roundoff,
            co.tolerance, gauss.kept,
        )  # fmt: skip
        if done:
            break
        fast, previous = previous < np.inf and not slow, change
    else:
        drop(gauss.kept)
        return False
    count_iterations(work.cost[0] - iterations, gauss.kept)
    return finish(h, old, new, contact, integrator)


@kernel
def local_error(h: float, integrator: GaussIntegrator) -> float:
    """How far the last term of the acceleration's polynomial moves a stage, m (slopes times l).

    This is the difference from a collocation with one stage fewer, of order h^(s+1); the step's own
    error, of order h^(2s+1), is far smaller. Motion below the bound is resolved, or negligible.
    """
    gauss, chain, last = integrator.gauss, integrator.chain, integrator.tableau.last
    largest = 0.0
    for w in range(chain.hinge.size):
        for m in range(chain.hinge_outer[w], phalanx_end(w, chain)):
            term = 0.0
            for j in range(last.size):
                term += last[j] * gauss.stage[j, m]
            largest = max(largest, abs(term) / chain.scale[m])
    return h * h * largest


@kernel
def material_loss(h: float, contact: ContactState, integrator: GaussIntegrator) -> float:
    """Energy lost to the material and a radiating tip in the latest step, J, by quadrature."""
    gauss, chain, total = integrator.gauss, integrator.chain, 0.0
    for i in range(integrator.tableau.b.size):
        power = dissipated_power(
            gauss.q[i], gauss.chords[i], gauss.v[i], chain, contact, integrator.law
        )
        total += integrator.tableau.b[i] * power
    return h * total
