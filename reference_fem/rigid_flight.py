"""The rigid chain's flight down to the surface, and the state just before it touches."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

import meshes
from reference_fem.arrays import Array
from reference_fem.model import Model, build_model
from reference_fem.rigid_chain import ChainState, RigidChain, chain_and_start, fly, pose
from reference_fem.settings import Drive, Material, Settings, Surface


def surface_gap(model: Model, chain: RigidChain) -> Callable[[Array], float]:
    """Height above the plane of the lowest point that may touch, m, as a function of the angles."""
    nodes, lowest = model.contact.nodes, model.contact.touching_points
    points, bodies = model.points[nodes], model.body_of_point[nodes]

    def gap(angles: Array) -> float:
        still = ChainState(angles, np.zeros_like(angles), 0.0)
        displacement, _ = pose(chain, still, points, bodies)
        return float(np.min(lowest(points + displacement)[:, 1])) + model.surface.height

    return gap


@dataclass(frozen=True)
class Descent:
    """A rigid flight down to the surface: its start, when it touches, and its states until then."""

    start: ChainState
    touch_s: float
    state_at: Callable[[float], ChainState]

    def before(self, seconds: float) -> ChainState:
        """The state so long before the touch, at most the start's."""
        return self.state_at(max(self.start.time_s, self.touch_s - seconds))


def descent(
    model: Model, chain: RigidChain, start: ChainState, settings: Settings
) -> Descent | None:
    """Rigid flight until the surface is reached; None if it never is."""
    end = start.time_s + settings.max_flight_time_s
    if settings.end_time_s is not None:
        end = min(end, settings.end_time_s)
    if end <= start.time_s:
        return None
    state_at, contact = fly(chain, start, surface_gap(model, chain), end)
    return None if contact is None else Descent(start, contact, state_at)


def impact_state(
    mesh: meshes.FingerMesh,
    materials: Sequence[Material],
    surface: Surface,
    drive: Drive,
    clearance_m: float,
    max_flight_time_s: float = 2.0,
    start: ChainState | None = None,
) -> ChainState | None:
    """State of the rigid flight with `clearance_m` left below the lowest node.

    From `start`, or from rest along -X. Runs on several meshes that start from it hit with the same
    angles and rates: the clearance must exceed what their lowest nodes differ by, h²/8R for edges h
    on a radius R.

    Returns
    -------
    None if the surface is not reached in time.

    Raises
    ------
    ValueError
        For bad input, naming it, its value and what is allowed.
    """
    above = replace(surface, height=surface.height - clearance_m)
    model = build_model(mesh, materials, above, drive, Settings())
    chain, first = chain_and_start(model.chain, start)
    end = first.time_s + max_flight_time_s
    state_at, time_s = fly(chain, first, surface_gap(model, chain), end)
    return None if time_s is None else state_at(time_s)
