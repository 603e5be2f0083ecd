"""A planar chain of the mesh's rigid phalanges, which falls in `rigid_flight`.

Masses, mass centres and moments of inertia are those of the lumped nodal masses, so that the
explicit run which takes over has the same momentum and energy.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from reference_fem.arrays import Array, ComplexArray, Index
from reference_fem.compiled import njit
from reference_fem.torques import Torques


@njit(cache=True)
def joint_inertia(
    angles: Array, arm_products: ComplexArray, inertia: Array
) -> tuple[Array, ComplexArray, ComplexArray]:
    """Inertia of the joints Σ_w m_w b_wj·b_wk + δ_jk J_j, (P, P); Σ_w m_w conj(b_wj) b_wk, whose
    real part is b_j·b_k and whose imaginary part is (e x b_j)·b_k; and e^iθ.

    b_wj = R(θ_j) arms[w, j], e the unit vector along Z.
    """
    turns = np.exp(1j * angles)
    products = arm_products * (turns.conj().reshape(-1, 1) * turns)
    joints = products.real.copy()
    for w in range(inertia.size):
        joints[w, w] += inertia[w]
    return joints, products, turns


@njit(cache=True)
def lagrange_rates(
    state: Array, torques: Array, arm_products: ComplexArray, moments: ComplexArray,
    inertia: Array, gravity: complex,
) -> Array:  # fmt: skip
    """d(θ, ω)/dt of state (2P,) under torques T (P,), from Lagrange's equations.

        Σ_k [Σ_w m_w b_wj·b_wk + δ_jk J_j] ω'_k = T_j + Σ_w m_w (e x b_wj)·[f + Σ_k ω_k² b_wk]

    gravity : f as f_X + i f_Y. The rest is `RigidChain`'s.
    """
    rates = state[inertia.size :]
    joints, products, turns = joint_inertia(state[: inertia.size], arm_products, inertia)
    load = torques + (np.conj(moments * turns) * gravity).imag
    for j in range(inertia.size):
        for k in range(inertia.size):
            load[j] += products[j, k].imag * rates[k] ** 2
    if not (np.isfinite(load).all() and np.isfinite(joints).all()):
        return np.full(state.size, np.nan)  # of a stage that is far too long
    return np.concatenate((rates, np.linalg.solve(joints, load)))


@dataclass(frozen=True)
class ChainState:
    """Absolute angles from the rest position, rad, their rates, rad/s, and the time, s."""

    angles: Array
    rates: Array
    time_s: float


@dataclass(frozen=True)
class RigidChain:
    """P rigid bodies chained by hinges, the first hinge fixed.

    mass, inertia : (P,), inertia about the body's own mass centre, about Z, kg·m²
    arms : (P, P, 2), arms[w, j]: what body j adds to the position of body w's mass centre at rest:
        hinge to hinge for j < w, hinge to mass centre for j = w, zero beyond
    origins : (P, 2), rest position of each body's first hinge
    torques : on each body, reactions included
    gravity_vector : (2,), f, acceleration of gravity
    arm_products : (P, P), Σ_w m_w conj(a_wj) a_wk of the arms a as complex numbers X + iY
    moments : (P,), Σ_w m_w a_wj
    """

    mass: Array
    inertia: Array
    arms: Array
    origins: Array
    torques: Torques
    gravity_vector: Array
    arm_products: ComplexArray = field(init=False)
    moments: ComplexArray = field(init=False)

    def __post_init__(self) -> None:
        arms = self.arms[..., 0] + 1j * self.arms[..., 1]
        object.__setattr__(self, "arm_products", arms.conj().T @ (self.mass[:, None] * arms))
        object.__setattr__(self, "moments", self.mass @ arms)

    @property
    def links(self) -> int:
        """P."""
        return self.mass.size

    def rates_of_change(self, state: Array, torques: Array) -> Array:
        """d(θ, ω)/dt of state (2P,) under torques T (P,): see `lagrange_rates`."""
        gravity = complex(*self.gravity_vector)
        rates: Array = lagrange_rates(
            state, torques, self.arm_products, self.moments, self.inertia, gravity
        )
        return rates

    def mobility(self, state: ChainState, place: Array) -> tuple[Array, Array]:
        """What an impulse p at `place` (2,) of the last body adds to its velocity: G p.

            v = Σ_j ω_j e x l_j,  G = Σ_jk (e x l_j) [M⁻¹]_jk (e x l_k)

        with l_j from hinge to hinge, the last to the place, and M the inertia of the joints.

        Returns G (2, 2), 1/kg, and v (2,).
        """
        hinges, _ = self.hinges_at(state.angles, state.rates)
        links = np.diff(np.vstack([hinges, place]), axis=0)
        turned = np.stack([-links[:, 1], links[:, 0]])
        inertia, _, _ = joint_inertia(state.angles, self.arm_products, self.inertia)
        return turned @ np.linalg.solve(inertia, turned.T), turned @ state.rates

    def energy(self, state: ChainState) -> float:
        """Kinetic energy + gravity potential - Σ T θ, from rest at zero angles, J.

        With `Torques.torque_change_work` added it is constant.
        """
        b = _rotate(state.angles, self.arms)
        turned = np.stack([-b[..., 1], b[..., 0]], axis=-1)
        speed = np.einsum("k,wkd->wd", state.rates, turned)
        kinetic = 0.5 * (self.mass @ (speed**2).sum(axis=1) + self.inertia @ state.rates**2)
        moved = (b - self.arms).sum(axis=1)
        fx, fy = self.gravity_vector
        gained = fy * self.mass @ moved[:, 1] + fx * self.mass @ moved[:, 0]
        return float(kinetic - gained - self.torques.at(state.time_s) @ state.angles)

    def hinges_at(self, angles: Array, rates: Array) -> tuple[Array, Array]:
        """Positions and velocities (P, 2) of the first hinges."""
        links = _rotate(angles[:-1], np.diff(self.origins, axis=0))
        turned = np.stack([-links[:, 1], links[:, 0]], axis=1) * rates[:-1, None]
        place, velocity = (np.vstack([np.zeros(2), np.cumsum(v, axis=0)]) for v in (links, turned))
        return self.origins[0] + place, velocity


def build_chain(
    points: Array,
    lumped_mass: Array,
    body_nodes: list[Index],
    hinge_points: Array,
    torques: Torques,
    gravity_vector: tuple[float, float],
) -> RigidChain:
    """Chain from the mesh's masses.

    points : (n_points, dim). body_nodes : nodes of each phalanx.
    lumped_mass : (n_points,); `torques` must belong to the same (half or full) body.
    hinge_points : (P, 2), rest position of each phalanx's first hinge.
    """
    count = len(body_nodes)
    mass, inertia = np.zeros(count), np.zeros(count)
    arms = np.zeros((count, count, 2))
    for w, nodes in enumerate(body_nodes):
        m, x = lumped_mass[nodes], points[nodes, :2]
        centre = m @ x / m.sum()
        mass[w] = m.sum()
        inertia[w] = m @ ((x - centre) ** 2).sum(axis=1)
        arms[w, :w] = np.diff(hinge_points[: w + 1], axis=0)
        arms[w, w] = centre - hinge_points[w]
    return RigidChain(
        mass, inertia, arms, np.asarray(hinge_points), torques, np.array(gravity_vector)
    )


def chain_and_start(
    chain: RigidChain | None, start: ChainState | None
) -> tuple[RigidChain, ChainState]:
    """The chain of a mesh, and the state that its flight starts from: at rest unless given.

    Raises ValueError: the mesh has no chain, or the state does not fit it or is not finite.
    """
    if chain is None:
        raise ValueError("mesh: no hinge sets; a finger needs at least 'hinge_1_proximal'")
    if start is None:
        return chain, ChainState(np.zeros(chain.links), np.zeros(chain.links), 0.0)
    angles, rates = np.asarray(start.angles, dtype=float), np.asarray(start.rates, dtype=float)
    if angles.shape != (chain.links,) or rates.shape != (chain.links,):
        raise ValueError(
            f"start: angles of shape {angles.shape} and rates of shape {rates.shape} for "
            f"{chain.links} phalanges; give one of each per phalanx"
        )
    if not (np.isfinite([*angles, *rates]).all() and 0.0 <= start.time_s < math.inf):
        raise ValueError(
            f"start: angles {angles}, rates {rates}, time_s = {start.time_s!r}: must be finite "
            "numbers, the time not below 0"
        )
    return chain, ChainState(angles, rates, float(start.time_s))


def pose(
    chain: RigidChain, state: ChainState, points: Array, body_of_point: Index
) -> tuple[Array, Array]:
    """Displacement u = R(θ)(X - h) + x_h - X and velocity x_h' + ω x (x - x_h) of all points.

    Both are (n_points, dim).
    """
    rest = chain.origins[body_of_point]
    arm = points[:, :2] - rest
    turned = _rotate(state.angles[body_of_point], arm)
    hinge, drift = (of[body_of_point] for of in chain.hinges_at(state.angles, state.rates))
    displacement, velocity = np.zeros_like(points), np.zeros_like(points)
    displacement[:, :2] = (turned - arm) + (hinge - rest)
    rate = state.rates[body_of_point]
    velocity[:, 0] = drift[:, 0] - rate * turned[:, 1]
    velocity[:, 1] = drift[:, 1] + rate * turned[:, 0]
    return displacement, velocity


def _rotate(angles: Array, vectors: Array) -> Array:
    """Vectors (.., n, 2) turned by angles (n,)."""
    c, s = np.cos(angles), np.sin(angles)
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)
