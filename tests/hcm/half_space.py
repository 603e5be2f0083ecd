"""An elastic half-space pressed on a rigid rough plane and moved along it, by boundary elements.

Squares of even tractions (p, q_x, q_z) displace the surface by A times them (Boussinesq, Cerruti;
Johnson 1985, sections 3.2 and 3.6, integrated over a square); all couplings are kept, those of p
with q by 1 - 2 nu too. Each step of a path finds

    p >= 0, w = u_n + r^2/(2 R) - d >= 0, p w = 0;     |q| <= mu p, q = -mu p s/|s| where it slips,

s the slip within the step, by projection. Units: G = R = 1.
"""

import numpy as np

from hcm.arrays import Floats


def _rectangle(x: Floats, y: Floats, nu: float) -> tuple[Floats, ...]:
    """Integrals up to a corner of 1/r, x^2/r^3, y^2/r^3, xy/r^3, x/r^2, y/r^2 in u's formulas."""
    r = np.hypot(x, y)
    along, across = y * np.log(x + r), x * np.log(y + r)
    out = (1 - 2 * nu) / 2 * (y * np.log(r) + x * np.arctan(y / x))
    aside = (1 - 2 * nu) / 2 * (x * np.log(r) + y * np.arctan(x / y))
    even = (1 - nu) * (along + across)
    return even, even + nu * along, even + nu * across, -nu * r, out, aside


def compliance(x: Floats, z: Floats, side: float, nu: float) -> Floats:
    """A of (u_n, u_x, u_z) by (p, q_x, q_z) of squares at x, z (n,): (3 n, 3 n)."""
    dx, dz, half = x[:, None] - x, z[:, None] - z, side / 2
    signs = [(1, 1, 1), (-1, -1, 1), (1, -1, -1), (-1, 1, -1)]
    parts = [_rectangle(dx + half * i, dz + half * j, nu) for _, i, j in signs]
    sums = [sum(s[0] * part[n] for s, part in zip(signs, parts, strict=True)) for n in range(6)]
    nn, xx, zz, xz, nx, nz = sums
    return np.block([[nn, nx, nz], [-nx, xx, xz], [-nz, xz, zz]]) / (2 * np.pi)


def forces(
    depth: Floats, way: Floats, shift: Floats, nu: float, mu: float, squares: int = 15
) -> Floats:
    """(F_t, F_n) after each step of a path: (n - 1, 2).

    depth, way : (n,) d and the tip's motion. shift : how far the patch has rolled along the body.
    """
    widest = 1.05 * np.sqrt(depth.max()) + np.abs(shift).max()
    side = 2 * np.sqrt(depth.max()) / squares
    line = np.arange(-np.ceil(widest / side), np.ceil(widest / side) + 1) * side
    x, z = (grid.ravel() for grid in np.meshgrid(line, line, indexing="ij"))
    near = x**2 + z**2 < widest**2
    x, z = x[near], z[near]
    a, n = compliance(x, z, side, nu), x.size
    own, tractions, moved, found = 0.5 / np.linalg.norm(a, 2), np.zeros(3 * n), np.zeros(2 * n), []
    for k in range(1, depth.size):
        gap = ((x - shift[k]) ** 2 + z**2) / 2 - depth[k]
        given = np.concatenate([gap, np.full(n, way[k] - way[k - 1]), np.zeros(n)])
        given[n:] -= moved
        tractions, ahead, weight = tractions.copy(), tractions, 1.0
        for _ in range(4000):
            new = ahead - 2 * own * (a @ ahead + given)
            new[:n] = np.maximum(new[:n], 0.0)
            size, limit = np.hypot(new[n : 2 * n], new[2 * n :]), mu * new[:n]
            new[n:] *= np.tile(np.where(size > limit, limit / np.maximum(size, 1e-300), 1.0), 2)
            change = new - tractions
            if np.abs(change).max() <= 1e-4 * new.max():
                break
            # momentum (Nesterov), given up where it leads away
            after = 0.5 * (1 + np.sqrt(1 + 4 * weight**2))
            away = (ahead - new) @ change > 0
            ahead = new if away else new + (weight - 1) / after * change
            tractions, weight = new, 1.0 if away else after
        moved = (a @ new)[n:]
        found.append((new[n : 2 * n].sum() * side**2, new[:n].sum() * side**2))
    return np.array(found)
