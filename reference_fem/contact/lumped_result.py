"""What a tap with the lumped contact law returns, for the full body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reference_fem.status import Status

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LumpedHistory:
    """Every step of the run, arrays of length n; t is absolute time.

    Attributes
    ----------
    time_s, normal_force_N, tangential_force_N : (n,)
    tip_position_m, tip_velocity_m_per_s : (n, 2)
        Of the point C; the velocity is that of the half step before.
    contact_energy_J : (n,)
        What both elements of the law could give back.
    friction_dissipation_J, restitution_dissipation_J : (n,)
    """

    time_s: Array
    normal_force_N: Array
    tangential_force_N: Array
    tip_position_m: Array
    tip_velocity_m_per_s: Array
    contact_energy_J: Array
    friction_dissipation_J: Array
    restitution_dissipation_J: Array


@dataclass(frozen=True)
class LumpedAudit:
    """Energies at the audited steps, arrays of length a; the body's own from its elements.

    balance = kinetic + strain + gravity + contact + losses - drive work, less its first value.
    """

    time_s: Array
    kinetic_energy_J: Array
    strain_energy_J: Array
    gravity_energy_J: Array
    drive_work_J: Array
    stress_R_Pa: Array
    energy_balance_J: Array


@dataclass(frozen=True)
class LumpedSummary:
    """Scalars of the tap, named and defined as in `result.Summary`; None without contact."""

    contact_time_s: float | None
    tip_velocity_at_contact_m_per_s: tuple[float, float] | None
    peak_normal_force_N: float | None
    peak_normal_force_time_s: float | None
    peak_tangential_force_N: float | None
    contact_duration_s: float | None
    normal_impulse_N_s: float | None
    peak_stress_R_Pa: float | None
    energy_residual: float
    wall_time_s: float
    steps: int
    elements: int
    time_step_s: float


@dataclass(frozen=True)
class LumpedTapResult:
    """A run's outcome; after a failure it holds what was computed before it."""

    status: Status
    message: str
    history: LumpedHistory
    audit: LumpedAudit
    summary: LumpedSummary


def summarize_lumped(
    history: LumpedHistory, audit: LumpedAudit, finished: bool, **cost: float | int
) -> LumpedSummary:
    """Scalars of the tap.

    The contact time is where the gap is zero: F_n = k g from the first two steps in contact, back
    along their line. Separation is where F_n of the last two steps meets zero.

    Parameters
    ----------
    finished
        Whether the contact ended.
    cost
        wall_time_s, steps, elements and time_step_s.
    """
    kinetic = float(audit.kinetic_energy_J.max(initial=0.0))
    balance = float(np.abs(audit.energy_balance_J).max(initial=0.0))
    residual = balance / kinetic if kinetic > 0.0 else balance
    touched = np.flatnonzero(history.normal_force_N > 0.0)
    if touched.size < 3:
        return LumpedSummary(*(None,) * 8, residual, **cost)  # type: ignore[arg-type]
    first, last = int(touched[0]), int(touched[-1])
    time, normal = history.time_s, history.normal_force_N
    contact = _zero(time[first : first + 2], normal[first : first + 2])
    end = _zero(time[last - 1 : last + 1], normal[last - 1 : last + 1])
    tap = slice(first, last + 1)
    top = first + int(np.argmax(normal[tap]))
    tangential = history.tangential_force_N[tap]
    stress = audit.stress_R_Pa[(audit.time_s >= contact) & (audit.time_s <= end)]
    vx, vy = history.tip_velocity_m_per_s[max(first - 1, 0)]
    # Both ends of the tap close the trapezoid's area with their triangles.
    impulse = (
        np.trapezoid(normal[tap], time[tap])
        + 0.5 * normal[first] * (time[first] - contact)
        + 0.5 * normal[last] * (end - time[last])
    )
    return LumpedSummary(
        contact_time_s=contact,
        tip_velocity_at_contact_m_per_s=(float(vx), float(vy)),
        peak_normal_force_N=float(normal[top]),
        peak_normal_force_time_s=float(time[top]) - contact,
        peak_tangential_force_N=float(tangential[np.argmax(np.abs(tangential))]),
        contact_duration_s=end - contact if finished else None,
        normal_impulse_N_s=float(impulse),
        peak_stress_R_Pa=float(stress[np.argmax(np.abs(stress))]) if stress.size else None,
        energy_residual=residual,
        **cost,  # type: ignore[arg-type]
    )


def _zero(time: Array, force: Array) -> float:
    """Where the line through two samples is zero; the nearer sample's time if it has no slope."""
    rise = force[1] - force[0]
    if rise == 0.0:
        return float(time[0])
    return float(time[0] - force[0] * (time[1] - time[0]) / rise)
