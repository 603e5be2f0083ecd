"""Scalars of the first tap, from the history and the located events."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hcm.arrays import Floats
from hcm.compiled import entry_with
from hcm.contact.law import SLIP
from hcm.integrators.gauss_tableau import tableau
from hcm.results.force_curve import next_contact_step
from hcm.results.result import Event, History, Summary


@entry_with()
def extremes(
    time: Floats, fn: Floats, ft: Floats, stress: Floats, particle: Floats, mode: NDArray[np.int8],
    contact: float, last: float,
) -> tuple[int, int, int, int, int, float, float, float]:  # fmt: skip
    """Rows [first, end) of contact <= t <= last, those of the largest F_n, |F_t| and |stress| in
    them, int F_n dt (trapezoidal, N s), and the particle's lowest and highest velocity (m/s) while
    it slips.
    """
    first, end = int(np.searchsorted(time, contact)), int(np.searchsorted(time, last, side="right"))
    largest_fn, largest_ft, largest_stress = first, first, first
    impulse, lowest, highest = 0.0, 0.0, 0.0
    for i in range(first, end):
        if fn[i] > fn[largest_fn]:
            largest_fn = i
        if abs(ft[i]) > abs(ft[largest_ft]):
            largest_ft = i
        if abs(stress[i]) > abs(stress[largest_stress]):
            largest_stress = i
        if mode[i] % 3 == SLIP:
            lowest, highest = min(lowest, particle[i]), max(highest, particle[i])
        if i > first:
            impulse += 0.5 * (fn[i] + fn[i - 1]) * (time[i] - time[i - 1])
    return first, end, largest_fn, largest_ft, largest_stress, impulse, lowest, highest


@entry_with()
def stage_impulse(
    time: Floats, force: Floats, mode: NDArray[np.int8], weights: Floats, first: int, end: int
) -> float:
    """Int F_n dt over the rows [first, end), N s, by the quadrature of steps whose stages have rows
    between those of their ends.
    """
    total, rows = 0.0, weights.size + 1
    i = next_contact_step(first, time, mode, rows, end)
    while i < end:
        for j in range(weights.size):
            total += (time[i + rows] - time[i]) * weights[j] * force[i + 1 + j]
        i = next_contact_step(i + rows, time, mode, rows, end)
    return total


def vertex(time: Floats, force: Floats, first: int, end: int, i: int) -> tuple[float, float]:
    """Vertex of the parabola through row i of [first, end), the largest, and its neighbours."""
    if first < i < end - 1:
        before, at, after = time[i - 1 : i + 2].tolist()
        f_before, f, f_after = force[i - 1 : i + 2].tolist()
        left, right = before - at, after - at
        if left < 0.0 < right:
            slope_left, slope_right = (f - f_before) / -left, (f_after - f) / right
            second = (slope_right - slope_left) / (right - left)
            if second < 0.0:
                linear = slope_left - second * left
                shift = -linear / (2.0 * second)
                if left <= shift <= right:
                    return at + shift, f - linear * linear / (4.0 * second)
    return float(time[i]), float(force[i])


def summarize(
    history: History,
    events: tuple[Event, ...],
    taps: Sequence[tuple[float, float]],
    energy_residual: float,
    stages: int = 0,
    restitution: float = 1.0,
) -> Summary:
    """Reduce a run to the scalars of its first tap, and the run's energy residual.

    taps : first touch and last separation of each (`tap.taps_of`). stages : in each step in
    contact, with a row each; the largest F_n is then most often at v_n = 0, a located event.
    restitution : e*; below 1 F_n has a kink there, or jumps down (`tip_damping`), and the parabola
    of the largest row may not reach as far.
    """
    if not taps:
        return Summary(
            None, None, None, None, None, None, None, None, 0, 0, 0, False, None, energy_residual
        )
    contact, separation = taps[0]
    time, fn, ft = history.time_s, history.normal_force_N, history.tangential_force_N
    last = min(separation, float(time[-1]))
    stress = history.stress_R_Pa
    first, end, largest_fn, largest_ft, largest_stress, impulse, lowest, highest = extremes(
        time, fn, ft, stress, history.particle_velocity_m_per_s, history.mode, contact, last
    )
    # of a tip that relaxes F_n is largest before v_n = 0
    turns = [e.time_s for e in events if e.kind == "compression_to_restitution"]
    following = min(largest_fn + 1, end - 1) if restitution < 1.0 else largest_fn
    turning = any(time[largest_fn] <= turn <= time[following] for turn in turns)
    if (stages or restitution < 1.0) and turning:
        peak_time, peak = float(time[largest_fn]), float(fn[largest_fn])
    else:
        peak_time, peak = vertex(time, fn, first, end, largest_fn)
    if stages:
        impulse = stage_impulse(time, fn, history.mode, tableau(stages).b, first, end)
    of_tap = [e for e in events if e.time_s <= last]
    kinds = [e.kind for e in of_tap]
    first_peak = None
    if "compression_to_restitution" in kinds:
        turn = of_tap[kinds.index("compression_to_restitution")].time_s
        # every event ends a step: it has a row of its own, after a jump
        first_peak = float(fn[first : int(time.searchsorted(turn)) + 1].max())
    vx, vy = history.tip_velocity_m_per_s[first].tolist()
    slow = 1e-9 * max(abs(vx), abs(vy))
    return Summary(
        contact_time_s=contact,
        tip_velocity_at_contact_m_per_s=(vx, vy),
        peak_normal_force_N=peak,
        peak_normal_force_time_s=peak_time - contact,
        first_peak_normal_force_N=first_peak,
        peak_tangential_force_N=float(ft[largest_ft]),
        contact_duration_s=None if separation == math.inf else separation - contact,
        normal_impulse_N_s=impulse,
        compression_to_restitution=kinds.count("compression_to_restitution"),
        stick_to_slip=kinds.count("stick_to_slip"),
        slip_to_stick=kinds.count("slip_to_stick"),
        reverse_slip=lowest < -slow and highest > slow,
        peak_stress_R_Pa=float(stress[largest_stress]),
        energy_residual=energy_residual,
    )
