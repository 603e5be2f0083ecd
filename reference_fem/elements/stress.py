"""Outputs that elements share: F from given gradients, Cauchy stress, von Mises' stress."""

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.compiled import inner, njit
from reference_fem.elements.blocks import LANES, Blocks


@inner()
def deformation(blocks: Blocks, displacement: Array, cell: int, gradients: Array, f: Array) -> None:
    """F = sum_a x_a grad N_a (dim, dim) of one element, gradients (corners, dim) in 1/m."""
    nodes = blocks.nodes[cell // LANES, cell % LANES]
    f[:] = 0.0
    for a in range(len(nodes)):
        n = nodes[a]
        for i in range(len(f)):
            x = blocks.points[n, i] + displacement[n, i]
            for j in range(len(f)):
                f[i, j] += x * gradients[a, j]


@njit(cache=True, error_model="numpy")
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
def cauchy_stress(f: Array, mu: float, pressure: float, stress: Array) -> None:
    """Cauchy stress F S F^T / det F with S = pressure I + mu (F^T F - I), Pa.

    f (3, 3) deformation gradient; `pressure` = lambda tr E; stress (6,) out: xx yy zz xy yz xz.
    With B = F F^T: F S F^T = pressure B + mu B (B - I), which keeps the digits of small strains.
    """
    xx = f[0, 0] * f[0, 0] + f[0, 1] * f[0, 1] + f[0, 2] * f[0, 2]
    yy = f[1, 0] * f[1, 0] + f[1, 1] * f[1, 1] + f[1, 2] * f[1, 2]
    zz = f[2, 0] * f[2, 0] + f[2, 1] * f[2, 1] + f[2, 2] * f[2, 2]
    xy = f[0, 0] * f[1, 0] + f[0, 1] * f[1, 1] + f[0, 2] * f[1, 2]
    yz = f[1, 0] * f[2, 0] + f[1, 1] * f[2, 1] + f[1, 2] * f[2, 2]
    xz = f[0, 0] * f[2, 0] + f[0, 1] * f[2, 1] + f[0, 2] * f[2, 2]
    x, y, z = xx - 1.0, yy - 1.0, zz - 1.0
    det = (
        f[0, 0] * (f[1, 1] * f[2, 2] - f[1, 2] * f[2, 1])
        + f[0, 1] * (f[1, 2] * f[2, 0] - f[1, 0] * f[2, 2])
        + f[0, 2] * (f[1, 0] * f[2, 1] - f[1, 1] * f[2, 0])
    )
    stress[0] = (pressure * xx + mu * (xx * x + xy * xy + xz * xz)) / det
    stress[1] = (pressure * yy + mu * (xy * xy + yy * y + yz * yz)) / det
    stress[2] = (pressure * zz + mu * (xz * xz + yz * yz + zz * z)) / det
    stress[3] = (pressure * xy + mu * (xx * xy + xy * y + xz * yz)) / det
    stress[4] = (pressure * yz + mu * (xy * xz + yy * yz + yz * z)) / det
    stress[5] = (pressure * xz + mu * (xx * xz + xy * yz + xz * z)) / det


@inner()
def cauchy_plane_stress(f: Array, mu: float, lame: float, stress: Array) -> None:
    """In-plane Cauchy stress F S F^T / (det F lambda_z) of a sheet with S_zz = 0, Pa.

    f (2, 2); `lame` = lambda* = 2 lambda mu/(lambda + 2 mu); stress (3,) out: xx yy xy. S_zz = 0
    gives 2 mu E_zz = -lambda* tr E, and the stretch lambda_z of the thickness is sqrt(1 + 2 E_zz).
    """
    b11 = f[0, 0] * f[0, 0] + f[0, 1] * f[0, 1]
    b22 = f[1, 0] * f[1, 0] + f[1, 1] * f[1, 1]
    b12 = f[0, 0] * f[1, 0] + f[0, 1] * f[1, 1]
    d11, d22 = b11 - 1.0, b22 - 1.0
    pressure = 0.5 * lame * (d11 + d22)
    det = f[0, 0] * f[1, 1] - f[0, 1] * f[1, 0]
    volume = det * np.sqrt(1.0 - pressure / mu)
    stress[0] = (pressure * b11 + mu * (b11 * d11 + b12 * b12)) / volume
    stress[1] = (pressure * b22 + mu * (b22 * d22 + b12 * b12)) / volume
    stress[2] = (pressure * b12 + mu * (b11 * b12 + b12 * d22)) / volume


def damping_stress(f: Array, rate: Array, mu: Array, lame: Array, relaxation: Array) -> Array:
    """Cauchy stress F S F^T / det F of S = tau (lambda tr E. I + 2 mu E.), Pa.

    Components are those of `cauchy_stress`, or of `cauchy_plane_stress`. For a sheet with lambda*
    it is per volume with the undeformed thickness.

    f, rate : (n, dim, dim) F and dF/dt, 1/s.
    mu, lame, relaxation : (n,) Lame's constants, Pa, and tau, s.
    """
    half = f.transpose(0, 2, 1) @ rate
    strain_rate = 0.5 * (half + half.transpose(0, 2, 1))
    trace = np.trace(strain_rate, axis1=1, axis2=2)[:, None, None] * np.eye(f.shape[1])
    s = lame[:, None, None] * trace + 2.0 * mu[:, None, None] * strain_rate
    stress = f @ s @ f.transpose(0, 2, 1) * (relaxation / np.linalg.det(f))[:, None, None]
    rows, columns = ((0, 1, 2, 0, 1, 0), (0, 1, 2, 1, 2, 2)) if f.shape[1] == 3 else (
        (0, 1, 0), (0, 1, 1),
    )  # fmt: skip
    return np.asarray(stress[:, rows, columns])


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
