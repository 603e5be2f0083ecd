"""A flight on fewer elements, whose motion the run's own mesh takes over before the touch.

Displacement and velocity at a node X of the run's mesh are moving least squares of those at the
flight's nodes X_i of the same phalanx (Lancaster and Salkauskas, Math. Comp. 37, 1981): with q the
polynomials of second order in X_i - X,

    u(X) = Σ_i φ_i u_i,  φ = w_i q_i·[Σ_j w_j q_j q_jᵀ]⁻¹ e_1,  w = (1 - |X_i - X|²/r²)²

over the nodes within r of X. Quadratic fields are exact: rigid motions, uniform strains, and
bending with the change of its sections. An element's own shape functions would leave a shear of the
bending's size over the number of elements across, with which the run's mesh would ring.

Gaps left in the hinges are closed by moving phalanges, and differences in the joints' momenta
p_k = Σ m v·e_k by changing joint rates, e_k the velocities for a unit rate in joint k alone: hinge
reactions change no p_k. Both keep strains.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from reference_fem.arrays import Array, Index
from reference_fem.dynamics.flight_block import FLIGHT_BLOCK, closing_speed, flight_block
from reference_fem.dynamics.state import LoopState, State
from reference_fem.dynamics.step import Block, advance, lowest_gap, start_state
from reference_fem.model import Model
from reference_fem.ties import follow

REACH = 2.5
"""r over the longest extent of the flight's cells: an end sees three layers of nodes."""
CHUNK = 1024
"""Fits solved at a time."""
LARGEST_CONDITION = 1e9
"""Condition number of a fit above which its nodes do not determine a polynomial."""


@dataclass(frozen=True)
class CoarseFlight:
    """The flight's model, the run's model, and the maps of fields from the first to the second.

    even, odd : (n_points of the run, n_points of the flight), φ for components in the plane of
        motion and, where there is a symmetry plane, across it
    """

    model: Model
    to: Model
    even: csr_array
    odd: csr_array

    def steps_ahead(self, state: State, lead_steps: int) -> int:
        """Steps of the flight in which the run's mesh goes at most half its way to the touch.

        Less than one: it is time to hand over.
        """
        reach_s = self.gap(state) / max(closing_speed(self.model, state), 1e-300)
        ahead = 0.5 * (reach_s - lead_steps * self.to.step_s) / self.model.step_s
        return int(min(FLIGHT_BLOCK, ahead))  # NaN, of a flight that diverged, gives a block

    def gap(self, state: State) -> float:
        """Lowest gap of the run's mesh in a state of the flight, m."""
        return lowest_gap(self.to, self.on_run(state.displacement))

    def advanced(self, state: State, lead_steps: int) -> tuple[State, Block] | None:
        """The flight's next block, not past the time to hand over; None: that is now."""
        return flight_block(self.model, state, self.steps_ahead(state, lead_steps), self.gap)

    def on_run(self, field: Array) -> Array:
        """Map a field (n_points, dim) of the flight's nodes to the run's; close the hinges."""
        run = self.to
        moved = np.hstack([self.even @ field[:, :2], self.odd @ field[:, 2:]])
        moved[run.symmetry, 2:] = 0.0
        follow(moved, np.ones(len(moved)), run.ties)
        moved[:, :2] -= np.cumsum(_at_hinges(run, moved, run.hinges.weights), 0)[run.body_of_point]
        return moved

    def motion(self, displacement: Array, velocity: Array) -> tuple[Array, Array]:
        """Displacement and velocity on the run's mesh, with the flight's joint momenta."""
        wanted = np.tensordot(joint_momenta(self.model, displacement)[0], velocity[:, :2])
        displacement, velocity = self.on_run(displacement), self.on_run(velocity)
        momenta, motions = joint_momenta(self.to, displacement)
        missing = wanted - np.tensordot(momenta, velocity[:, :2])
        inertia = np.tensordot(momenta, motions, ((1, 2), (1, 2)))
        velocity[:, :2] += np.tensordot(np.linalg.solve(inertia, missing), motions, 1)
        return displacement, velocity

    def handed_over(self, now: LoopState) -> LoopState:
        """The loop's state on the run's mesh; accumulated energies carry over."""
        state, (_, block) = now.state, advance(self.model, now.state, 1, False)
        motion = self.motion(state.displacement, block.velocity)
        near = np.zeros(self.model.hinges.size)
        near[self.model.couples.phalanges] = state.face_angles
        after = start_state(self.to, *motion, state.time_s, near, state.torque_change_work_J)
        after = replace(after, material_J=block.material_J)
        return replace(now, state=after, coarse=False, flight_steps=state.step)


def coarse_flight(flight: Model, run: Model) -> CoarseFlight:
    """Set up the maps of fields from the flight's mesh to the run's.

    Raises ValueError: the two are not meshes of one finger, or the flight's nodes are too few.
    """
    one, other = ((m.points.shape[1], m.symmetry_factor, m.hinges.size) for m in (flight, run))
    if one != other or not np.allclose(
        _at_hinges(flight, flight.points), _at_hinges(run, run.points)
    ):
        raise ValueError(
            "flight_mesh: is not the finger of the run's mesh; give one of the same phalanges "
            "and symmetry, with longer edges"
        )
    rows, columns, even, odd = [], [], [], []
    for w in range(run.hinges.size):
        own = np.flatnonzero(flight.body_of_point == w)
        cells = flight.points[flight.cells[np.isin(flight.cells[:, 0], own)]]
        beyond = np.setdiff1d(own, flight.symmetry) if flight.symmetry.size else own[:0]
        mirrored = flight.points[beyond] * ([1.0, 1.0, -1.0][: cells.shape[2]])
        places, sign = np.vstack([flight.points[own], mirrored]), np.ones(own.size + beyond.size)
        sign[own.size :] = -1.0
        own = np.append(own, beyond)
        wanted = np.flatnonzero(run.body_of_point == w)
        for some in np.array_split(wanted, len(wanted) // CHUNK + 1):
            reach = REACH * float(np.ptp(cells, axis=1).max())
            near, weights = moving_least_squares(places, run.points[some], reach)
            rows.append(np.repeat(some, near.shape[1]))
            columns.append(own[near].ravel())
            even.append(weights.ravel())
            odd.append((weights * sign[near]).ravel())
    index = np.concatenate(rows), np.concatenate(columns)
    shape = len(run.points), len(flight.points)
    maps = (csr_array((np.concatenate(values), index), shape) for values in (even, odd))
    return CoarseFlight(flight, run, *maps)


def moving_least_squares(nodes: Array, places: Array, reach: float) -> tuple[Index, Array]:
    """Indices (m, k) of `nodes` (n, dim) near each of `places` (m, dim), and their φ (m, k).

    Raises ValueError: the nodes near a place do not determine a polynomial of second order.
    """
    tree, above = cKDTree(nodes), np.triu_indices(nodes.shape[1])
    most = int(tree.query_ball_point(places, reach, return_length=True).max())
    distance, near = tree.query(places, range(1, most + 1), distance_upper_bound=reach)
    near[np.isinf(distance)] = 0
    weight = np.maximum(1.0 - (distance / reach) ** 2, 0.0) ** 2
    apart = (nodes[near] - places[:, None]) / reach
    second = apart[..., above[0]] * apart[..., above[1]]
    basis = np.concatenate([np.ones_like(apart[..., :1]), apart, second], axis=2)
    weighted = weight[..., None] * basis
    moments = np.swapaxes(weighted, 1, 2) @ basis
    if not (np.linalg.cond(moments) < LARGEST_CONDITION).all():
        raise ValueError(
            "flight_mesh: a phalanx has too few nodes to transfer its bending; give at least "
            "two elements along each of its directions (shorter solver.fem.flight_size)"
        )
    first = np.linalg.solve(moments, np.eye(moments.shape[1])[:, :1])
    return near, np.asarray((weighted @ first)[..., 0])


def _at_hinges(model: Model, field: Array, weights: Array | None = None) -> Array:
    """A field's means over the hinges' proximal faces, (P, 2), or with their weights the gaps."""
    of = np.maximum(model.hinges.weights, 0.0) if weights is None else weights
    parts = of[:, None] * field[model.hinges.nodes, :2]
    return np.asarray(np.add.reduceat(parts, model.hinges.starts[:-1]))


def joint_momenta(model: Model, displacement: Array) -> tuple[Array, Array]:
    """Momenta m e_k and motions e_k, (P, n_points, 2), of the mesh as given.

    Phalanx k turns about its first hinge and carries those after it.
    """
    place = model.points[:, :2] + displacement[:, :2]
    hinges, body = _at_hinges(model, place), model.body_of_point
    k = np.arange(len(hinges))[:, None]
    carried = np.append(hinges[1:], hinges[:1], axis=0)[:, None]
    arms = np.where((body > k)[..., None], carried, place) - hinges[:, None]
    arms[body < k] = 0.0
    motions = np.stack([-arms[..., 1], arms[..., 0]], axis=2)
    return motions * model.mass[:, None], motions
