"""The largest stable step of the explicit loop, contact penalty included."""

import math

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.elements.base import ElementKernel
from reference_fem.ties import NO_TIES, Ties, follow, hand_on

# Lanczos steps: on the finger's meshes the largest frequency is found to 1e-3 after 20.
ITERATIONS = 24
# Iterations of the damped step: three leave an error of about 1 % at the default damping.
DAMPED_ITERATIONS = 3


def stable_step(
    kernel: ElementKernel,
    contact_nodes: Index,
    contact_stiffness: Array,
    symmetry: Index,
    contact_damping: Array | None = None,
    ties: Ties = NO_TIES,
    coupled_eigenvalue: float = 0.0,
) -> float:
    """Δt = 2/ω_max of M⁻¹(K + K_c + 2 (C_c + τ K)/Δt), all contact nodes sticking.

    ω_max is the safeguarded Lanczos value. The usual choice, the largest of the elements' own
    (Irons 1971), takes 1.2 to 2 times as many steps on the finger's meshes: one bad element decides
    it, though its neighbours hold it back.

    Dashpots C_c lag by half a step, v(t - Δt/2) instead of v(t): the leapfrog then needs
    4 M/Δt² - 2 C/Δt - K positive definite (at the root z = -1). Δt stands on both sides; starting
    from C = 0, which is too large a step, fixed-point iteration converges to it.

    The material's damping τ K lags likewise. With ω_max of K + K_c + 2 C_c/Δt, ω_K of K alone and
    the largest τ, 4/Δt² = ω_max² + 2 τ ω_K²/Δt: for symmetric matrices the largest eigenvalue of a
    sum is at most the sum of theirs, and contact's springs have no part of τ. Without springs it
    reads Δt = 2/ω_max (sqrt(1 + ξ²) - ξ) with ξ = τ ω/2.

    K_c is diagonal with k_i in each direction of node i (a slipping node has fewer springs).
    Springs that tie nodes to each other have a largest eigenvalue λ of M⁻¹K_c of their own: for
    symmetric matrices that of the sum is at most ω_max² + λ.
    Hinges only constrain the motion and can't raise ω_max (Rayleigh). K is that of the reference
    configuration: rotation does not change the spectrum; strain does, by its own order, for which
    the step factor leaves room. Where elements stiffen by more, ω_max is multiplied by their
    `ElementKind.stiffening`.

    Raises ValueError: the frequency is not a positive finite number.
    """
    damping = np.zeros(contact_nodes.size) if contact_damping is None else contact_damping
    springs = np.zeros(kernel.n_nodes)
    tau = float(kernel.relaxation.max())
    limit, own = math.inf, 0.0
    if tau > 0.0 and (contact_stiffness.any() or damping.any()):
        own = kernel.kind.stiffening * lanczos_frequency(kernel, springs, symmetry, ties)
    for _ in range(1 + DAMPED_ITERATIONS if damping.any() else 1):
        stiffness = contact_stiffness + 2.0 * damping / limit
        springs[contact_nodes] = stiffness
        springs = ties.sums(springs)
        highest = kernel.kind.stiffening * lanczos_frequency(kernel, springs, symmetry, ties)
        if not (math.isfinite(highest) and highest > 0.0):
            raise ValueError(
                f"highest frequency = {highest} rad/s: no stable step exists; check the mesh for "
                "empty elements and the material for wrong units"
            )
        limit = 2.0 / math.hypot(highest, math.sqrt(coupled_eigenvalue))
        if tau > 0.0:
            alone = own or highest  # without springs they are the same
            lag = tau * (alone * alone / (highest * highest + coupled_eigenvalue))
            limit = limit * limit / (lag + math.hypot(lag, limit))
    return limit


def lanczos_frequency(
    kernel: ElementKernel, springs: Array, symmetry: Index, ties: Ties = NO_TIES
) -> float:
    """Upper estimate of ω_max from the force kernel alone, rad/s.

    Lanczos on A = M^-½ (K + K_c) M^-½, A q from the internal force of a displacement so small
    (1e-8 of the body) that the force is linear to 1e-6. The largest Ritz value θ lies below
    λ_max; θ + ‖A y - θ y‖ of its Ritz vector y lies above it in practice (Zhou, Li 2011, "Bounding
    the spectrum of large Hermitian matrices").

    springs : (n_nodes,), k_i of the contact nodes, zero elsewhere, N/m.
    symmetry : (k,), nodes held in the plane Z = 0.
    """
    shape = (kernel.n_nodes, kernel.dim)
    mass = kernel.lumped_mass
    root = 1.0 / np.sqrt(np.where(mass > 0.0, mass, np.inf))[:, None]
    ones = np.ones(kernel.n_nodes)
    small = 1e-8 * float(np.sum(kernel.cell_volume)) ** (1.0 / 3.0)
    force = np.empty(shape)
    # A fixed seed gives the same mesh the same step; no mode is orthogonal to such a start.
    vector = np.random.default_rng(0).standard_normal(shape)
    vector[symmetry, 2:] = 0.0
    vector /= np.linalg.norm(vector)
    before, beta = np.zeros(shape), 0.0
    diagonal: list[float] = []
    off_diagonal: list[float] = []
    for _ in range(ITERATIONS):
        displacement = root * vector
        follow(displacement, ones, ties)
        scale = small / float(np.abs(displacement).max())
        kernel.internal_force(scale * displacement, force)
        total = force / scale + springs[:, None] * displacement
        hand_on(total, ties)
        following = root * total - beta * before
        following[symmetry, 2:] = 0.0
        alpha = float(np.sum(following * vector))
        following -= alpha * vector
        beta = float(np.linalg.norm(following))
        diagonal.append(alpha)
        off_diagonal.append(beta)
        # An invariant subspace (a body of few nodes): nothing is left to find.
        if beta <= 1e-9 * abs(alpha):
            break
        before, vector = vector, following / beta
    tridiagonal = np.diag(diagonal)
    tridiagonal += np.diag(off_diagonal[:-1], 1) + np.diag(off_diagonal[:-1], -1)
    if not np.isfinite(tridiagonal).all():
        return math.nan
    values, vectors = np.linalg.eigh(tridiagonal)
    return math.sqrt(max(0.0, float(values[-1] + off_diagonal[-1] * abs(vectors[-1, -1]))))
