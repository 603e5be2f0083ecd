"""One impact state for both models: the rigid chain of thin rods, touching with its tip node.

It is the reduced model's fall without its vibrations (they change its peak force by less than
0.01 %). The solid starts from the same angles and rates; as the lowest point of a hemispherical end
lies below the tip node, its surface is lowered to where that state touches.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from validation.errors import RunFailedError
from validation.models.hcm import hcm_scene
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
    from hcm.assumptions import PAPER
    from hcm.flight.fall import rods_fall
    from reference_fem.flight.touch import touch_angle

    given = replace(hcm_scene(scene, estimate=False), assumptions=PAPER)
    fall = rods_fall(given)
    if fall is None:
        raise RunFailedError(
            f"scene {scene.name}: the tip does not reach the surface within"
            f" {given.settings.max_flight_time:g} s; lower surface.height or drive it harder"
        )
    angles, rates = fall.flight.states[-1].reshape(2, -1)
    change, lead = fall.flight.accelerations[-1], min(LEAD_S, LEAD_SHARE * fall.time)
    angles, rates = angles - lead * rates + 0.5 * lead**2 * change, rates - lead * change
    lengths = np.array([phalanx.length for phalanx in given.finger.phalanges])
    radius, last = 0.5 * given.finger.phalanges[-1].diameter, float(angles[-1])
    lowest = float(lengths @ np.sin(angles)) + radius * (1.0 - math.sin(last))
    return Impact(
        angles=tuple(angles.tolist()),
        rates=tuple(rates.tolist()),
        time_s=float(fall.flight.time[-1]) - lead,
        sphere_height_m=lowest + CLEARANCE * radius,
        touch_angle=touch_angle(last),
    )


def chain_state(impact: Impact) -> reference_fem.ChainState:
    """The state in the form that the reference takes."""
    import reference_fem

    return reference_fem.ChainState(np.array(impact.angles), np.array(impact.rates), impact.time_s)
