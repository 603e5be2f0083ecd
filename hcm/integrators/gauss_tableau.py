"""Gauss collocation with s stages: its coefficients, and the memory that its steps need.

c_i are the zeros of the Legendre polynomial on [0, 1], a_ij = int_0^c_i l_j, b_j = int_0^1 l_j with
Lagrange's l_j: order 2 s, symplectic, symmetric, A-stable with modulus 1 on the imaginary axis. A
vibration keeps its amplitude and is out of phase by (s!)^2/((2 s)! (2 s + 1)!) (omega h)^(2 s) of
its angle (Hairer, Lubich and Wanner 2006, sections II.1.3 and IV.2; Hairer and Wanner 1996, IV.5).
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from hcm.arrays import Complexes, Floats
from hcm.assembly.equations import tangent
from hcm.beam.banded_ldl import HALF_BANDWIDTH, factorize
from hcm.beam.chain import Chain
from hcm.contact.contract import Law
from hcm.contact.law import IN_FLIGHT
from hcm.integrators.newton import Kept, nothing_kept
from hcm.integrators.workspace import Coefficients, Integrator, Workspace


class Tableau(NamedTuple):
    """Coefficients for y.. = f(y) with the unknowns B_i = sum_j abar_ij A_j, abar = a a.

    c, b : (s,). a, a_squared, a_squared_inverse, a_inverse : (s, s) a, abar, abar^-1 (times B: A)
    and a^-1 (times B: (V - v0)/h). ends : (2, s), times B: (q1 - q0 - h v0)/h^2 and (v1 - v0)/h.
    lam : (p,) eigenvalues of a, the real one first if s is odd, one of each complex pair; mu : (p,)
    their squares, those of abar. forward, backward : (s, s) T^-1 and T diag(mu), T the
    eigenvectors; a complex pair has two rows (columns): the real and the imaginary part (doubled,
    the latter negated). last : (s,) weights of A in the last term of its polynomial's Legendre
    series, times the largest part that this term has in B.
    """

    c: Floats
    b: Floats
    a: Floats
    a_squared: Floats
    a_squared_inverse: Floats
    a_inverse: Floats
    ends: Floats
    lam: Complexes
    mu: Complexes
    forward: Floats
    backward: Floats
    last: Floats


@cache
def tableau(stages: int) -> Tableau:
    """Coefficients for `stages` stages (s >= 2)."""
    nodes, weights = legendre.leggauss(stages)
    c, b = 0.5 * (nodes + 1.0), 0.5 * weights
    series = legendre.legvander(nodes, stages - 1).T
    # int_0^c P_m(2 t - 1) dt: l_j = sum_m (2 m + 1) b_j P_m(c_j) P_m
    rows = [0.5 * legendre.legval(nodes, legendre.legint(row, lbnd=-1)) for row in np.eye(stages)]
    a = np.array(rows).T @ ((2 * np.arange(stages) + 1)[:, None] * series * b)
    a_squared = a @ a
    a_squared_inverse = np.linalg.inv(a_squared).astype(np.float64)
    a_inverse = np.linalg.inv(a).astype(np.float64)
    lam, vectors = np.linalg.eig(a)
    back = np.linalg.inv(vectors)
    kept, forward, backward = [], [], []
    for k in np.argsort(np.abs(lam.imag)):
        if lam[k].imag < -1e-9:
            continue
        kept.append(lam[k])
        column = vectors[:, k] * lam[k] ** 2
        if abs(lam[k].imag) < 1e-9:
            # eigenvectors of a real eigenvalue are real up to a factor, which cancels in the two
            turn = back[k] / np.abs(back[k]).max()
            phase = turn[np.abs(turn).argmax()]
            forward.append((back[k] / phase).real)
            backward.append((column * phase).real)
        else:
            forward += [back[k].real, back[k].imag]
            backward += [2.0 * column.real, -2.0 * column.imag]
    ends = np.array([b @ a, b]) @ a_squared_inverse
    last = (2 * stages - 1) * b * series[-1] * np.abs(a_squared @ series[-1]).max()
    mu = np.array([one**2 for one in kept], dtype=np.complex128)
    return Tableau(
        c, b, a, a_squared, a_squared_inverse, a_inverse, ends,
        np.array(kept, dtype=np.complex128), mu, np.ascontiguousarray(forward),
        np.ascontiguousarray(np.array(backward).T), last,
    )  # fmt: skip


class GaussWork(NamedTuple):
    """What the steps keep, and scratch; P phalanges, p = mu.size systems.

    mass : (w + n, w + 1) the bordered mass matrix, constant. mass_factors : its factors. stiff,
    damp : (w + n, w + 1) mass plus h^2 K and mass plus h D of the factors, the latter if damped.
    real_factors : (w + n, w + 1), factors : (p, w + n, w + 1) complex,
    [M + h^2 mu K + h lam D, Phi^T; Phi, 0]. frame : (P, 2) directions of the phalanges at the
    factorization. turns : (s, P, 2) cosine and sine from there to each stage. right : (w + n,)
    complex right-hand side; real_right : (w + n,). rank_one, real_rank_one : (p, w + n),
    (w + n,) the factors' solutions for a sliding tip's part, as in `Workspace`. unknown, stage :
    (s, n) B and A. q, v : (s, n), chords : (s, N, 2). residual, change, spare : (s, n).
    kept : what the factors belong to.
    """

    mass: Floats
    mass_factors: Floats
    stiff: Floats
    damp: Floats
    real_factors: Floats
    factors: Complexes
    frame: Floats
    turns: Floats
    right: Complexes
    real_right: Floats
    rank_one: Complexes
    real_rank_one: Floats
    unknown: Floats
    stage: Floats
    q: Floats
    v: Floats
    chords: Floats
    residual: Floats
    change: Floats
    spare: Floats
    kept: Kept


class GaussIntegrator(NamedTuple):
    """`Integrator` with what collocation needs; generalized-alpha's part is the same.

    flight, contact : whether collocation takes the steps there.
    """

    co: Coefficients
    chain: Chain
    law: Law
    work: Workspace
    tableau: Tableau
    gauss: GaussWork
    flight: bool
    contact: bool


def gauss_work(stages: int, chain: Chain, law: Law) -> GaussWork:
    """Allocate the memory for `stages` stages, and factorize the mass matrix."""
    n, elements, phalanges = chain.scale.size, chain.first.size, chain.hinge.size
    w, systems = HALF_BANDWIDTH, (stages + 1) // 2
    # arrays of one shape from one allocation: these make up Python's share of a short tap
    mass, mass_factors, stiff, damp, real_factors = np.zeros((5, w + n, w + 1))
    real_right, real_rank_one = np.zeros((2, w + n))
    unknown, stage, q, v, residual, change, spare = np.zeros((7, stages, n))
    # with zero weights the matrix depends neither on q, which may be any numbers, nor on a contact
    tangent(chain.scale, 0.0, 0.0, chain, IN_FLIGHT, law, mass)
    mass_factors[:] = mass
    factorize(mass_factors)
    return GaussWork(
        mass, mass_factors, stiff, damp, real_factors,
        np.zeros((systems, w + n, w + 1), dtype=np.complex128),
        np.zeros((phalanges, 2)), np.zeros((stages, phalanges, 2)),
        np.zeros(w + n, dtype=np.complex128), real_right,
        np.zeros((systems, w + n), dtype=np.complex128), real_rank_one,
        unknown, stage, q, v, np.zeros((stages, elements, 2)), residual, change, spare,
        nothing_kept(),
    )  # fmt: skip


def with_collocation(
    plain: Integrator, stages: int, flight: bool = True, contact: bool = False
) -> GaussIntegrator:
    """Add collocation in flight, in contact or both to a run's integrator."""
    own = gauss_work(stages, plain.chain, plain.law)
    return GaussIntegrator(*plain, tableau(stages), own, flight, contact)
