"""Static indentation of a fingertip by a rigid plane: normal, then tangential under full stick.

Frictionless penalty contact integrated over the surface (3 x 3 points a facet), as in the explicit
runs' law "surface"; C is the compliance of the candidate nodes (see `tip`):

    p_q = κ max(0, δ - h_q - u_q),   f = Σ_q w_q N_q p_q,   u = C f,   s Σ f = F

by Newton's method, s the symmetry factor, δ the plane's approach and h_q the surface's distance
from the undeformed plane. Trilinear facets cut the ball's cap off: h is interpolated from nodal
values that have the sphere's mean there, and is the mesh's own on the shaft. κ = f E*/R with f so
large that the penalty's own share is below 1 %; it is taken off to first order in 1/κ: with
U_p = Σ_q w_q p_q²/2κ, which grows as F^(4/3) in Hertz's contact, the penalty adds
dU_p/dF = 4 U_p/3F to δ and U_p/3 to the work at a given force. From F(δ):

    U_c = ∫ F dδ = s ½ f·C f + U_p - U_p/3,     k = F²/(2 U_c),

k being the linear spring that holds the same energy at the same force. Tangential stiffness: the
area in contact sticks and moves along the plane as one (Mindlin's problem, its small coupling with
the normal pressure left out); η² is the ratio of the two tangent stiffnesses of that area.
"""

import math
from dataclasses import dataclass

import numpy as np

from reference_fem.arrays import Array, Flags
from reference_fem.contact.hertz import hertz_indentation
from reference_fem.elements.facet_quadrature import facet_quadrature
from reference_fem.statics.tip import TipCompliance

PENALTY = 2000.0  # f
ON_SPHERE = 1e-6  # over R: round-off, and far less than a shaft's facet is off the sphere
ITERATIONS, HALVINGS = 60, 12  # most of Newton's method, and of one step


@dataclass(frozen=True)
class Indentation:
    """One load of the plane on the tip, for the full body.

    force_N, indentation_m, energy_J : F, δ and U_c
    contact_radius_m : a of Hertz's pressure with the same second moment, ∫ p r² dA = 2/5 a² F. The
        area that touches ends half an edge short: flat facets cannot follow a rim within them
    normal_tangent_N_per_m, tangential_tangent_N_per_m : dF_n/dδ and dF_t/du_t of this area, all of
        it sticking
    """

    force_N: float
    indentation_m: float
    energy_J: float
    contact_radius_m: float
    normal_tangent_N_per_m: float
    tangential_tangent_N_per_m: float

    @property
    def stiffness_N_per_m(self) -> float:
        """The spring k = F²/(2 U_c)."""
        return self.force_N**2 / (2.0 * self.energy_J)

    @property
    def eta_squared(self) -> float:
        """The ratio η² = (dF_n/dδ)/(dF_t/du_t)."""
        return self.normal_tangent_N_per_m / self.tangential_tangent_N_per_m


@dataclass(frozen=True)
class ContactArea:
    """Quadrature of the candidates' facets: shapes N (q, k), weights w (q,), heights h (q,).

    `outermost` (q,) are the points of facets at the candidates' rim, which contact must not reach.
    """

    shapes: Array
    weights: Array
    heights: Array
    outermost: Flags


def contact_area(tip: TipCompliance) -> ContactArea:
    """Points where the contact is evaluated.

    Nodal heights that give the sphere's mean on the ball's facets, whose nodes all lie on it:
    h_i + ∫_ball N_i (h_sphere - h_bilinear) dA / ∫ N_i dA.
    """
    quadrature = facet_quadrature(tip.points, tip.facets)
    weights = quadrature.weight.ravel()
    by_facet = np.zeros((*quadrature.weight.shape, len(tip.points)))
    for f, nodes in enumerate(tip.facets):
        by_facet[f][:, nodes] = quadrature.shape
    shapes = by_facet.reshape(-1, len(tip.points))
    on_sphere = np.abs(np.linalg.norm(tip.points - [0.0, 0.0, tip.radius], axis=1) - tip.radius)
    ball = (on_sphere < ON_SPHERE * tip.radius)[tip.facets].all(axis=1)
    flat = shapes @ tip.points
    depth = np.sqrt(np.maximum(0.0, tip.radius**2 - (flat[:, :2] ** 2).sum(axis=1)))
    sphere = tip.radius - np.copysign(depth, tip.radius - flat[:, 2])
    lift = np.where(np.repeat(ball, len(quadrature.shape)), sphere - flat[:, 2], 0.0)
    heights = tip.points[:, 2] + shapes.T @ (weights * lift) / (shapes.T @ weights)
    # A facet on the rim has a node that fewer than four candidate facets share, off the symmetry
    # plane (two on it).
    count = np.bincount(tip.facets.ravel(), minlength=len(tip.points))
    rim = count < np.where(tip.held, 2, 4)
    outermost = np.repeat(rim[tip.facets].any(axis=1), len(quadrature.shape))
    return ContactArea(shapes, weights, shapes @ heights, outermost)


def indent(tip: TipCompliance, area: ContactArea, force: float) -> Indentation:
    """Press the plane with `force` (N, on the full body).

    Raises ValueError: the force is not positive, or the contact reaches the edge of the candidates.
    Raises ArithmeticError: Newton's method does not converge.
    """
    if not (math.isfinite(force) and force > 0.0):
        raise ValueError(f"force = {force}: must be a finite number above 0, in N")
    kappa = PENALTY * tip.material.plane_strain_modulus / tip.radius
    approach, u = _solve(tip, area, kappa, force)
    pressure = kappa * np.maximum(0.0, approach - area.heights - area.shapes @ u)
    touching = pressure > 0.0
    if (touching & area.outermost).any():
        raise ValueError(
            f"force = {force:g} N: the contact reaches the edge of the {len(u)} candidate nodes; "
            "give a larger reach"
        )
    f = area.shapes.T @ (area.weights * pressure)
    penalty = tip.symmetry_factor * 0.5 * float(area.weights @ pressure**2) / kappa
    springs = _springs(area, kappa, touching)
    share = area.weights * pressure / (area.weights @ pressure)
    x, z = tip.points[:, :2].T @ area.shapes.T
    total = springs.sum(axis=1)
    normal = total @ np.linalg.solve(np.eye(len(u)) + tip.normal @ springs, np.ones(len(u)))
    return Indentation(
        force_N=force,
        indentation_m=approach - 4.0 / 3.0 * penalty / force,
        energy_J=tip.symmetry_factor * 0.5 * float(f @ tip.normal @ f) + 2.0 / 3.0 * penalty,
        contact_radius_m=math.sqrt(2.5 * float(share @ ((x - share @ x) ** 2 + z**2))),
        normal_tangent_N_per_m=tip.symmetry_factor * float(normal),
        tangential_tangent_N_per_m=tip.symmetry_factor * _stick(tip, springs),
    )


def _springs(area: ContactArea, kappa: float, touching: Flags) -> Array:
    """Σ_q κ w_q N_q N_qᵀ over the points in contact, (k, k)."""
    shapes = area.shapes[touching]
    return np.asarray((shapes.T * (kappa * area.weights[touching])) @ shapes)


def _solve(
    tip: TipCompliance, area: ContactArea, kappa: float, force: float
) -> tuple[float, Array]:
    """Newton for (u, δ): u - C f = 0 and s Σ f = F; the step is halved where it overshoots."""
    k = len(tip.points)
    scale = hertz_indentation(tip.material, tip.radius, force)

    def residual(x: Array) -> tuple[Array, Flags]:
        depth = x[k] - area.heights - area.shapes @ x[:k]
        f = area.shapes.T @ (area.weights * kappa * np.maximum(0.0, depth))
        missing = (tip.symmetry_factor * f.sum() - force) / force * scale
        return np.append(x[:k] - tip.normal @ f, missing), depth > 0.0

    heights = tip.points[:, 2]
    x = np.append(np.maximum(0.0, scale - heights), scale)
    r, touching = residual(x)
    for _ in range(ITERATIONS):
        springs = _springs(area, kappa, touching)
        matrix = np.zeros((k + 1, k + 1))
        matrix[:k, :k] = np.eye(k) + tip.normal @ springs
        matrix[:k, k] = -tip.normal @ springs.sum(axis=1)
        row = tip.symmetry_factor * scale / force * springs.sum(axis=0)
        matrix[k, :k], matrix[k, k] = -row, row.sum()
        step = np.linalg.solve(matrix, -r)
        size, length = np.linalg.norm(r), 1.0
        for _ in range(HALVINGS):
            tried = x + length * step
            following, active = residual(tried)
            if active.any() and np.linalg.norm(following) < size:
                break
            length *= 0.5
        x, r, touching = tried, following, active
        if np.abs(r).max() < 1e-11 * scale:
            return float(x[k]), x[:k]
    raise ArithmeticError(
        f"force = {force:g} N: the indentation does not converge; residual {np.abs(r).max():.2g} m"
    )


def _stick(tip: TipCompliance, springs: Array) -> float:
    """Σ f_t for a plane that moves by 1 along the plane of motion and by 0 along Z, N/m."""
    k = len(springs)
    free = np.append(np.ones(k, dtype=bool), ~tip.held)
    c = tip.tangential.transpose(2, 0, 3, 1).reshape(2 * k, 2 * k)
    both = np.kron(np.eye(2), springs)[np.ix_(free, free)]
    plane = np.append(np.ones(k), np.zeros(k))[free]
    u = np.linalg.solve(
        np.eye(free.sum()) + c[np.ix_(free, free)] @ both, c[np.ix_(free, free)] @ both @ plane
    )
    return float((both @ (plane - u))[:k].sum())


def mindlin_ratio(poisson_ratio: float) -> float:
    """η² = (2 - ν)/(2 (1 - ν)), normal over tangential tangent stiffness (Mindlin 1949)."""
    return (2.0 - poisson_ratio) / (2.0 * (1.0 - poisson_ratio))
