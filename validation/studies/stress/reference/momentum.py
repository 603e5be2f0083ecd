"""Momentum of a run of the reference: what its steps' impulses gave, against what its fields hold.

Between any two kept fields, by the trapezoid over every step that central differences make exact:

    free body   p = Σ m v,         Δp = ∫ (F - m g e_y) dt
    finger      J = Σ m (x × v),   ΔJ = ∫ (x_c F_n - y_c F_t - g Σ m x + Σ t_w) dt

J is taken about the fixed hinge, where the hinges' reactions have no moment: each holds a mean
position, and those between phalanges are opposite. x - x(Δt) is parallel to v, so that leapfrog
keeps J exactly too; what is not exact is c, the centre of the normal forces, which the fields show
and which is linear in time between them.
"""

from collections.abc import Iterator

import numpy as np
from scipy.integrate import cumulative_trapezoid

from reference_fem import TapResult
from reference_fem.arrays import Array
from reference_fem.model import Model

# Round-off of sums over some hundred nodes and some thousand steps, where all else is exact.
EXACT = 1e-6
# Share of the impulse's moment, by the centre between two fields. 225 completed cells are off by at
# most 0.025, half of them by 1e-5; 24 that were crushed within a few fields by 0.047.
BY_CENTRE = 0.06


def momentum(result: TapResult, model: Model) -> Iterator[str]:
    """A sentence where the body's momentum is not what weight, torques and contact gave it."""
    hinged = model.hinges.size > 0
    gained, given, impulse = (_angular if hinged else _linear)(result, model)
    bound = (BY_CENTRE if hinged else EXACT) * impulse
    off = np.abs(gained - gained[0] - (given - given[0])).max()
    if off > bound + EXACT * np.abs(gained).max():
        yield f"momentum off by {off / max(impulse, np.abs(gained).max()):.3g}"


def _given(result: TapResult, rate: Array) -> Array:
    """∫ rate dt, over every step, at the times of the fields."""
    time = result.forces.time_s
    return np.asarray(
        [
            np.interp([s.time_s for s in result.snapshots], time, column)
            for column in cumulative_trapezoid(rate, time, axis=0, initial=0.0).T
        ]
    ).T


def _linear(result: TapResult, model: Model) -> tuple[Array, Array, float]:
    """Momentum at the fields, what was given up to them, (n, 2), and the sum of the impulses."""
    f = result.forces
    force = np.column_stack([f.tangential_force_N, f.normal_force_N])
    mass = float(model.mass.sum()) * model.symmetry_factor
    weight = mass * np.array(model.gravity_vector)
    gained = [model.mass @ s.velocity[:, :2] * model.symmetry_factor for s in result.snapshots]
    impulse = float(np.trapezoid(np.abs(force).max(axis=1), f.time_s))
    return np.array(gained), _given(result, force + weight), impulse


def _angular(result: TapResult, model: Model) -> tuple[Array, Array, float]:
    """The same for the moment of momentum about the fixed hinge, (n, 1)."""
    f, nodes, shown = result.forces, model.contact.nodes, result.snapshots
    mass = model.mass * model.symmetry_factor
    times = np.array([s.time_s for s in shown])
    places = np.array([(model.points + s.displacement)[:, :2] for s in shown])
    velocities = np.array([s.velocity[:, :2] for s in shown])
    pushed = np.array([s.contact_pressure_Pa[nodes] * model.contact.area for s in shown])
    if not pushed.any():  # a touch between two fields: by the lowest node
        pushed[-1, np.argmin(places[-1, nodes, 1])] = 1.0
    some = pushed.any(axis=1)
    centres = np.einsum("tn,tnc->ct", pushed[some], places[some][:, nodes])
    x, y = (np.interp(f.time_s, times[some], c) for c in centres / pushed[some].sum(axis=1))
    contact = x * f.normal_force_N - y * f.tangential_force_N
    weights = _moment(places, np.array(model.gravity_vector)) @ mass
    signs = np.zeros(model.torques.values.shape[1])
    np.add.at(signs, model.couples.joints, model.couples.signs * model.symmetry_factor)
    couples = np.interp(f.time_s, model.torques.times, model.torques.values @ signs)
    rate = contact + np.interp(f.time_s, times, weights) + couples
    impulse = np.abs(x * f.normal_force_N) + np.abs(y * f.tangential_force_N)
    return (
        (_moment(places, velocities) @ mass)[:, None],
        _given(result, rate[:, None]),
        float(np.trapezoid(impulse, f.time_s)),
    )


def _moment(place: Array, vector: Array) -> Array:
    """Of vectors (..., 2) about the origin."""
    return np.asarray(place[..., 0] * vector[..., 1] - place[..., 1] * vector[..., 0])
