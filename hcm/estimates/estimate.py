"""Estimate errors of the first tap's numbers from the differences of a companion run.

A force has the relative error of the speed of approach (`hcm.estimates.flight_band`),
|dF|/F = |dv_n|/v_n, and half that of the energy, |dF|/F = |dE|/2E, that the run has lost or gained.

A companion with twice the elements differs from the run by 1 - 2^-p of the run's error. For the
stress, whose order p may be as low as 1, that is half the error: its difference counts double.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from hcm.arrays import Floats
from hcm.contact.law import STICK
from hcm.estimates.companion import (
    STEP_RATIO,
    TIGHTER,
    companion_finger,
    companion_flight,
    first_tap,
    folded,
    grazes,
    lost_energy,
    rescaled_settings,
    undamped_settings,
)
from hcm.estimates.error_cautions import (
    TITLES,
    caution,
    later_taps,
    percent,
    relative_errors,
    tap_peaks,
)
from hcm.estimates.flight_band import flight_band, touch_band
from hcm.estimates.resolution import CAUTION_ERROR
from hcm.flight.fall import bending_wave_stress, magnified, omitted_time, rods_fall
from hcm.model import Scene
from hcm.parameters import GAUSS
from hcm.results.result import Errors, Summary, TapResult
from hcm.results.status import Status
from hcm.taps.summary import vertex
from hcm.workload import most_steps

# The estimate of what a rigid flight leaves out is 8 to 200 times the change (`hcm.simulate`) in
# flights without torques; a torque that balances the weight and then jumps gave 1.1 times.
LEFT_OUT_OVER = 8.0
# The peak's time is the vertex of a parabola through three rows: known to this share of a step
# (0.3 measured where 23 steps make a tap).
VERTEX_SHARE = 0.25

DECISIVE = (
    "contact_time_s",
    "tip_velocity_at_contact_m_per_s",
    "peak_normal_force_N",
    "normal_impulse_N_s",
)
"""Numbers that make a run unrepeatable if a tighter run changes them."""
USABLE_STATUSES = (Status.COMPLETED, Status.UNRESOLVED)
"""Statuses of a companion with a whole first tap; its steps may be too long for a result."""
FROM_SPEED = (
    "peak_normal_force_N",
    "peak_normal_force_time_s",
    "peak_tangential_force_N",
    "contact_duration_s",
    "normal_impulse_N_s",
)


def signed_error(own: Floats, other: Floats, factor: float = 1.0) -> float:
    """Error of the value of largest magnitude, `factor` times the difference of the extremes.

    If the extreme of the other sign may be the larger one, it is the distance between the two.
    """
    high, low = max(float(own.max()), 0.0), min(float(own.min()), 0.0)
    error = factor * max(
        abs(high - max(float(other.max()), 0.0)), abs(low - min(float(other.min()), 0.0))
    )  # fmt: skip
    large, small = max(high, -low), min(high, -low)
    return error if small + error < large - error else max(error, large + small)


def between_rows(time: Floats, values: Floats) -> float:
    """How far the largest of |values| lies below the vertex of the parabola through three rows."""
    size = np.abs(values)
    row = int(size.argmax())
    return vertex(time, size, 0, size.size, row)[1] - float(size[row])


def rival_peaks(force: Floats, time: Floats, peak: float, error: float) -> Floats:
    """Times of the maxima of F_n that may be the largest if each has this `error`."""
    inner = (force[1:-1] >= force[:-2]) & (force[1:-1] > force[2:])
    rival: Floats = time[1:-1][inner & (force[1:-1] >= peak - 2.0 * error)]
    return rival


def turn_band(own: TapResult, other: TapResult) -> float:
    """Difference, s, of the times at which two taps turn back.

    F_n is flat at its peak, where the times of two largest values may agree by chance. So: the root
    mean square difference of the tips' velocities normal to the surface, within an eighth of the
    tap from `own`'s peak, over their slope.
    """
    s, theirs = own.summary, other.summary.contact_time_s
    if s.contact_time_s is None or s.contact_duration_s is None or theirs is None:
        return 0.0
    a, b = own.history, other.history
    since = a.time_s - s.contact_time_s
    near = np.abs(since - (s.peak_normal_force_time_s or 0.0)) < s.contact_duration_s / 8
    time, velocity = since[near], a.tip_velocity_m_per_s[near, 1]
    if time.size < 2 or velocity[-1] == velocity[0]:
        return 0.0
    apart = velocity - np.interp(time, b.time_s - theirs, b.tip_velocity_m_per_s[:, 1])
    slope = (velocity[-1] - velocity[0]) / (time[-1] - time[0])
    return math.sqrt(float(np.mean(apart * apart))) / abs(float(slope))


def companion_errors(
    own: TapResult, other: TapResult, stress_factor: float = 1.0, omitted_speed_share: float = 0.0,
    omitted_stress: float = 0.0, omitted_s: float = 0.0,
) -> Errors:  # fmt: skip
    """Estimate errors from the differences of two completed runs; inf if the other has no tap.

    omitted_speed_share : share of the speed of approach that both runs leave out (a vibration about
    as long as the tap). omitted_stress : of the stress at R, Pa, and omitted_s : of the time of
    contact, s, the part that both runs leave out.
    """
    s, o, settings = own.summary, other.summary, own.given["settings"]
    velocity, theirs = s.tip_velocity_at_contact_m_per_s, o.tip_velocity_at_contact_m_per_s
    if theirs is None or velocity is None or other.status not in USABLE_STATUSES:
        return {name: (math.inf, math.inf) if "velocity" in name else math.inf for name in TITLES}
    late = _apart(s, o, "contact_time_s")
    rods = settings.flight == "rigid"
    band = touch_band(late, velocity, theirs) if rods else flight_band(own, other)
    vn = max(abs(velocity[1]), 1e-300)
    along, across = (
        max(abs(mine - its), known, omitted_speed_share * vn)
        for mine, its, known in zip(velocity, theirs, band.velocity, strict=True)
    )
    errors: Errors = {
        "contact_time_s": max(
            late, band.height / vn, omitted_speed_share * (s.contact_duration_s or 0.0), omitted_s
        ),
        "tip_velocity_at_contact_m_per_s": (along, across),
    }
    mine, its = first_tap(own), first_tap(other)
    a, b = own.history, other.history
    time = a.time_s[mine]
    share = max(band.approach / vn, 0.5 * lost_energy(own), omitted_speed_share)
    of: dict[str, float] = {
        name: max(_apart(s, o, name), share * abs(getattr(s, name))) for name in FROM_SPEED
    }
    peak, at = s.peak_normal_force_N or 0.0, s.peak_normal_force_time_s or 0.0
    # a velocity's error times an impedance is a force; where the tip sticks, the tangential
    # impedance is at most the normal one, peak/v_n
    largest = int(np.abs(a.tangential_force_N[mine]).argmax())
    sticks = bool((a.mode[mine][max(largest - 1, 0) : largest + 2] % 3 == STICK).any())
    of["peak_tangential_force_N"] = max(
        of["peak_normal_force_N"] / max(peak, 1e-300) * abs(s.peak_tangential_force_N or 0.0),
        along * peak / vn if sticks else 0.0,
        signed_error(a.tangential_force_N[mine], b.tangential_force_N[its]),
        between_rows(time, a.tangential_force_N[mine]),
    )
    of["peak_stress_R_Pa"] = max(
        band.stress,
        omitted_stress,
        signed_error(a.stress_R_Pa[mine], b.stress_R_Pa[its], stress_factor),
        between_rows(time, a.stress_R_Pa[mine]),
    )
    since = time - (s.contact_time_s or 0.0)
    rivals = rival_peaks(a.normal_force_N[mine], since, peak, of["peak_normal_force_N"])
    # with collocation the peak is the row of a located event, else a vertex between rows
    located = settings.contact_integrator == GAUSS
    of["peak_normal_force_time_s"] = max(
        of["peak_normal_force_time_s"],
        float(np.abs(rivals - at).max(initial=0.0)),
        0.0 if located else VERTEX_SHARE * float(since[-1]) / max(since.size - 1, 1),
        turn_band(own, other),
    )
    return {**errors, **of}


def _apart(own: Summary, other: Summary, name: str) -> float:
    return abs(float(getattr(own, name)) - float(getattr(other, name)))


def estimate_errors(
    own: TapResult, again: Callable[[Scene], TapResult], left_out: float = 0.0
) -> TapResult:
    """A completed run with estimated errors, for which its scene is solved again, more cheaply; or
    the run as it ends if that is interrupted, or shows that it can't be relied on.

    again : solves a scene. left_out : as in `BeamStart`; a rigid companion leaves it out too.
    """
    scene = Scene(**own.given)
    finger, settings = scene.finger, scene.settings
    half, most = companion_finger(finger), most_steps(finger)
    coarse = rescaled_settings(settings, own, STEP_RATIO, min(most, most_steps(half)))
    coarse = replace(coarse, flight_elements=companion_flight(settings, half))
    steady = undamped_settings(coarse, own)
    taps = max(tap_peaks(own).size, 1)
    # equal steps may be too long for some part of a flight, whose energy then grows
    for changed in [replace(steady, taps=taps), *([steady] if taps > 1 else []), coarse]:
        other = again(replace(scene, finger=half, settings=changed))
        if other.status in (*USABLE_STATUSES, Status.INTERRUPTED):
            break
    if other.status is Status.INTERRUPTED:
        return own.as_ended()
    few = half.phalanges[-1].elements > finger.phalanges[-1].elements
    approach = own.summary.tip_velocity_at_contact_m_per_s or (0.0, 0.0)
    bent = bending_wave_stress(left_out * abs(approach[1]), finger.phalanges[-1])
    lasts = max((own.summary.contact_time_s or 0.0) - float(own.history.time_s[0]), 0.0)
    late = omitted_time(left_out, finger, lasts)
    too_large = settings.flight == "rigid" and not scene.drive.has_torques
    omitted = left_out / (LEFT_OUT_OVER if too_large else 1.0)
    errors = companion_errors(own, other, 2.0 if few else 1.0, omitted, bent, late)
    if folded(own, finger.length) or grazes(own):
        tighter = rescaled_settings(settings, own, TIGHTER ** (1 / 3), most)
        tight = again(replace(scene, settings=tighter))
        if tight.status is Status.INTERRUPTED:
            return own.as_ended()
        changes = relative_errors(own.summary, companion_errors(own, tight))
        what = max((name for name in DECISIVE if name in changes), key=changes.__getitem__)
        if changes[what] > CAUTION_ERROR:
            doubt = f"; {TIGHTER:g} times the tolerances change the {TITLES[what]}"
            by = f" by {percent(changes[what])}" if changes[what] < math.inf else ""
            return own.as_ended(Status.UNREPEATABLE, doubt + by)
    doubts = caution(relative_errors(own.summary, errors), settings)
    doubts += later_taps(tap_peaks(own), tap_peaks(other))
    if fall := rods_fall(scene):
        doubts += magnified(scene, fall)
    return replace(own, errors=errors, cautions=(*own.cautions, *doubts))
