"""The scalars of the first tap and its transitions, from the record of every step."""

from dataclasses import replace
from typing import Any

import numpy as np

from reference_fem.arrays import Array
from reference_fem.results.result import ForceRecord, History, Summary

# Shares of the peak normal force: a turn of F_n counts if it goes this far, ...
PROMINENCE = 0.05
# ... and stick and slip are judged above this.
LEAST_NORMAL = 0.02


def summarize(
    forces: ForceRecord,
    history: History,
    friction: float,
    tip_velocity: tuple[float, float] | None,
    separation_s: float | None,
    blank: Summary,
) -> Summary:
    """Scalars of the first tap, added to those of the run in `blank`.

    - contact time: where the lowest node's gap crosses zero, linear between two steps (an impulse
      acts up to a step earlier; a peak then is no earlier than the touch)
    - end: the last step with F_n > 0 of the first tap (`separation_s`; the lumped law's lies
      between two steps); None while it lasts: the duration is then None and the other scalars cover
      the record so far
    - peaks: over every step; the first peak is the first turning point of F_n (`confirmed_maxima`)
    - impulse: ∫ F_n dt, trapezoid over every step
    - stress at R: the reading of largest magnitude during the tap, signed (`stress_during`)

    friction : μ; stick and slip mean nothing at 0 and are then None.
    tip_velocity : of the pole at the first touch. separation_s : of the first tap's end, absolute.
    """
    touched = np.flatnonzero(forces.normal_force_N > 0.0)
    if not touched.size:
        return blank
    first = int(touched[0])
    contact_time = _crossing(forces, first)
    end = forces.time_s.size - 1
    if separation_s is not None:
        end = int(np.searchsorted(forces.time_s, separation_s * (1.0 + 1e-14), "right"))
        end = min(end, forces.time_s.size - 1)
    tap = slice(max(first - 1, 0), end + 1)
    time, normal = forces.time_s[tap], forces.normal_force_N[tap]
    tangential = forces.tangential_force_N[tap]
    top = int(np.argmax(normal))
    peak = float(normal[top])
    turns = confirmed_maxima(normal, PROMINENCE * peak)
    slips: dict[str, Any] = {}
    if friction > 0.0:
        slips = slip_states(normal, tangential, friction, LEAST_NORMAL * peak)
    stress = stress_during(history, contact_time, float(time[-1]))
    return replace(
        blank,
        contact_time_s=contact_time,
        tip_velocity_at_contact_m_per_s=tip_velocity,
        peak_normal_force_N=peak,
        peak_normal_force_time_s=max(float(time[top]) - contact_time, 0.0),
        first_peak_normal_force_N=float(normal[turns[0]]) if turns else None,
        peak_tangential_force_N=float(tangential[np.argmax(np.abs(tangential))]),
        contact_duration_s=None if separation_s is None else separation_s - contact_time,
        normal_impulse_N_s=float(np.trapezoid(normal, time)),
        compression_to_restitution=len(turns),
        **slips,
        peak_stress_R_Pa=float(stress[np.argmax(np.abs(stress))]) if stress.size else None,
    )


def stress_during(history: History, start: float, end: float) -> Array:
    """Readings at R from `start` to `end`, s, linearly interpolated at these two times.

    A finger may bend most as its tip leaves: in a tap of 30 samples up to a quarter more than at
    the last one. If the run ends before the next sample, a parabola through the last three
    extrapolates, by up to one sample.
    """
    time, stress = history.time_s, history.stress_R_Pa
    if not time.size:
        return stress
    ends = np.interp((start, end), time, stress)
    if end > time[-1] and time.size > 2:
        at = min(end, 2.0 * time[-1] - time[-2]) - time[-1]
        ends[1] = np.polyval(np.polyfit(time[-3:] - time[-1], stress[-3:], 2), at)
    return np.concatenate([ends[:1], stress[(time >= start) & (time <= end)], ends[1:]])


def _crossing(forces: ForceRecord, first: int) -> float:
    """Time of zero gap between step first - 1 and step first."""
    if first == 0:
        return float(forces.time_s[0])
    before, after = forces.lowest_gap_m[first - 1], forces.lowest_gap_m[first]
    share = before / (before - after)
    return float(
        forces.time_s[first - 1] + share * (forces.time_s[first] - forces.time_s[first - 1])
    )


def confirmed_maxima(force: Array, prominence: float) -> list[int]:
    """Indices of the maxima of F that differ from the minima beside them by at least `prominence`.

    dF_n/dt = -Σ k_i v_ni over the touching nodes (nodes come and go with zero force), so a
    maximum of F_n is where the contact area's stiffness-weighted mean normal velocity changes
    from compression to restitution. High-frequency ringing of single nodes would add countless
    turning points; a turn counts once the curve has gone `prominence` beyond it.

    force : (n,), F_n, N. prominence : N, greater than 0.
    """
    maxima: list[int] = []
    rising, place = True, 0
    for i, value in enumerate(force):
        ahead = value > force[place] if rising else value < force[place]
        if ahead:
            place = i
        elif abs(value - force[place]) >= prominence:
            if rising:
                maxima.append(place)
            rising, place = not rising, i
    return maxima


def slip_states(
    normal: Array, tangential: Array, friction: float, least_normal: float
) -> dict[str, Any]:
    """Stick and slip of the resultant, by its cone ratio q = |F_t| / (μ F_n): counts of transitions
    and whether it slipped both ways, by the summary's fields.

    The contact slips as a whole where q >= 0.98 and sticks at least in part where q < 0.95;
    in between the previous state holds (at q = 1 exactly every node slips, and in one direction;
    lateral bulging keeps q a little lower). Samples with F_n below `least_normal` are left out.
    Reverse slip: slipping occurs with both signs of F_t.

    normal, tangential : (n,), F_n and F_t, N. friction : μ, greater than 0. least_normal : N.
    """
    counted = normal >= least_normal
    f_t = tangential[counted]
    ratio = np.abs(f_t) / (friction * normal[counted])
    change = np.where(ratio >= 0.98, 1, np.where(ratio < 0.95, -1, 0))
    decided = np.flatnonzero(change)
    states = change[decided]
    turns = np.diff(states)
    signs = np.sign(f_t[ratio >= 0.98])
    return {
        "stick_to_slip": int(np.count_nonzero(turns > 0)),
        "slip_to_stick": int(np.count_nonzero(turns < 0)),
        "reverse_slip": bool((signs > 0).any() and (signs < 0).any()),
    }
