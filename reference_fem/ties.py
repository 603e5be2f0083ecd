"""Hanging nodes: their mass and force go to the nodes whose mean motion they follow.

With x_h = Σ x_m / n of the n nodes that node h follows (see `meshes.halving`), virtual work leaves

    m_m += Σ_h m_h / n,   r_m += Σ_h r_h / n,   a_h = Σ_m a_m / n

Mass, its first moment, linear and angular momentum and the power of forces are kept exactly. The
step never shrinks: as (Σ v_m / n)² <= Σ v_m² / n, lumped masses are at least those of the motion
that hanging nodes take part in, so that the highest frequency is at most that of the mesh with all
nodes free (Rayleigh).
"""

from typing import NamedTuple

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.compiled import njit


class Ties(NamedTuple):
    """Hanging nodes (h,) and those whose mean each follows, (h, n), none of which hangs."""

    nodes: Index
    of: Index

    def sums(self, values: Array) -> Array:
        """Values (n_points,), with those of hanging nodes moved to the nodes that they follow."""
        total = values.copy()
        total[self.nodes] = 0.0
        np.add.at(total, self.of, (values[self.nodes] / self.of.shape[1])[:, None])
        return total


def ties_of(table: Index) -> Ties:
    """Ties from a mesh's table, (h, 1 + n)."""
    table = np.asarray(table, dtype=np.int64)
    return Ties(np.ascontiguousarray(table[:, 0]), np.ascontiguousarray(table[:, 1:]))


NO_TIES = ties_of(np.empty((0, 1), dtype=np.int64))


@njit(cache=True)
def hand_on(values: Array, ties: Ties) -> None:
    """Add values (n_points, 2 | 3) of hanging nodes to those that they follow; leave them zero."""
    solid = values.shape[1] == 3
    share = 1.0 / ties.of.shape[1]  # exact: two or four; infinite, and not used, without ties
    for h in range(ties.nodes.size):
        hanging = ties.nodes[h]
        x, y, z = share * values[hanging, 0], share * values[hanging, 1], 0.0
        values[hanging, 0], values[hanging, 1] = 0.0, 0.0
        if solid:
            z = share * values[hanging, 2]
            values[hanging, 2] = 0.0
        for m in range(ties.of.shape[1]):
            i = ties.of[h, m]
            values[i, 0] += x
            values[i, 1] += y
            if solid:
                values[i, 2] += z


@njit(cache=True)
def follow(values: Array, weight: Array, ties: Ties) -> None:
    """Set values (n_points, 2 | 3) of hanging nodes to the means of weight (n_points,) times value.

    The means are over the nodes that each follows. With residuals and inverse masses they are
    accelerations, which is why a hanging node's own inverse mass is 1 (`Model.inverse_mass`).
    """
    solid = values.shape[1] == 3
    share = 1.0 / ties.of.shape[1]
    for h in range(ties.nodes.size):
        x = y = z = 0.0
        for m in range(ties.of.shape[1]):
            i = ties.of[h, m]
            x += weight[i] * values[i, 0]
            y += weight[i] * values[i, 1]
            if solid:
                z += weight[i] * values[i, 2]
        hanging = ties.nodes[h]
        values[hanging, 0], values[hanging, 1] = share * x, share * y
        if solid:
            values[hanging, 2] = share * z
