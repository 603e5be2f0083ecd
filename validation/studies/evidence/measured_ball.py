"""A ball of aluminium oxide that was shot at glass: Kharaz, Gorham and Salman (2001), measured.

The contact's point leaves at an angle phi from the normal, tan phi = (v_t - 7/5 R w')/(e v_n), as
friction's impulse is 2/5 m R w'. Two elastic bodies amount to one of modulus E* on a rigid wall:

    1/E* = sum (1 - nu_i^2)/E_i,  1/G* = sum (2 - nu_i)(1 + nu_i)/(2 E_i),  G*/E* = 2(1-nu)/(2-nu)
"""

import math
from collections.abc import Iterator

from validation.harness.store import Store
from validation.models.adapter import Progress
from validation.studies.evidence.ball import by_reduced_model
from validation.studies.evidence.rows import EvidenceRow

BODIES = ((380e9, 0.23), (70e9, 0.25))  # E, Pa, and nu, of ball and anvil
DENSITY, SPEED, FRICTION, RESTITUTION = 4000.0, 3.9, 0.092, 0.98  # kg/m^3, m/s; both measured
# Angles of arrival and of leaving, degrees.
POINTS = (
    (9.718, -1.057), (20.310, -8.535), (30.161, -2.553), (39.120, 9.909), (49.512, 30.015),
    (59.904, 49.955), (70.460, 66.903), (78.860, 78.867), (84.782, 85.680),
)  # fmt: skip
READING = math.radians(0.9), math.radians(1.2)  # 1 % of the figure's axes
STEEP = 45.0  # degrees; below it rows give the spin, as the angle passes through zero


def by_hcm(angle: float) -> float:
    """Spin R w'/(mu v_n) of a ball that arrives at `angle`, rad.

    A restitution e leaves the share (1 + e)/2 of it, as of the normal impulse.
    """
    modulus = 1.0 / sum((1.0 - nu**2) / young for young, nu in BODIES)
    ratio = 2.0 / sum((2.0 - nu) * (1.0 + nu) / young for young, nu in BODIES) / modulus
    poisson = 2.0 * (1.0 - ratio) / (2.0 - ratio)
    wave = math.sqrt(modulus * (1.0 - poisson**2) / DENSITY)  # of E = E* (1 - nu^2)
    speed, x = SPEED * math.cos(angle) / wave, math.tan(angle) / FRICTION
    return by_reduced_model(speed, x, poisson).spin * (1.0 + RESTITUTION) / 2.0


def spin_of(angle: float, leaving: float) -> float:
    """Spin of a ball that arrives and leaves at these angles, rad."""
    return (math.tan(angle) - RESTITUTION * math.tan(leaving)) / (1.4 * FRICTION)


def leaving_of(angle: float, y: float) -> float:
    """Angle phi at which a ball with spin `y` leaves, degrees."""
    return math.degrees(math.atan((math.tan(angle) - 1.4 * FRICTION * y) / RESTITUTION))


def rows(progress: Progress, _: Store) -> Iterator[EvidenceRow]:
    """The spin below `STEEP`, the angle above; misreading the arrival's angle moves both sides."""
    off, error = READING
    for number, (degrees, stated) in enumerate(POINTS):
        progress(number / len(POINTS), f"measured ball at {degrees:.1f} degrees")
        angle, leaving = math.radians(degrees), math.radians(stated)
        y, beside = by_hcm(angle), by_hcm(angle + off)
        shock = (1.0 - RESTITUTION) / 2.0 * y
        if degrees < STEEP:
            outside, name, unit = spin_of(angle, leaving), "R w'/(mu v_n)", "1"
            moved = spin_of(angle + off, leaving) - outside - (beside - y)
            read, ours, known = spin_of(angle, leaving + error) - outside, y, shock
        else:
            outside, name, unit = stated, "angle of leaving", "deg"
            ours = leaving_of(angle, y)
            moved, read = leaving_of(angle + off, beside) - ours, math.degrees(error)
            known = abs(leaving_of(angle, y + shock) - ours)
        name += f", arriving at {degrees:.1f} degrees"
        yield EvidenceRow(name, unit, "hcm", outside, math.hypot(moved, read), ours, known)
