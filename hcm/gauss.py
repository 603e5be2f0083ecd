"""One step of Gauss collocation, for a finger in flight (`collocation` has the coefficients).

    Q_i = q0 + c_i h v0 + h^2 B_i,   B_i = sum_j abar_ij A_j,   abar = a a,
    M A_i + Phi_q^T lam_i - F(Q_i) = 0,   Phi_q A_i = 0,
    q1 = q0 + h v0 + h^2 sum_ij b_i a_ij A_j,   v1 = v0 + h sum_j b_j A_j:

order 2 s, symplectic (a quadratic invariant stays to round-off, energy does not drift), symmetric,
stable at any step (Hairer, Lubich and Wanner 2006, sections II.1.3, IV.2.1, VI.4).

Newton's iteration is simplified: one K for all stages, so that the eigenvectors T of abar decouple
them into s banded systems, of which each complex pair needs one (Hairer and Wanner 1996, IV.8):

    (M + h^2 mu_k K) w_k + Phi_q^T l_k = -(T^-1 R)_k,   dB = T diag(mu) w.

K turns with the phalanges, and the axial stiffness is so much larger than M/h^2 that an angle of
1e-3 would spoil the convergence. K is therefore that of the factorization turned along:
K(Q_i) = G_i K G_i^T with G_i the turn of each phalanx's chord since then, so that R_i is turned
back before, and dB_i forth after the solution. M commutes with G but for its differences between
the stages, and so does Phi_q but for those between neighbouring phalanges: errors of the size of
the angle, without a stiffness in front. The hinges that B_i is opened at by that are closed by
moving phalanges as rigid bodies, which keeps Phi_q B_i = 0 to round-off.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hcm.banded_ldl import HALF_BANDWIDTH, factorize, solve
from hcm.collocation import GaussIntegrator, GaussWork, Tableau
from hcm.compiled import inlined, kernel
from hcm.equations import residual_from_chords, tangent
from hcm.generalized_alpha import (
    ITERATIONS,
    SLOW,
    WORTH,
    is_finite,
    keep_count,
    largest_in_units,
    largest_size,
)
from hcm.integrator import Motion
from hcm.layout import Chain
from hcm.lumped_contact import Contact

Floats = NDArray[np.float64]


@kernel
def combine(weights: Floats, source: Floats, target: Floats) -> None:
    """target_i = sum_j weights_ij source_j, for rows (s, n)."""
    for i in range(target.shape[0]):
        row, first, only = target[i], source[0], weights[i, 0]
        for m in range(row.size):
            row[m] = only * first[m]
        for j in range(1, source.shape[0]):
            other, weight = source[j], weights[i, j]
            for m in range(row.size):
                row[m] += weight * other[m]


@kernel
def phalanx_end(w: int, chain: Chain) -> int:
    """Place after phalanx w's last unknown; its first is its hinge's."""
    return chain.hinge[w + 1] if w + 1 < chain.hinge.size else chain.scale.size


@kernel
def direction(q: Floats, w: int, chain: Chain) -> tuple[float, float]:
    """Unit vector along phalanx w's chord."""
    a, b = chain.hinge_outer[w], phalanx_end(w, chain) - 4
    x, y = q[b] - q[a], q[b + 1] - q[a + 1]
    size = np.sqrt(x * x + y * y)
    return x / size, y / size


@kernel
def turn_back(turns: Floats, chain: Chain, rows: Floats) -> None:
    """rows_i = -D G_i^T rows_i, (s, n)."""
    for i in range(rows.shape[0]):
        row = rows[i]
        for w in range(chain.hinge.size):
            c, s = turns[i, w, 0], turns[i, w, 1]
            for m in range(chain.hinge[w], phalanx_end(w, chain), 2):
                x, y, unit = row[m], row[m + 1], -chain.scale[m]
                row[m], row[m + 1] = unit * (c * x + s * y), unit * (c * y - s * x)


@kernel
def turn_forth(turns: Floats, chain: Chain, rows: Floats) -> None:
    """rows_i = G_i D rows_i, (s, n)."""
    for i in range(rows.shape[0]):
        row = rows[i]
        for w in range(chain.hinge.size):
            c, s, end = turns[i, w, 0], turns[i, w, 1], phalanx_end(w, chain)
            for m in range(chain.hinge[w], end, 2):
                x, y, unit = row[m], row[m + 1], chain.scale[m]
                row[m], row[m + 1] = unit * (c * x - s * y), unit * (s * x + c * y)


@kernel
def close_hinges(chain: Chain, rows: Floats) -> None:
    """Move phalanges as rigid bodies, from the fixed hinge on, until Phi_q rows_i = 0."""
    for i in range(rows.shape[0]):
        row = rows[i]
        for w in range(chain.hinge.size):
            outer, inner = chain.hinge_outer[w], chain.hinge_inner[w]
            x, y = -row[outer], -row[outer + 1]
            if inner >= 0:
                x, y = x + row[inner], y + row[inner + 1]
            for m in range(outer, phalanx_end(w, chain), 4):
                row[m] += x
                row[m + 1] += y


@kernel
def refactorize(h: float, q: Floats, contact: Contact, integrator: GaussIntegrator) -> bool:
    """Keep the factors of all systems for the stiffness at q (n,)."""
    chain, table, own = integrator.chain, integrator.tableau, integrator.gauss
    own.key[0] = np.nan
    tangent(q, h * h, chain, contact, integrator.law, own.stiff)
    mass, stiff = own.mass, own.stiff
    for k in range(table.mu.size):
        mu = table.mu[k]
        if k == 0 and table.c.size % 2 == 1:
            for i in range(mass.shape[0]):
                for j in range(mass.shape[1]):
                    own.real_factors[i, j] = mass[i, j] + mu.real * (stiff[i, j] - mass[i, j])
            if not factorize(own.real_factors):
                return False
        else:
            factors = own.factors[k]
            for i in range(mass.shape[0]):
                for j in range(mass.shape[1]):
                    factors[i, j] = mass[i, j] + mu * (stiff[i, j] - mass[i, j])
            if not factorize(factors):
                return False
    for w in range(chain.hinge.size):
        own.frame[w, 0], own.frame[w, 1] = direction(q, w, chain)
    own.key[0] = h
    own.rate[0] = 1.0
    own.age[0] = own.age[1] = 0
    integrator.work.cost[1] += table.mu.size
    return True


@kernel
def measure_turns(own: GaussWork, chain: Chain) -> None:
    """Fill the turns of all stages' phalanges since the factorization."""
    for i in range(own.turns.shape[0]):
        for w in range(chain.hinge.size):
            x, y = direction(own.q[i], w, chain)
            fx, fy = own.frame[w, 0], own.frame[w, 1]
            own.turns[i, w, 0], own.turns[i, w, 1] = fx * x + fy * y, fx * y - fy * x


@kernel
def solve_all(table: Tableau, own: GaussWork) -> None:
    """Overwrite own.change (s, n), the right-hand sides T^-1 R, with w: pairs as (Re, Im)."""
    w, odd = HALF_BANDWIDTH, table.c.size % 2
    if odd == 1:
        row, real = own.change[0], own.real_right
        for m in range(row.size):
            real[w + m] = row[m]
        solve(own.real_factors, real)
        for m in range(row.size):
            row[m] = real[w + m]
    for k in range(odd, table.mu.size):
        first = odd + 2 * (k - odd)
        re, im, right = own.change[first], own.change[first + 1], own.right
        for m in range(re.size):
            right[w + m] = complex(re[m], im[m])
        solve(own.factors[k], right)
        for m in range(re.size):
            re[m], im[m] = right[w + m].real, right[w + m].imag


@inlined
def move_stages(h: float, old: Motion, integrator: GaussIntegrator) -> None:
    """Fill own.stage (A), own.q and own.chords from own.unknown (B)."""
    chain, table, own = integrator.chain, integrator.tableau, integrator.gauss
    combine(table.inverse, own.unknown, own.stage)
    for i in range(table.c.size):
        place, b, chords, along = own.q[i], own.unknown[i], own.chords[i], table.c[i] * h
        for m in range(place.size):
            place[m] = along * old.v[m] + h * h * b[m]
        for e in range(chain.first.size):
            a, length = chain.first[e], chain.length[e]
            chords[e, 0] = old.chords[e, 0] + (place[a + 4] - place[a]) / length
            chords[e, 1] = old.chords[e, 1] + (place[a + 5] - place[a + 1]) / length
        for m in range(place.size):
            place[m] += old.q[m]


@kernel
def finish(h: float, old: Motion, new: Motion, contact: Contact,
           integrator: GaussIntegrator) -> None:  # fmt: skip
    """Fill `new` from B: q, v and their mean acceleration; q.. and lam by the equations there."""
    chain, own, ends = integrator.chain, integrator.gauss, integrator.tableau.ends
    moved = integrator.work.increment
    for m in range(moved.size):
        to_q, to_v = 0.0, 0.0
        for j in range(ends.shape[1]):
            to_q += ends[0, j] * own.unknown[j, m]
            to_v += ends[1, j] * own.unknown[j, m]
        moved[m] = h * old.v[m] + h * h * to_q
        new.q[m] = old.q[m] + moved[m]
        new.v[m] = old.v[m] + h * to_v
        new.a[m] = to_v
        new.jerk[m] = new.acceleration[m] = 0.0
    for e in range(chain.first.size):
        a, length = chain.first[e], chain.length[e]
        new.chords[e, 0] = old.chords[e, 0] + (moved[a + 4] - moved[a]) / length
        new.chords[e, 1] = old.chords[e, 1] + (moved[a + 5] - moved[a + 1]) / length
    right = own.real_right[HALF_BANDWIDTH:]
    law = integrator.law
    residual_from_chords(new.q, new.chords, new.acceleration, chain, contact, law, right)
    for m in range(right.size):
        right[m] *= -chain.scale[m]
    solve(own.mass_factors, own.real_right)
    for m in range(right.size):
        new.acceleration[m] = chain.scale[m] * right[m]


@kernel
def step(h: float, contact: Contact, old: Motion, new: Motion, integrator: GaussIntegrator) -> bool:
    """Advance `old` by h into `new`, in flight. Returns whether the iteration converged.

    It stops, keeps its factors and gives them up as generalized-alpha's does; what is compared is
    the largest change of B with the largest B after the first change.
    """
    co, chain, work = integrator.co, integrator.chain, integrator.work
    table, own = integrator.tableau, integrator.gauss
    stages, n = own.unknown.shape
    for i in range(stages):
        for m in range(n):
            own.stage[i, m] = old.a[m]
    combine(table.double, own.stage, own.unknown)
    if not co.reuse:
        own.key[0] = np.nan
    largest = 0.0
    previous, fast, iterations, factorizations = np.inf, False, work.cost[0], work.cost[1]
    for iteration in range(ITERATIONS):
        move_stages(h, old, integrator)
        if own.key[0] != h:
            if not refactorize(h, own.q[stages // 2], contact, integrator):
                return False
            measure_turns(own, chain)
        elif iteration == 0:
            measure_turns(own, chain)
        for i in range(stages):
            residual_from_chords(
                own.q[i], own.chords[i], own.stage[i], chain, contact, integrator.law,
                own.residual[i],
            )  # fmt: skip
        turn_back(own.turns, chain, own.residual)
        combine(table.forward, own.residual, own.change)
        solve_all(table, own)
        combine(table.backward, own.change, own.residual)
        work.cost[0] += 1
        change = 0.0
        for i in range(stages):
            if not is_finite(own.residual[i]):
                own.key[0] = np.nan
                return False
            change = max(change, largest_size(own.residual[i]))
        turn_forth(own.turns, chain, own.residual)
        for i in range(stages):
            for m in range(n):
                own.unknown[i, m] += own.residual[i, m]
            if iteration == 0:
                largest = max(largest, largest_in_units(own.unknown[i], chain.scale))
        close_hinges(chain, own.unknown)
        slow = False
        if previous < np.inf:
            rate = change / previous
            slow = rate > SLOW
            if slow and change <= chain.roundoff and (fast or work.cost[1] > factorizations):
                break
            fast = not slow
            own.rate[0] = rate
        left = own.rate[0] if previous < np.inf else own.rate[0] ** 0.8
        if change * min(1.0, left / max(1.0 - left, 0.5)) <= co.tolerance * largest:
            break
        if slow or not co.reuse:
            own.key[0] = np.nan
        previous = change
    else:
        own.key[0] = np.nan
        return False
    finish(h, old, new, contact, integrator)
    keep_count(work.cost[0] - iterations, WORTH, own.age, own.key)
    return True


@kernel
def local_error(h: float, integrator: GaussIntegrator) -> float:
    """What the last term of the acceleration's polynomial moves a stage by, m (slopes times l).

    The difference from a collocation with one stage less, of order h^(s+1): the step's own error,
    of order h^(2s+1), is far smaller. What stays below a bound is resolved, or negligible.
    """
    own, last, scale = integrator.gauss, integrator.tableau.last, integrator.chain.scale
    largest = 0.0
    for m in range(scale.size):
        term = 0.0
        for j in range(last.size):
            term += last[j] * own.stage[j, m]
        largest = max(largest, abs(term) / scale[m])
    return h * h * largest
