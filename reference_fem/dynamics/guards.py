"""Checks that end a run gone wrong: lost energy, elements turned inside out, too much work."""

import math

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.compiled import njit
from reference_fem.dynamics.state import LoopState, State
from reference_fem.dynamics.step import Block
from reference_fem.elements.geometry import CORNERS, reference_element
from reference_fem.elements.stress import determinant, lower
from reference_fem.model import Model
from reference_fem.results.result import Sample, Status
from reference_fem.settings import NEO_HOOKE, Settings

Failure = tuple[Status, str]

# Audits between two searches of all elements and nodes: the checks then take 3 to 6 % of a run's
# time on the presets on two threads (measured; 8 to 12 % with a search at every fourth audit).
FULL_SEARCH = 16
# Depth over H below the surface allowed to nodes outside the contact law: round-off.
PASSED = 1e-9
OF_LAW = (
    "; St. Venant-Kirchhoff's law softens where it is crushed, on finer meshes the sooner: fem3d "
    f"has another one (material.law = '{NEO_HOOKE}')"
)
OF_MESH = "; refine the mesh where it touches (solver.fem.tip_size)"
# dN_a/dxi_k at the Gauss points, (a, q, k)
SLOPES = {dim: reference_element(dim).slopes[..., :-1].swapaxes(1, 2) for dim in CORNERS}


def failure(
    model: Model,
    settings: Settings,
    now: LoopState,
    block: Block,
    taken: Sample,
) -> Failure | None:
    """Why the run must end with the state from which `block` started; None if all is well.

    All elements are searched for one turned inside out at every `FULL_SEARCH`-th audit, those that
    touch at each: elements are crushed where the body hits, and one that turns back in between
    leaves no trace in the energy.
    """
    state = now.state
    found = _energy(model, settings, state, taken, now.largest_kinetic_J)
    if found is not None:
        return found
    touches = block.searched and taken.normal_force_N > 0.0
    crushed = touches and not touching_det(model, state.displacement, block.pressure) > 0.0
    if crushed or now.audits % FULL_SEARCH == 0:
        found = searched(model, state, crushed)
    if found is None and now.steps >= settings.max_steps:
        message = f"max_steps = {settings.max_steps} reached {_where(model, state)}"
        found = Status.WORK_LIMIT, message
    return found


def advice(model: Model, status: Status) -> str:
    """What to do about a status; of an element turned inside out, also what its law decides."""
    if status is not Status.INVERTED_ELEMENT:
        return status.advice
    return status.advice + (OF_LAW if model.kernel.kind.softens > 0.0 else OF_MESH)


def searched(model: Model, state: State, crushed: bool = False) -> Failure | None:
    """Failure by an element turned inside out, or by a part below the surface that can't touch it.

    crushed : whether an element that touches is known to be turned inside out at a Gauss point,
        which its own rule may not use
    """
    smallest = model.kernel.min_det_F(state.displacement)
    if math.isnan(smallest):
        return Status.UNSTABLE, f"values are no longer finite {_where(model, state)}"
    if smallest <= 0.0:
        what = f"det F fell to {smallest:.3g}"
    elif crushed:
        what = "det F fell below 0 in a part of an element that touches"
    else:
        return _passed_through(model, state)
    return Status.INVERTED_ELEMENT, f"{what} {_where(model, state)}"


def _energy(
    model: Model, settings: Settings, state: State, taken: Sample, largest_kinetic: float
) -> Failure | None:
    if not taken.finite:
        # as is the energy, with ln J, of a neo-Hookean element that is turned inside out
        found = None if model.kernel.kind.softens > 0.0 else searched(model, state)
        if found is not None and found[0] is Status.INVERTED_ELEMENT:
            return found
        return Status.UNSTABLE, f"values are no longer finite {_where(model, state)}"
    if state.step == 0:  # damping at the rates of half a step before: what a step gains, beside 0
        return None
    error, allowed = abs(taken.energy_balance_J), settings.energy_tolerance
    scale = max(largest_kinetic, taken.kinetic_energy_J)
    if error > allowed * scale:
        # A body at rest has no kinetic energy to compare with: its potential over H stands in, and
        # without gravity the energy of strains of 1e-10, far above round-off.
        weight = model.symmetry_factor * model.mass.sum() * math.hypot(*model.gravity_vector)
        potential = weight * model.surface.height
        strained = 1e-20 * float(model.kernel.cell_volume @ model.kernel.mu)
        scale = max(scale, 1e-6 * potential, strained)
    if error > allowed * scale:
        lost = taken.energy_balance_J < 0.0
        return (
            Status.ENERGY_LOST if lost and settings.contact == "impulse" else Status.UNSTABLE,
            f"the energy balance is off by {error:.3g} J, {100 * error / scale:.3g} % of the "
            f"largest kinetic energy, which was {'lost' if lost else 'gained'}, "
            f"{_where(model, state)}",
        )
    return None


def touching_det(model: Model, displacement: Array, pressure: Array) -> float:
    """Smallest det(dx/dξ), m³ or m², at the Gauss points of the elements under pressure; else inf.

    All Gauss points count, also those that a 1-point element does not use. The sign is that of
    det F; NaN if one is NaN. Parameters: displacement (n_points, dim), pressure (n_points,).
    """
    given, slopes = (model.cells, model.contact_cells), SLOPES[displacement.shape[1]]
    return float(_least_det(model.points, displacement, *given, pressure, slopes))


@njit(cache=True)
def _least_det(
    points: Array, displacement: Array, cells: Index, chosen: Index, pressure: Array, slopes: Array
) -> float:
    corners, n_q, dim = slopes.shape
    least, j = np.inf, np.empty((dim, dim))
    for number in chosen:
        cell, touches = cells[number], False
        for node in cell:
            touches = touches or pressure[node] > 0.0
        for q in range(n_q if touches else 0):
            j[:] = 0.0
            for a in range(corners):
                for i in range(dim):
                    x = points[cell[a], i] + displacement[cell[a], i]
                    for k in range(dim):
                        j[i, k] += x * slopes[a, q, k]
            least = lower(least, determinant(j))
    return least


def _passed_through(model: Model, state: State) -> Failure | None:
    """Failure by a part outside the contact law that has gone through the surface, if any."""
    height = model.points[:, 1] + state.displacement[:, 1]
    low = np.flatnonzero(height < -(1.0 + PASSED) * model.surface.height)
    bodies = np.unique(model.body_of_point[low])
    bodies = bodies[bodies != model.touching_body] + 1
    if not bodies.size:
        return None
    return (
        Status.PASSED_THROUGH,
        f"phalanx {', '.join(map(str, bodies))} is below the surface, which only the last "
        f"phalanx can touch, {_where(model, state)}",
    )


def _where(model: Model, state: State) -> str:
    return f"at step {state.step}, t = {state.time_s:.6g} s, with a step of {model.step_s:.4g} s"
