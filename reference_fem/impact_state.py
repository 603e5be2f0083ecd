"""The rigid state just before the touch: where studies of meshes start from, and look."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import meshes
from reference_fem.model import build_model
from reference_fem.rigid_chain import ChainState, chain_and_start, fly
from reference_fem.settings import Drive, Material, Settings, Surface
from reference_fem.simulate import surface_gap


def impact_state(
    mesh: meshes.FingerMesh,
    materials: Sequence[Material],
    surface: Surface,
    drive: Drive,
    clearance_m: float,
    max_flight_time_s: float = 2.0,
) -> ChainState | None:
    """State of the rigid flight from rest with `clearance_m` left below the lowest node.

    Runs on several meshes that start from it hit with the same angles and rates: the clearance
    must exceed what their lowest nodes differ by, h²/8R for edges h on a radius R.

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
    chain, rest = chain_and_start(model.chain, None)
    state_at, time_s = fly(chain, rest, surface_gap(model, chain), max_flight_time_s)
    return None if time_s is None else state_at(time_s)


def touch_angle(state: ChainState) -> float:
    """Angle between the last phalanx's axis and the direction to the surface, rad, 0 to π/2.

    A phalanx that lies θ below the horizontal touches a ball's π/2 - θ off its axis.
    """
    return min(max(0.5 * math.pi - float(state.angles[-1]), 0.0), 0.5 * math.pi)
