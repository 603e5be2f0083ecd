"""A flexible pendulum in PyElastica (MIT): Cosserat rods, staggered grid, position Verlet.

Its own example, ``FlexibleSwingingPendulumCase``: a rod hinged at one end, let go from the
horizontal. Stretch, shear and rotary inertia are all in it.
"""

import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

ea: Any = importlib.import_module("elastica")
Floats = NDArray[np.float64]
# Axial waves pass at most a tenth of an element in a step, and half a radius: sections of stubby
# elements turn against the axis at the rate sqrt(4 G/rho)/r, whatever their length.
PART_OF_ELEMENT, PART_OF_RADIUS = 0.1, 0.5


class _Pendulum(ea.BaseSystemCollection, ea.Constraints, ea.Forcing):
    """What an example of PyElastica calls a simulator."""


class _Hinge(ea.ConstraintBase):
    def __init__(self, place: Floats, **keywords: Any) -> None:
        super().__init__(**keywords)
        self.place = np.array(place)

    def constrain_values(self, system: Any, time: float) -> None:
        system.position_collection[:, 0] = self.place

    def constrain_rates(self, system: Any, time: float) -> None:
        system.velocity_collection[:, 0] = 0.0


def swing(
    length: float, radius: float, density: float, young: float, poisson: float, gravity: float,
    elements: int, times: Floats,
) -> Floats:  # fmt: skip
    """Tip position (n, 2), m, at increasing times (n,), s; starts at rest along -X, gravity -Y."""
    simulator = _Pendulum()
    rod = ea.CosseratRod.straight_rod(
        elements, np.zeros(3), np.array([-1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), length,
        radius, density, youngs_modulus=young, shear_modulus=young / (2.0 * (1.0 + poisson)),
    )  # fmt: skip
    simulator.append(rod)
    simulator.constrain(rod).using(_Hinge, constrained_position_idx=(0,))
    simulator.add_forcing_to(rod).using(ea.GravityForces, acc_gravity=np.array([0, -gravity, 0.0]))
    simulator.finalize()
    stepper, now, found = ea.PositionVerlet(), 0.0, []
    way = min(PART_OF_ELEMENT * length / elements, PART_OF_RADIUS * radius)
    longest = way / (young / density) ** 0.5
    for time in times.tolist():
        steps = int(np.ceil((time - now) / longest))
        step = (time - now) / steps
        for _ in range(steps):
            now = stepper.step(simulator, now, step)
        found.append(rod.position_collection[:2, -1].copy())
    return np.array(found)
