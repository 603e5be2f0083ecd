"""An axisymmetric half-ball on a rod that is pressed on a plane: E = R = 1.

With small strains, or by St. Venant-Kirchhoff's or the neo-Hookean law.
"""

from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sl
from numpy.typing import NDArray

from hcm.parameters import NEO_HOOKE, MaterialLaw

Numbers = NDArray[np.float64]
NU = 0.4
ROD = 3.0  # between the ball's centre and its clamped end


class HalfBall:
    """Quadratic axisymmetric elements of a half-ball on a rod, finer towards the pole."""

    def __init__(self, across: int = 8, edge: float = 0.025) -> None:
        chords = [*np.arange(0.0, 0.4 + 1e-9, edge)]
        while chords[-1] < 1.3:
            chords.append(chords[-1] + 1.25 * (chords[-1] - chords[-2]))
        chords[-1] = np.sqrt(2.0)
        rings = len(chords) - 1
        half = np.interp(np.arange(2 * rings + 1) / 2, np.arange(rings + 1), chords)
        t = np.linspace(0.0, 1.0, 2 * across + 1)
        turn = np.outer(np.arccos(half / 2), t)  # arcs about the pole, up to the ball
        arcs = half[:, None, None] * np.stack([np.sin(turn), np.cos(turn)], axis=-1)
        top = np.stack([t, np.full_like(t, 1.0 + ROD)], axis=-1)
        shaft = [arcs[-1] * (1 - s) + top * s for s in np.linspace(0.0, 1.0, 17)[1:]]
        self.points = points = np.concatenate([*arcs, *shaft])
        row, n = len(t), len(points)
        corner = [
            2 * i * row + 2 * j + a * row + b
            for i in range(rings + 8) for j in range(across) for a in range(3) for b in range(3)
        ]  # fmt: skip
        names = np.arange(n)
        names[:row] = 0  # the pole is one node
        self.cells = names[np.array(corner).reshape(-1, 9)]
        count = round(0.4 / edge)
        self.outside = names[
            [[(2 * i + a) * row + row - 1 for a in range(3)] for i in range(count)]
        ]
        held = np.zeros((n, 2), dtype=bool)
        held[n - row :, 1], held[points[:, 0] < 1e-12, 0], held[1:row] = True, True, True
        self.free = np.flatnonzero(~held.ravel())
        at, weight = np.polynomial.legendre.leggauss(3)
        shape, slope = quadratic(at)
        values = np.einsum("pa,qb->pqab", shape, shape).reshape(9, 9)
        local = np.stack(
            [np.einsum("pa,qb->pqab", slope, shape), np.einsum("pa,qb->pqab", shape, slope)], -1
        ).reshape(9, 9, 2)
        jacobian = np.einsum("eai,qak->eqik", points[self.cells], local)
        slopes = np.einsum("qak,eqkj->eqaj", local, np.linalg.inv(jacobian))
        radius = np.einsum("qa,ea->eq", values, points[self.cells][..., 0])
        area = np.abs(np.linalg.det(jacobian)) * np.outer(weight, weight).ravel()
        self.weight = 2 * np.pi * radius * area
        gradient = np.zeros((*radius.shape, 9, 2, 3, 3))
        gradient[..., 0, 0, :2], gradient[..., 1, 1, :2] = slopes, slopes
        gradient[..., 0, 2, 2] = values / radius[..., None]
        self.gradient = gradient.reshape(*radius.shape, 18, 3, 3)
        self.places = (2 * self.cells[:, :, None] + np.arange(2)).reshape(-1, 18)
        at, weight = np.polynomial.legendre.leggauss(5)
        self.on_edge, slope = quadratic(at)
        rim = points[self.outside]
        stretch = np.linalg.norm(np.einsum("qa,eai->eqi", slope, rim), axis=-1)
        self.rim = 2 * np.pi * weight * stretch * np.einsum("qa,ea->eq", self.on_edge, rim[..., 0])

    def forces(self, u: Numbers, law: MaterialLaw | None) -> tuple[Numbers, Any]:
        """Internal forces and their tangent, with S = lam tr(E) + 2 mu E, or neo-Hookean."""
        lam, mu, one = NU / ((1 + NU) * (1 - 2 * NU)), 0.5 / (1 + NU), np.eye(3)
        finite, out = law is not None, np.zeros(u.size)

        def stress(strain: Numbers) -> Numbers:
            trace = np.trace(strain, axis1=-2, axis2=-1)[..., None, None]
            return np.asarray(lam * trace * one + 2 * mu * strain)

        turned = np.einsum("eqdij,ed->eqij", self.gradient, u[self.places])
        full = one + turned if finite else np.broadcast_to(one, turned.shape)
        if law == NEO_HOOKE:
            det = np.linalg.det(full)
            pressure, slope = 0.5 * lam * (det - 1 / det), 0.5 * lam * (1 + det**-2)
            own, tangent, swell = neo_hooke(full, self.gradient, self.weight, pressure, mu)
            np.add.at(out, self.places, own)
            tangent += np.einsum("eq,eqm,eqn->emn", self.weight * slope, swell, swell)
            return out, assembled(tangent, self.places, u.size)
        strain = 0.5 * (turned + turned.swapaxes(-1, -2))
        if finite:
            strain = strain + 0.5 * turned.swapaxes(-1, -2) @ turned
        rate = np.einsum("eqki,eqdkj->eqdij", full, self.gradient)
        rate = 0.5 * (rate + rate.swapaxes(-1, -2))
        pressed = stress(strain)
        np.add.at(out, self.places, np.einsum("eq,eqij,eqdij->ed", self.weight, pressed, rate))
        tangent = product(self.weight, stress(rate), rate)
        if finite:
            tangent += product(self.weight, self.gradient @ pressed[:, :, None], self.gradient)
        return out, assembled(tangent, self.places, u.size)

    def press(self, depths: Numbers, law: MaterialLaw | None, stiffness: float = 1000.0) -> Numbers:
        """(force, approach less the springs' own) of each depth of a plane with stiff springs."""
        u, found, heights = np.zeros(self.points.size), [], 2 * self.outside + 1
        for depth in depths:
            for step in range(40):
                residual, tangent = self.forces(u, law)
                z = self.points[self.outside, 1] + u[heights]
                gap = depth - z @ self.on_edge.T
                push = self.rim * stiffness * np.maximum(gap, 0.0)
                np.add.at(residual, heights, -push @ self.on_edge)
                springs = np.einsum(
                    "eq,qa,qb->eab", self.rim * stiffness * (gap > 0), self.on_edge, self.on_edge
                )
                tangent = tangent + assembled(springs, heights, u.size)
                own = residual[self.free]
                if step and np.abs(own).max() < 1e-9 * push.sum():
                    break
                u[self.free] -= sl.spsolve(tangent[self.free][:, self.free].tocsc(), own)
            assert step < 39
            found.append((push.sum(), depth - (push * gap).sum() / push.sum()))
        return np.array(found)


def quadratic(x: Numbers) -> tuple[Numbers, Numbers]:
    """The shapes (points, 3) of an edge, and their slopes."""
    return (
        np.stack([x * (x - 1) / 2, 1 - x * x, x * (x + 1) / 2], axis=-1),
        np.stack([x - 0.5, -2 * x, x + 0.5], axis=-1),
    )


def product(weight: Numbers, left: Numbers, right: Numbers) -> Numbers:
    """(e, d, d) integrals of the double contraction of two fields of gradients (e, q, d, 3, 3)."""
    count, _, unknowns = left.shape[:3]
    weighed = (weight[..., None, None, None] * left).swapaxes(1, 2).reshape(count, unknowns, -1)
    other = right.swapaxes(1, 2).reshape(count, unknowns, -1)
    return np.asarray(weighed @ other.swapaxes(1, 2))


def neo_hooke(
    full: Numbers, gradient: Numbers, weight: Numbers, pressure: Numbers, mu: float
) -> tuple[Numbers, Numbers, Numbers]:
    """Forces (e, d) of P = mu F + (p - mu/J) cof F, their tangent at constant p, dJ (e, q, d).

    full (e, q, 3, 3) : F. gradient (e, q, d, 3, 3) : dF of each unknown. weight, pressure (e, q)
    """
    det = np.linalg.det(full)
    cof = det[..., None, None] * np.linalg.inv(full).swapaxes(-1, -2)
    share = pressure - mu / det
    pressed = mu * full + share[..., None, None] * cof
    out = np.einsum("eq,eqij,eqdij->ed", weight, pressed, gradient)
    swell = np.einsum("eqij,eqdij->eqd", cof, gradient)
    turned = cof[:, :, None] @ gradient.swapaxes(-1, -2) @ cof[:, :, None]
    rate = mu * gradient - (share / det)[..., None, None, None] * turned
    rate += ((share / det + mu / det**2)[..., None] * swell)[..., None, None] * cof[:, :, None]
    return out, product(weight, rate, gradient), swell


def assembled(blocks: Numbers, places: Any, n: int) -> Any:
    """The sparse sum of elements' matrices."""
    width = places.shape[1]
    rows, columns = np.repeat(places, width, axis=1), np.tile(places, (1, width))
    return sp.coo_matrix((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(n, n)).tocsr()


def factorized(matrix: Any) -> Any:
    """The sparse factors of a matrix of symmetric structure."""
    return sl.splu(
        matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )  # fmt: skip
