"""Rigid chain and outline of the finger's true shape, whose round parts flat facets cut short."""

import math
from collections.abc import Callable, Sequence

import numpy as np

import meshes
from meshes.bounds import check_dim
from reference_fem.arrays import Array, Index
from reference_fem.rigid.rigid_chain import RigidChain, build_chain
from reference_fem.settings import Drive, Material, check_materials

POINTS = 64
"""Points of each quadrature rule: exact for round shafts and balls, to 1e-6 for holes and discs."""
LEGENDRE = np.polynomial.legendre.leggauss(POINTS)
"""Nodes and weights on -1..1; an eigenvalue problem, solved once."""
LARGEST_CHANGE = 0.5
"""Largest relative change of a node's mass by `mass_factors`."""
LEAST_MASS, MOST_MASS, FARTHEST = 0.55, 1.2, 0.1
"""A phalanx's mass over its shape's, and the distance of their centres over its length, beyond
which the mesh is of another body: sections of four chords have 0.64."""
LARGEST_CONDITION = 1e12
"""Condition of `mass_factors`' equations beyond which they tell nothing: nodes on a circle."""


def true_chain(
    geometry: meshes.FingerGeometry, materials: Sequence[Material], drive: Drive, dim: int
) -> RigidChain:
    """Chain of phalanges with the masses, centres and inertias of the shape itself.

    Round shafts and a half-ball in 3D; in 2D the plane-stress body, whose end is half a disc and
    whose thickness is the chord 2 sqrt(R² - y²) of the round section. Holes for shafts are taken
    out. Masses are quadrature weights times density.

    Raises ValueError: there is not one material per phalanx, or not one torque, or no such `dim`.
    """
    check_dim(dim)
    check_materials(materials, geometry.phalanges)
    points, masses, bodies, first = [], [], [], 0
    last = geometry.phalanges - 1
    for w, (hinge, length, radius) in enumerate(
        zip(geometry.hinges, geometry.lengths, geometry.radii, strict=True)
    ):
        rounded = geometry.rounded(w)
        end = hinge - length + radius * rounded
        parts = [_round(*_gauss(end, hinge), np.full(POINTS, radius))]
        if rounded:
            along, dx = _gauss(0.0, radius)
            ball = _round(along, dx, np.sqrt(radius**2 - along**2))
            x, weights = ball if dim == 3 else _half_disc(radius, radius)
            parts.append((np.array([end, 0.0]) - x, weights))
        if geometry.shaft_radius is not None:
            x, weights = _half_disc(geometry.shaft_radius, radius)
            parts.append((np.array([hinge, 0.0]) - x, -weights))
            if w < last:
                parts.append((np.array([end, 0.0]) + x, -weights))
        points += [x for x, _ in parts]
        masses += [materials[w].density * weights for _, weights in parts]
        count = sum(weights.size for _, weights in parts)
        bodies.append(np.arange(first, first + count))
        first += count
    return build_chain(
        np.concatenate(points),
        np.concatenate(masses),
        bodies,
        np.stack([geometry.hinges, np.zeros(last + 1)], axis=1),
        drive.loads_for(last + 1),
        drive.gravity_vector,
    )


def lowest_point(geometry: meshes.FingerGeometry, axis: float) -> tuple[float, float, float]:
    """The last phalanx's lowest point: how far along its axis from its hinge, m, and where from
    there, (x, y) m. axis : of the phalanx below the horizontal, rad.

    The ball's where the end points down, R below its centre, else a rim's, R |cos axis| below its
    centre: that at the hinge, or at a flat end that points down.
    """
    radius, length = geometry.radii[-1], geometry.lengths[-1]
    along, dip = math.cos(axis), math.sin(axis)
    if dip >= 0.0 and geometry.tip == "hemisphere":
        return length - radius, 0.0, -radius
    down = math.copysign(radius, along)
    return length if dip >= 0.0 else 0.0, down * dip, -down * along


def true_gap(geometry: meshes.FingerGeometry, height: float) -> Callable[[Array], float]:
    """Height of the last phalanx's lowest point above the plane, m, as a function of the angles."""

    def gap(angles: Array) -> float:
        hinge = -float(np.dot(geometry.lengths[:-1], np.sin(angles[:-1])))
        reach, _, below = lowest_point(geometry, angles[-1])
        return hinge - reach * math.sin(angles[-1]) + below + height

    return gap


def mass_factors(
    points: Array, lumped_mass: Array, body_nodes: Sequence[Index], true: RigidChain,
    symmetry_factor: int,
) -> Array:  # fmt: skip
    """Factors f (n_points,) of nodal masses that give each phalanx the true shape's rigid motion.

    The least change, weighted with the masses: Σ m_i (f_i - 1)² is smallest where

        Σ m_i f_i (1, ξ_i, η_i, ξ_i² + η_i²) = (M, 0, 0, J)

    in axes at the true mass centre, so that f = 1 + λ·(1, ξ, η, ξ² + η²). Lumping and flat facets
    leave J off by 1 to 3 % on the presets' meshes, which shows in arrival, impulse and stress. A
    body whose masses would have to change by more than `LARGEST_CHANGE`, such as one with a single
    element along its axis, keeps its own.

    lumped_mass : (n_points,), as meshed. true : the chain of `true_chain`.
    symmetry_factor : the full body's masses over the mesh's.

    Raises ValueError: a phalanx is not the shape's, by its mass or the place of its centre.
    """
    factors = np.ones(len(points))
    for w, nodes in enumerate(body_nodes):
        mass = lumped_mass[nodes]
        centre = true.origins[w] + true.arms[w, w]
        length = np.ptp(points[nodes, 0])
        arm = (points[nodes, :2] - centre) / length
        share = symmetry_factor * mass.sum() / true.mass[w]
        off = float(np.linalg.norm(mass @ arm / mass.sum()))
        if not (LEAST_MASS < share < MOST_MASS and off < FARTHEST):
            raise ValueError(
                f"mesh: phalanx {w + 1} has {share:.3g} times the mass of mesh.shape's, and its"
                f" centre is {off:.2g} of its length away from that one's: give the shape of this"
                " mesh, where meshes places it, or None (half a body needs its node set 'symmetry')"
            )
        basis = np.stack([np.ones(nodes.size), *arm.T, (arm**2).sum(axis=1)])
        wanted = np.array([true.mass[w], 0.0, 0.0, true.inertia[w] / length**2]) / symmetry_factor
        matrix = basis * mass @ basis.T
        if np.linalg.cond(matrix) > LARGEST_CONDITION:
            continue
        change = np.linalg.solve(matrix, wanted - basis @ mass) @ basis
        if np.abs(change).max() <= LARGEST_CHANGE:
            factors[nodes] += change
    return factors


def _gauss(low: float, high: float) -> tuple[Array, Array]:
    x, weights = LEGENDRE
    return low + 0.5 * (high - low) * (x + 1.0), 0.5 * (high - low) * weights


def _chebyshev() -> tuple[Array, Array]:
    """Nodes and weights of ∫ f(y) sqrt(1 - y²) dy over -1..1."""
    angle = np.arange(1, POINTS + 1) * np.pi / (POINTS + 1)
    return np.cos(angle), np.pi / (POINTS + 1) * np.sin(angle) ** 2


def _round(x: Array, dx: Array, radii: Array) -> tuple[Array, Array]:
    """Round sections at `x`: ∫ f dV = ∫ dx ∫ f(x, y) 2 sqrt(r² - y²) dy."""
    y, dy = _chebyshev()
    points = np.stack([np.repeat(x, POINTS), np.outer(radii, y).ravel()], axis=1)
    return points, np.outer(dx * 2.0 * radii**2, dy).ravel()


def _half_disc(radius: float, section: float) -> tuple[Array, Array]:
    """The half-disc x >= 0 with the thickness 2 sqrt(R² - y²) of a round section."""
    y, dy = _chebyshev()
    share, dx = _gauss(0.0, 1.0)
    wide = radius * np.sqrt(1.0 - y**2)
    thick = 2.0 * np.sqrt(section**2 - (radius * y) ** 2)
    points = np.stack([np.outer(wide, share).ravel(), np.repeat(radius * y, POINTS)], axis=1)
    return points, np.outer(radius**2 * dy * thick, dx).ravel()
