"""How far apart two flights end: the error that the touch, and so the tap, may have.

The two (`hcm.estimates.companion`: one keeps the vibration that the other damps) differ by d. It is
taken as twice the root mean square over the last `FLIGHT_SHARE` of the flight, as at the touch
itself the vibration may be near a zero. The force is changed by what lasts for a good part of the
contact, the mean of d(v_n) over half its duration.
"""

import math
from dataclasses import dataclass

import numpy as np

from hcm.arrays import Floats
from hcm.compiled import entry_with
from hcm.estimates.companion import first_contact
from hcm.results.record import hermite
from hcm.results.result import History, TapResult

FLIGHT_SHARE, SAMPLES = 0.1, 400


@entry_with()
def fill_tip_motion(
    t: Floats, x: Floats, v: Floats, time: Floats, at: Floats, rate: Floats
) -> None:
    """`tip_motion` of a history's times t (n,), positions x and velocities v (n, 2)."""
    i = max(np.searchsorted(t, time[0], side="right") - 1, 0)
    for k in range(time.size):
        while i < t.size - 2 and t[i + 1] <= time[k]:
            i += 1
        h = t[i + 1] - t[i]
        if h <= 0.0:
            h = 1.0  # of a double row, at whose time s = 0
        s = (time[k] - t[i]) / h
        for c in range(2):
            moved = x[i + 1, c] - x[i, c]
            at[k, c] = hermite(s, h, x[i, c], v[i, c], x[i + 1, c], v[i + 1, c])
            before, after = (1.0 - s) * (1.0 - 3.0 * s) * v[i, c], s * (3.0 * s - 2.0) * v[i + 1, c]
            rate[k, c] = 6.0 * s * (1.0 - s) * moved / h + before + after


def tip_motion(history: History, time: Floats) -> tuple[Floats, Floats]:
    """Positions (m) and velocities (m/s) of the tip at ascending `time` (T,), each (T, 2): a cubic
    in each step through its positions and velocities, and its derivative.
    """
    at, rate = np.empty((2, time.size, 2))
    path = history.time_s, history.tip_position_m, history.tip_velocity_m_per_s
    fill_tip_motion(*path, time, at, rate)
    return at, rate


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

    (x, v), (other_x, other_v) = tip_motion(a, time), tip_motion(b, time)
    velocity = band(v[:, 0] - other_v[:, 0]), band(v[:, 1] - other_v[:, 1])
    height = x[:, 1] - other_x[:, 1]
    approach = velocity[1]
    if lag > 0.0:
        earlier = time[time <= end - lag]
        later, other_later = tip_motion(a, earlier + lag)[0], tip_motion(b, earlier + lag)[0]
        approach = band(later[:, 1] - other_later[:, 1] - height[: earlier.size]) / lag
    stress = np.interp(time, a.time_s, a.stress_R_Pa) - np.interp(time, b.time_s, b.stress_R_Pa)
    return FlightBand(band(height), velocity, approach, band(stress))
