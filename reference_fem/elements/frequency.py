"""Upper bound on the largest eigenfrequency of a mesh, element by element.

Irons' theorem (Irons & Treharne 1971; Hughes, The Finite Element Method, 1987, sec. 9.1): with
K = sum K_e and M = sum M_e, the largest eigenvalue of K v = w^2 M v is at most the largest of
K_e v = w^2 M_e v over the elements. M_e holds the row-sum masses of the element.

The element's own largest eigenvalue is bounded from above without solving for it: for a symmetric
n x n matrix A (here M_e^-1/2 K_e M_e^-1/2) and p = 1, 2, 4, ...

    n^(-1/2p) |A^p|_F^(1/p)  <=  lambda_max  <=  |A^p|_F^(1/p)                   (Frobenius norm)

Each squaring halves the logarithm of the gap, and elements whose bound lies below another's lower
bound drop out, so a graded mesh costs little more than its first product.
"""

from collections.abc import Iterator

import numpy as np

from reference_fem.arrays import Array

SQUARINGS = 6  # p = 64: the bound on w = sqrt(lambda) is at most 24^(1/256) = 1.2 % too high


def element_stiffness(
    gradients: Array, weights: Array, mu: Array, lame: Array, mean_dilatation: bool
) -> Array:
    """Stiffness at the reference configuration, (n, a*dim, a*dim), N/m.

    K_ai,bj = sum_q w [mu (d_ij grad N_a . grad N_b + N_a,j N_b,i) + lambda N_a,i N_b,j], the last
    term with the mean gradients and V when `mean_dilatation`.

    Parameters
    ----------
    gradients : (n, q, a, dim) shape gradients, 1/m
    weights : (n, q) volumes of the points, m^3
    mu, lame : (n,) Lame's constants, Pa
    mean_dilatation : whether the element reduces its volumetric term
    """
    n, q, a, dim = gradients.shape
    flat = gradients.reshape(n, q, a * dim)
    products = np.matmul((weights[:, :, None] * flat).transpose(0, 2, 1), flat)
    t = products.reshape(n, a, dim, a, dim)
    shear = t.transpose(0, 1, 4, 3, 2) + np.einsum("nakbk,ij->naibj", t, np.eye(dim))
    if mean_dilatation:
        total = np.einsum("nq,nqk->nk", weights, flat)
        products = total[:, :, None] * total[:, None, :] / weights.sum(axis=1)[:, None, None]
    return mu[:, None, None] * shear.reshape(n, a * dim, a * dim) + lame[:, None, None] * products


def largest_frequency(chunks: Iterator[tuple[Array, Array]]) -> float:
    """Bound in rad/s on the largest eigenfrequency of any element.

    Parameters
    ----------
    chunks : pairs of stiffness (n, a*dim, a*dim) in N/m and row-sum mass (n, a) in kg, a few
        thousand elements each so that the matrices stay small in memory
    """
    largest = 0.0
    for stiffness, mass in chunks:
        dim = stiffness.shape[1] // mass.shape[1]
        root = 1.0 / np.sqrt(np.repeat(mass, dim, axis=1))
        matrices = root[:, :, None] * stiffness * root[:, None, :]
        largest = max(largest, largest_eigenvalue(matrices, largest))
    return float(np.sqrt(largest))


def largest_eigenvalue(matrices: Array, known: float) -> float:
    """Bound on the largest eigenvalue of symmetric matrices (n, k, k), or `known` if larger."""
    power = matrices
    log_scale = np.zeros(len(matrices))  # log of the factor taken out of A^p, over p
    size = matrices.shape[1]
    p = 1
    for squaring in range(SQUARINGS + 1):
        norm = np.sqrt(np.einsum("nij,nij->n", power, power))
        log_bound = log_scale + np.log(norm) / p
        lower = np.log(known) if known > 0.0 else -np.inf
        lower = max(lower, float(np.max(log_bound)) - np.log(size) / (2 * p))
        alive = log_bound >= lower
        if squaring == SQUARINGS or not alive.any():
            break
        log_scale = log_bound[alive]
        power = power[alive] / norm[alive, None, None]
        power = np.matmul(power, power)
        p *= 2
    return max(known, float(np.exp(np.max(log_bound)))) if alive.any() else known
