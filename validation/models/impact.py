"""One impact state for both models: the rigid chain of thin rods, touching with its tip node.

It is the reduced model's fall without its vibrations (they change its peak force by less than
0.01 %). The solid starts from the same angles and rates; as the lowest point of a hemispherical end
lies below the tip node, its surface is lowered to where that state touches.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from validation.errors import RunFailedError
from validation.models.adapter import drive_of
from validation.models.solid_inputs import solver_settings, start_of
from validation.scenes.load import NamedScene

if TYPE_CHECKING:
    import reference_fem

LEAD_S = 1e-6  # before the touch: both models start just above the surface
LEAD_SHARE = 1e-4  # largest share of the fall that this may be
CLEARANCE = 2e-4  # over tip radius: meshes put a sphere's lowest node up to h^2/8R too high


@dataclass(frozen=True)
class Impact:
    """Rigid state right before the tip node touches.

    angles, rates : absolute, from -X, counter-clockwise, rad and rad/s, one per phalanx.
    time_s : of this state.
    sphere_height_m : depth of the plane that a hemispherical end touches in this state.
    touch_angle : between the last phalanx's axis and the direction to the surface, rad; negative
        towards its upper side.
    """

    angles: tuple[float, ...]
    rates: tuple[float, ...]
    time_s: float
    sphere_height_m: float
    touch_angle: float


def impact_of(scene: NamedScene) -> Impact:
    """Let the thin rods fall from the scene's start until their end touches.

    Raises RunFailedError: the surface is not reached.
    """
    import reference_fem
    from reference_fem.rigid_chain import build_chain
    from reference_fem.rigid_flight import fly
    from reference_fem.touch import touch_angle

    tables = scene.tables
    count, drive = tables.finger.phalanges, drive_of(tables, reference_fem)
    lengths = np.array(tables.per_phalanx(tables.finger.length))
    diameters = np.array(tables.per_phalanx(tables.finger.diameter))
    mass = np.array(tables.per_phalanx(tables.material.density)) * 0.25 * np.pi * diameters**2
    mass *= lengths
    ends = -np.concatenate([[0.0], np.cumsum(lengths)])
    # Two Gauss points per rod: mass, centre and moment of inertia m L^2/12 exactly.
    offsets = 0.5 * lengths[:, None] * np.array([-1.0, 1.0]) / np.sqrt(3.0)
    x = (0.5 * (ends[:-1] + ends[1:])[:, None] + offsets).ravel()
    chain = build_chain(
        np.stack([x, np.zeros_like(x)], axis=1),
        np.repeat(0.5 * mass, 2),
        [np.array([2 * w, 2 * w + 1]) for w in range(count)],
        np.stack([ends[:-1], np.zeros(count)], axis=1),
        drive.loads_for(count),
        drive.gravity_vector,
    )
    height = tables.surface.height
    first = start_of(tables) or reference_fem.ChainState(np.zeros(count), np.zeros(count), 0.0)

    def gap(angles: Any) -> float:
        return height - float(lengths @ np.sin(angles))

    patience = solver_settings(tables).max_flight_time_s
    state_at, touch = fly(chain, first, gap, patience)
    if touch is None:
        raise RunFailedError(
            f"scene {scene.name}: the tip does not reach the surface within {patience:g} s; "
            "lower surface.height or drive it harder"
        )
    state = state_at(touch - min(LEAD_S, LEAD_SHARE * (touch - first.time_s)))
    radius = 0.5 * float(diameters[-1])
    last = float(state.angles[-1])
    lowest = float(lengths @ np.sin(state.angles)) + radius * (1.0 - np.sin(last))
    return Impact(
        angles=tuple(map(float, state.angles)),
        rates=tuple(map(float, state.rates)),
        time_s=state.time_s,
        sphere_height_m=float(lowest + CLEARANCE * radius),
        touch_angle=touch_angle(last),
    )


def chain_state(impact: Impact) -> reference_fem.ChainState:
    """The state in the form that the reference takes."""
    import reference_fem

    return reference_fem.ChainState(np.array(impact.angles), np.array(impact.rates), impact.time_s)
