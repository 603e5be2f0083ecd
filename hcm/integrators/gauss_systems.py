"""The linear systems of Newton's iteration on a collocation's stages (`hcm.integrators.gauss`).

The iteration is simplified: one K for all stages, so that the eigenvectors T of abar decouple them
into s banded systems, of which each complex pair needs one (Hairer and Wanner 1996, section IV.8):

    (M + h^2 mu_k K + h lam_k D) w_k + Phi_q^T l_k = -(T^-1 R)_k,   dB = T diag(mu) w,   mu = lam^2.

K turns with the phalanges, and the axial stiffness is so much larger than M/h^2 that an angle of
1e-3 would spoil the convergence. So the K of the factorization is turned along with them:
K(Q_i) = G_i K G_i^T with G_i the turn of each phalanx's chord since then, so that R_i is turned
back before, and dB_i forth after the solution. M commutes with G except for the differences of G
between stages, and Phi_q except for those between neighbouring phalanges: errors of the size of the
angle, not multiplied by a stiffness. Hinges that this opens in B_i are closed by moving phalanges
as rigid bodies, which keeps Phi_q B_i = 0 to round-off.
"""

import numpy as np

from hcm.arrays import Complexes, Floats
from hcm.assembly.equations import depends_on_velocity, tangent
from hcm.beam.banded_ldl import HALF_BANDWIDTH, factorize_rank_one, solve_rank_one
from hcm.beam.chain import Chain
from hcm.compiled import kernel
from hcm.contact.contract import fill_column
from hcm.contact.law import FLIGHT, ContactState
from hcm.integrators.gauss_tableau import GaussIntegrator, GaussWork, Tableau
from hcm.integrators.newton import drop, keep, of_mode

# Steps in contact whose lengths differ by less than this share use the same factors.
STEP_MATCH = 1e-3


@kernel
def combine(weights: Floats, source: Floats, target: Floats) -> None:
    """target_i = sum_j weights_ij source_j, for rows (s, n): four at a time, in their order."""
    count = source.shape[0]
    fours = count - count % 4
    for i in range(target.shape[0]):
        row, share = target[i], weights[i]
        for m in range(row.size):
            row[m] = 0.0
        for j in range(0, fours, 4):
            s0, s1, s2, s3 = source[j], source[j + 1], source[j + 2], source[j + 3]
            w0, w1, w2, w3 = share[j], share[j + 1], share[j + 2], share[j + 3]
            for m in range(row.size):
                row[m] = row[m] + w0 * s0[m] + w1 * s1[m] + w2 * s2[m] + w3 * s3[m]
        for j in range(fours, count):
            other, weight = source[j], share[j]
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
def fits(h: float, contact: ContactState, integrator: GaussIntegrator) -> bool:
    """Whether the factors are those of the step h and the contact's mode.

    In contact they serve any step whose length agrees to `STEP_MATCH`, also for an event's trials.
    """
    kept = integrator.gauss.kept
    near = 0.0 if contact.normal_mode == FLIGHT else STEP_MATCH * h
    return of_mode(contact, integrator.law, kept) and abs(kept.key[0] - h) <= near


@kernel
def factorize_system(
    mu: complex, lam: complex, damped: bool, unsymmetric_factor: float, y: int, column: Floats,
    gauss: GaussWork, factors: Floats | Complexes, rank_one: Floats | Complexes,
) -> bool:  # fmt: skip
    """Factorize M + mu (K - M) + lam (D - M), and its rank-one part, with real or complex mu, lam.

    M, K, D : gauss.mass, .stiff, .damp; K and D include the mass; D is used only if `damped`.
    y, column : row and column of the rank-one part, times mu unsymmetric_factor; none if that is
    0. Returns whether it could be done.
    """
    for i in range(factors.shape[0]):
        for j in range(factors.shape[1]):
            factors[i, j] = gauss.mass[i, j] + mu * (gauss.stiff[i, j] - gauss.mass[i, j])
            if damped:
                factors[i, j] += lam * (gauss.damp[i, j] - gauss.mass[i, j])
    return factorize_rank_one(factors, mu * unsymmetric_factor, y, column, rank_one)


@kernel
def refactorize(h: float, q: Floats, contact: ContactState, integrator: GaussIntegrator) -> bool:
    """Factorize all systems with the stiffness at q (n,), and keep them; return if it succeeded."""
    chain, table, gauss = integrator.chain, integrator.tableau, integrator.gauss
    law = integrator.law
    drop(gauss.kept)
    unsymmetric_factor = tangent(q, h * h, 0.0, chain, contact, law, gauss.stiff)
    column, y = integrator.work.right, HALF_BANDWIDTH + chain.tip + 1
    if unsymmetric_factor != 0.0:
        column[:] = 0.0
        fill_column(q, chain.tip, chain.scale, contact, law, column[HALF_BANDWIDTH:])
    damped = depends_on_velocity(chain, law)
    if damped:
        tangent(q, 0.0, h, chain, contact, law, gauss.damp)
    rest = damped, unsymmetric_factor, y, column, gauss
    for k in range(table.mu.size):
        mu, lam = table.mu[k], table.lam[k]
        if k == 0 and table.c.size % 2 == 1:
            real = gauss.real_factors, gauss.real_rank_one
            done = factorize_system(mu.real, lam.real, *rest, *real)
        else:
            done = factorize_system(mu, lam, *rest, gauss.factors[k], gauss.rank_one[k])
        if not done:
            return False
    for w in range(chain.hinge.size):
        gauss.frame[w, 0], gauss.frame[w, 1] = direction(q, w, chain)
    keep(h, unsymmetric_factor, contact, law, gauss.kept)
    integrator.work.cost[1] += table.mu.size
    return True


@kernel
def measure_turns(gauss: GaussWork, chain: Chain) -> None:
    """Fill the turns of all stages' phalanges since the factorization."""
    for i in range(gauss.turns.shape[0]):
        for w in range(chain.hinge.size):
            x, y = direction(gauss.q[i], w, chain)
            fx, fy = gauss.frame[w, 0], gauss.frame[w, 1]
            gauss.turns[i, w, 0], gauss.turns[i, w, 1] = fx * x + fy * y, fx * y - fy * x


@kernel
def solve_all(tip: int, table: Tableau, gauss: GaussWork) -> None:
    """Overwrite gauss.change (s, n), the right-hand sides T^-1 R, with w: pairs as (Re, Im)."""
    w, odd, unsymmetric_factor = HALF_BANDWIDTH, table.c.size % 2, gauss.kept.key[4]
    y = w + tip + 1
    if odd == 1:
        row, real = gauss.change[0], gauss.real_right
        for m in range(row.size):
            real[w + m] = row[m]
        factor = table.mu[0].real * unsymmetric_factor
        solve_rank_one(gauss.real_factors, factor, y, gauss.real_rank_one, real)
        for m in range(row.size):
            row[m] = real[w + m]
    for k in range(odd, table.mu.size):
        first = odd + 2 * (k - odd)
        re, im, right = gauss.change[first], gauss.change[first + 1], gauss.right
        for m in range(re.size):
            right[w + m] = complex(re[m], im[m])
        pair = table.mu[k] * unsymmetric_factor
        solve_rank_one(gauss.factors[k], pair, y, gauss.rank_one[k], right)
        for m in range(re.size):
            re[m], im[m] = right[w + m].real, right[w + m].imag
