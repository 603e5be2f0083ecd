"""The scalars of the first tap, from the record of every step."""

from dataclasses import replace

import numpy as np

from reference_fem.arrays import Array
from reference_fem.result import ForceRecord, History, Summary
from reference_fem.transitions import confirmed_maxima, slip_states

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

    - contact time: where the lowest node's gap crosses zero, linear between two steps
    - end: the last step with F_n > 0 of the first tap (`separation_s`; the lumped law's lies
      between two steps); None while it lasts: the duration is then None and the other scalars cover
      the record so far
    - peaks: over every step; the first peak is the first turning point of F_n (`transitions`)
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
    slips = (
        slip_states(normal, tangential, friction, LEAST_NORMAL * peak) if friction > 0.0 else None
    )
    stress = stress_during(history, contact_time, float(time[-1]))
    return replace(
        blank,
        contact_time_s=contact_time,
        tip_velocity_at_contact_m_per_s=tip_velocity,
        peak_normal_force_N=peak,
        peak_normal_force_time_s=float(time[top]) - contact_time,
        first_peak_normal_force_N=float(normal[turns[0]]) if turns else None,
        peak_tangential_force_N=float(tangential[np.argmax(np.abs(tangential))]),
        contact_duration_s=None if separation_s is None else separation_s - contact_time,
        normal_impulse_N_s=float(np.trapezoid(normal, time)),
        compression_to_restitution=len(turns),
        stick_to_slip=None if slips is None else slips.stick_to_slip,
        slip_to_stick=None if slips is None else slips.slip_to_stick,
        reverse_slip=None if slips is None else slips.reverse_slip,
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
