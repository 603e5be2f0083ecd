"""Scalars of the first tap, from the history and the located events."""

from __future__ import annotations

import numpy as np

from hcm.lumped_contact import SLIP
from hcm.result import Event, Floats, History, Summary


def _peak(time: Floats, force: Floats) -> tuple[float, float]:
    """Vertex of the parabola through the largest sample and its neighbours: (time, force)."""
    i = int(np.argmax(force))
    if 0 < i < force.size - 1:
        t, f = (time[i - 1 : i + 2] - time[i]).tolist(), force[i - 1 : i + 2].tolist()
        if t[0] < 0 < t[2]:
            slope_left, slope_right = (f[1] - f[0]) / -t[0], (f[2] - f[1]) / t[2]
            second = (slope_right - slope_left) / (t[2] - t[0])
            if second < 0:
                first = slope_left - second * t[0]
                shift = -first / (2 * second)
                if t[0] <= shift <= t[2]:
                    return float(time[i] + shift), f[1] - first * first / (4 * second)
    return float(time[i]), float(force[i])


def summarize(history: History, events: tuple[Event, ...], roundoff_J: float) -> Summary:
    """Reduce a run to the scalars of its first tap.

    `roundoff_J` is what an audit can't see below: where nothing moves with more energy than that,
    the audit's error counts relative to it.
    """
    contact = next((e.time_s for e in events if e.kind == "contact"), None)
    separation = next((e.time_s for e in events if e.kind == "separation"), None)
    last = history.time_s[-1] if separation is None else separation
    kinetic = float(history.kinetic_energy_J.max(initial=0.0))
    balance = float(np.abs(history.energy_balance_J).max(initial=0.0))
    residual = balance / max(kinetic, roundoff_J)
    if contact is None:
        return Summary(
            None, None, None, None, None, None, None, None, 0, 0, 0, False, None, residual
        )
    begin = int(np.searchsorted(history.time_s, contact))
    tap = slice(begin, int(np.searchsorted(history.time_s, last, side="right")))
    time, fn = history.time_s[tap], history.normal_force_N[tap]
    ft, tangential = history.tangential_force_N[tap], history.mode[tap] % 3
    slip_velocity = history.particle_velocity_m_per_s[tap][tangential == SLIP]
    peak_time, peak = _peak(time, fn)
    reversals = [e.time_s for e in events if e.kind == "compression_to_restitution"]
    first_peak = None
    if reversals and reversals[0] <= last:
        first_peak = float(np.interp(reversals[0], time, fn))

    def count(kind: str) -> int:
        return sum(e.kind == kind and e.time_s <= last for e in events)

    velocity = history.tip_velocity_m_per_s[tap][0]
    stress = history.stress_R_Pa[tap]
    moving = slip_velocity[np.abs(slip_velocity) > 1e-9 * float(np.abs(velocity).max())]
    return Summary(
        contact_time_s=contact,
        tip_velocity_at_contact_m_per_s=(float(velocity[0]), float(velocity[1])),
        peak_normal_force_N=peak,
        peak_normal_force_time_s=peak_time - contact,
        first_peak_normal_force_N=first_peak,
        peak_tangential_force_N=float(ft[np.argmax(np.abs(ft))]),
        contact_duration_s=None if separation is None else separation - contact,
        normal_impulse_N_s=float(np.trapezoid(fn, time)),
        compression_to_restitution=count("compression_to_restitution"),
        stick_to_slip=count("stick_to_slip"),
        slip_to_stick=count("slip_to_stick"),
        reverse_slip=bool(moving.size and moving.max() > 0 > moving.min()),
        peak_stress_R_Pa=float(stress[np.argmax(np.abs(stress))]),
        energy_residual=residual,
    )
