"""How far apart two flights end: the error that the touch, and so the tap, may have.

The two (`hcm.companion`: one keeps the vibration that the other damps) differ by d. It is taken as
twice the root mean square over the last `FLIGHT_SHARE` of the flight, as at the touch itself the
vibration may be near a zero. The force is changed by what lasts for a good part of the contact, the
mean of d(v_n) over half its duration.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hcm.arrays import Floats
from hcm.companion import first_contact
from hcm.result import History, TapResult

FLIGHT_SHARE, SAMPLES = 0.1, 400


def positions(history: History, time: Floats) -> Floats:
    """Height of the tip (m) at `time`, a cubic in each step through its heights and velocities."""
    t, y, v = history.time_s, history.tip_position_m[:, 1], history.tip_velocity_m_per_s[:, 1]
    i = np.clip(t.searchsorted(time, side="right") - 1, 0, t.size - 2)
    h = t[i + 1] - t[i]
    s = (time - t[i]) / np.where(h > 0.0, h, 1.0)
    p = s * s * (3.0 - 2.0 * s)
    return (1 - p) * y[i] + p * y[i + 1] + h * s * (1 - s) * ((1 - s) * v[i] - s * v[i + 1])


@dataclass(frozen=True)
class FlightBand:
    """Twice the root mean square difference of two flights towards their ends.

    height : m. velocity : m/s, of each component. approach : m/s, the part that lasts half the
    contact. stress : Pa.
    """

    height: float
    velocity: tuple[float, float]
    approach: float
    stress: float


def touch_band(late: float, own: tuple[float, float], other: tuple[float, float]) -> FlightBand:
    """Compare two flights as rods at their ends alone: they have no vibration of arbitrary phase.

    late : between the touches, s. own, other : the tip's velocities there, m/s.
    """
    along, across = abs(own[0] - other[0]), abs(own[1] - other[1])
    return FlightBand(late * abs(own[1]), (along, across), across, 0.0)


def flight_band(own: TapResult, other: TapResult) -> FlightBand:
    """Compare two flights in the last `FLIGHT_SHARE` of the shorter."""
    a, b = own.history, other.history
    begin = float(a.time_s[0])
    end = float(min(a.time_s[first_contact(own)], b.time_s[first_contact(other)]))
    lag = min(0.5 * (own.summary.contact_duration_s or 0.0), 0.5 * (end - begin))
    span = min(max(FLIGHT_SHARE * (end - begin), 4.0 * lag), end - begin)
    time = np.linspace(end - span, end, SAMPLES)

    def band(difference: Floats) -> float:
        return 2.0 * math.sqrt(float(np.mean(difference * difference)))

    def apart(column: Callable[[History], Floats]) -> float:
        return band(np.interp(time, a.time_s, column(a)) - np.interp(time, b.time_s, column(b)))

    velocity = (
        apart(lambda h: h.tip_velocity_m_per_s[:, 0]),
        apart(lambda h: h.tip_velocity_m_per_s[:, 1]),
    )
    height = positions(a, time) - positions(b, time)
    approach = velocity[1]
    if lag > 0.0:
        earlier = time[time <= end - lag]
        approach = band(
            positions(a, earlier + lag) - positions(b, earlier + lag) - height[: earlier.size]
        ) / lag  # fmt: skip
    return FlightBand(band(height), velocity, approach, apart(lambda h: h.stress_R_Pa))
