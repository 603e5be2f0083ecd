"""Compiled kernels of the 8-node hexahedron for outputs: energy, det F, stress at the centre.

Same equations, layout and scratch rows as `hex8_kernel`; one thread, since outputs are rare.
"""

import numpy as np
from numba import njit

from reference_fem.elements.hex8_kernel import (
    DILATATION,
    LANES,
    POINT_ROWS,
    SAFE_MATH,
    Three,
    at_points,
    base_vectors,
    block_dilatation,
    gather,
    gradient_row,
    green_strain,
)
from reference_fem.elements.protocol import Floats, Integers, Nodes
from reference_fem.elements.stress import cauchy_stress


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def shear_energy(gx: Three, gy: Three, gz: Three, r: Floats, o: int) -> float:
    """Return w E:E at one point, m^3."""
    fx = gradient_row(gx[0], gx[1], gx[2], r, o)
    fy = gradient_row(gy[0], gy[1], gy[2], r, o)
    fz = gradient_row(gz[0], gz[1], gz[2], r, o)
    d, h = green_strain(fx, fy, fz)
    squares = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    return 0.25 * r[o + 6 * LANES] * (squares + 2.0 * (h[0] * h[0] + h[1] * h[1] + h[2] * h[2]))


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy", forceinline=True)
def point_det(gx: Three, gy: Three, gz: Three, r: Floats, o: int) -> float:
    """Return det F at one point."""
    fx = gradient_row(gx[0], gx[1], gx[2], r, o)
    fy = gradient_row(gy[0], gy[1], gy[2], r, o)
    fz = gradient_row(gz[0], gz[1], gz[2], r, o)
    return (
        fx[0] * (fy[1] * fz[2] - fy[2] * fz[1])
        + fx[1] * (fy[2] * fz[0] - fy[0] * fz[2])
        + fx[2] * (fy[0] * fz[1] - fy[1] * fz[0])
    )


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy")
def strain_energy(
    points: Floats, displacement: Floats, nodes: Nodes, reference: Floats, s: Floats
) -> float:
    """W = sum over elements of sum_q w mu E:E + lambda (V e)^2 / (2 V), J."""
    step = POINT_ROWS * LANES
    energy = 0.0
    for block in range(len(nodes)):
        r = reference[block]
        gather(points, displacement, nodes[block], s)
        block_dilatation(s, r)
        for lane in range(LANES):
            x = at_points(base_vectors(s, 0, lane))
            y = at_points(base_vectors(s, 8, lane))
            z = at_points(base_vectors(s, 16, lane))
            shear = 0.0
            for q in range(8):
                shear += shear_energy(x[q], y[q], z[q], r, lane + q * step)
            dilatation = s[DILATATION * LANES + lane]
            energy += r[56 * LANES + lane] * shear
            energy += 0.5 * r[57 * LANES + lane] * dilatation * dilatation
    return energy


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy")
def min_det(
    points: Floats, displacement: Floats, nodes: Nodes, reference: Floats, n_cells: int, s: Floats
) -> float:
    """Smallest det F over the 8 points of all elements; NaN if any of them is NaN."""
    step = POINT_ROWS * LANES
    smallest = np.inf
    for block in range(len(nodes)):
        r = reference[block]
        gather(points, displacement, nodes[block], s)
        for lane in range(min(LANES, n_cells - block * LANES)):
            x = at_points(base_vectors(s, 0, lane))
            y = at_points(base_vectors(s, 8, lane))
            z = at_points(base_vectors(s, 16, lane))
            for q in range(8):
                det = point_det(x[q], y[q], z[q], r, lane + q * step)
                if np.isnan(det):
                    return det
                smallest = min(smallest, det)
    return smallest


@njit(cache=True, fastmath=SAFE_MATH, error_model="numpy")
def centre_stress(
    points: Floats,
    displacement: Floats,
    nodes: Nodes,
    reference: Floats,
    centre_gradients: Floats,
    cells: Integers,
    s: Floats,
    stress: Floats,
) -> None:
    """Cauchy stress F S F^T / det F at the centres of `cells` into stress (n, 6), Pa.

    S = lambda e I + 2 mu E with the element's mean e and E at the centre. Each block is gathered
    once for a run of cells that lie in it.
    """
    gathered = -1
    f = np.empty((3, 3))
    for row in range(len(cells)):
        cell = cells[row]
        block, lane = cell // LANES, cell % LANES
        r = reference[block]
        if block != gathered:
            gather(points, displacement, nodes[block], s)
            block_dilatation(s, r)
            gathered = block
        f[:] = 0.0
        for a in range(8):
            for i in range(3):
                for j in range(3):
                    f[i, j] += s[(8 * i + a) * LANES + lane] * centre_gradients[cell, a, j]
        pressure = r[57 * LANES + lane] * s[DILATATION * LANES + lane]
        cauchy_stress(f, r[56 * LANES + lane], pressure, stress[row])
