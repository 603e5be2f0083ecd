"""Outputs that elements share: F from given gradients, Cauchy stress, von Mises' stress."""

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.compiled import inner, njit

# Rows and columns of a stress's components as they are given, by space dimension.
COMPONENTS = {
    3: (np.array([0, 1, 2, 0, 1, 0]), np.array([0, 1, 2, 1, 2, 2])),
    2: (np.array([0, 1, 0]), np.array([0, 1, 1])),
}


@njit(cache=True)
def field_gradients(field: Array, cells: Index, gradients: Array, chosen: Index) -> Array:
    """sum_a v_a grad N_a (n, dim, dim) of the chosen cells, of a nodal field (n_nodes, dim)."""
    corners, dim = gradients.shape[1:]
    found = np.zeros((len(chosen), dim, dim))
    for row in range(len(chosen)):
        cell = chosen[row]
        for a in range(corners):
            node = cells[cell, a]
            for i in range(dim):
                for j in range(dim):
                    found[row, i, j] += field[node, i] * gradients[cell, a, j]
    return found


@inner(forceinline=True)
def lower(a: float, b: float) -> float:
    """The smaller of two numbers; NaN if one of them is."""
    return a if a <= b or a != a else b


@inner()
def determinant(f: Array) -> float:
    """Determinant of f (dim, dim), dim 2 or 3."""
    det = f[0, 0] * f[1, 1] - f[0, 1] * f[1, 0]
    if len(f) == 3:
        det *= f[2, 2]
        det += f[0, 2] * (f[1, 0] * f[2, 1] - f[1, 1] * f[2, 0])
        det += f[1, 2] * (f[0, 1] * f[2, 0] - f[0, 0] * f[2, 1])
    return float(det)


@njit(cache=True)
def cauchy_stress(
    displacement: Array, cells: Index, gradients: Array, chosen: Index, mu: Array, lame: Array,
    pressures: Array | None, components: tuple[Index, Index],
) -> Array:  # fmt: skip
    """Components of the Cauchy stress F S F^T / det F of the chosen cells, (n, components), Pa.

    S = p I + mu (F^T F - I) with the `pressures` p (n,), Pa; None: p = lambda tr E. With B = F F^T:
    F S F^T = p B + mu B (B - I), which keeps the digits of small strains. In plane stress `lame` is
    lambda* = 2 lambda mu/(lambda + 2 mu); S_zz = 0 gives 2 mu E_zz = -p, and the stretch of the
    sheet's thickness, sqrt(1 + 2 E_zz), multiplies det F.
    """
    slopes = field_gradients(displacement, cells, gradients, chosen)
    dim, (rows, columns) = slopes.shape[1], components
    stress, left, unit = np.empty((len(chosen), len(rows))), np.empty((dim, dim)), np.eye(dim)
    for row in range(len(chosen)):
        cell, f = chosen[row], slopes[row]
        for i in range(dim):
            f[i, i] += 1.0
        volume, trace = determinant(f), -float(dim)
        for i in range(dim):
            for j in range(dim):
                left[i, j] = 0.0
                for k in range(dim):
                    left[i, j] += f[i, k] * f[j, k]
            trace += left[i, i]
        pressure = 0.5 * lame[cell] * trace if pressures is None else pressures[row]
        if dim == 2:
            volume *= np.sqrt(1.0 - pressure / mu[cell])
        for c in range(len(rows)):
            i, j, square = rows[c], columns[c], 0.0
            for k in range(dim):
                square += left[i, k] * (left[k, j] - unit[k, j])
            stress[row, c] = (pressure * left[i, j] + mu[cell] * square) / volume
    return stress


def neo_hooke_stress(
    displacement: Array, cells: Index, gradients: Array, chosen: Index, mu: Array, _lame: Array,
    pressures: Array, components: tuple[Index, Index],
) -> Array:  # fmt: skip
    """Components of p I + mu (F F^T - I)/det F of the chosen cells, (n, components), Pa."""
    h = field_gradients(displacement, cells, gradients, chosen)
    unit = np.eye(h.shape[1])
    strain = h + h.transpose(0, 2, 1) + h @ h.transpose(0, 2, 1)
    share = (mu[chosen] / np.linalg.det(unit + h))[:, None, None]
    stress = share * strain + pressures[:, None, None] * unit
    return np.asarray(stress[:, *components])


def damping_stress(f: Array, rate: Array, mu: Array, lame: Array, relaxation: Array) -> Array:
    """Cauchy stress F S F^T / det F (n, dim, dim) of S = tau (lambda tr E. I + 2 mu E.), Pa.

    For a sheet with lambda* it is per volume with the undeformed thickness.

    f, rate : (n, dim, dim) F and dF/dt, 1/s.
    mu, lame, relaxation : (n,) Lame's constants, Pa, and tau, s.
    """
    half = f.transpose(0, 2, 1) @ rate
    strain_rate = 0.5 * (half + half.transpose(0, 2, 1))
    trace = np.trace(strain_rate, axis1=1, axis2=2)[:, None, None] * np.eye(f.shape[1])
    s = lame[:, None, None] * trace + 2.0 * mu[:, None, None] * strain_rate
    stress = f @ s @ f.transpose(0, 2, 1) * (relaxation / np.linalg.det(f))[:, None, None]
    return np.asarray(stress)


def von_mises(stress: Array) -> Array:
    """Equivalent stress sqrt(3/2 dev:dev), Pa, (n,).

    stress : Pa, (n, 6) as xx, yy, zz, xy, yz, xz or (n, 3) as xx, yy, xy of plane stress (zz = 0).
    """
    if stress.shape[1] == 3:
        xx, yy, xy = stress.T
        return np.sqrt(np.maximum(xx * xx - xx * yy + yy * yy + 3.0 * xy * xy, 0.0))
    xx, yy, zz, xy, yz, xz = stress.T
    normal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
    return np.sqrt(0.5 * normal + 3.0 * (xy * xy + yz * yz + xz * xz))
