"""The companion: a cheaper repetition of a run, whose differences from it bound the run's errors.

The *companion* takes STEP_RATIO times longer steps and half the elements (twice as many where a
phalanx has few). With time errors ~ h^2 and element errors ~ l^p, p >= 2, its errors are at least
four times those of the run, so that

    |companion - run| >= 3 |run - exact|:

Roache's grid convergence index of two grids, with its safety factor 3 (J. Fluids Eng. 116, 1994).

Generalized-alpha damps vibrations that its steps do not resolve, and two damped runs would agree
without them. So the companion takes equal steps with xi = 1, the trapezoidal rule, which keeps a
vibration's energy at any step though not its phase.

A chain that folds up multiplies every error by e^(Lambda t), those of its own steps included. A tap
*grazes* if it ends, or nearly ended before it went on, with a tip that hardly moves away. In either
case two runs may agree by chance: the scene is solved once more with tolerances `TIGHTER` as large.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from hcm.parameters import GAUSS, Finger, Settings
from hcm.results.result import TapResult

STEP_RATIO = 3.0
# Fewest elements of a phalanx that are halved: half of fewer would be too coarse to compare with.
LEAST_HALVED = 10
TIGHTER = 0.1
# A tip that came closer to the fixed hinge than this share of the finger's length has folded up.
FOLDED = 0.5
# Below this a tap grazes: F_n over its peak as the tip turned back, or leaving over approach speed.
GRAZE = 0.01


def repetition_settings(settings: Settings, own: TapResult, **changes: Any) -> Settings:
    """Settings to repeat a run: one tap, without an estimate of its own errors; and these changes.

    A flight may last twice as long as the run did, as an end time may have lifted its limit.
    """
    longest = max(settings.max_flight_time, 2.0 * float(own.history.time_s[-1]))
    repeated = {"taps": 1, "end_time": None, "frame_times": (), "estimate": False}
    return replace(settings, **({"max_flight_time": longest} | repeated | changes))


def rescaled_settings(settings: Settings, own: TapResult, factor: float, most: int) -> Settings:
    """Settings of a repetition in steps `factor` times as long.

    A step's local error is of order 3 in its length. Shorter steps may be four times as many, but
    not more than `most`, so that a completed run is never refused for its repetition.
    """
    more = max(settings.max_steps, 4 * settings.max_steps if factor < 1.0 else 0)
    return repetition_settings(
        settings,
        own,
        flight_step=min(settings.flight_step * factor, 1.0),
        contact_step=min(settings.contact_step * factor, 1.0),
        flight_tolerance=min(settings.flight_tolerance * factor**3, 1.0),
        contact_tolerance=min(settings.contact_tolerance * factor**3, 1.0),
        max_steps=min(more, most),
    )


def companion_finger(finger: Finger) -> Finger:
    """Half the elements of each phalanx, or twice where it has few."""
    phalanges = [
        replace(p, elements=p.elements // 2 if p.elements >= LEAST_HALVED else 2 * p.elements)
        for p in finger.phalanges
    ]
    return Finger(tuple(phalanges))


def companion_flight(settings: Settings, half: Finger) -> int:
    """`flight_elements` of the companion `half`: twice the run's, or half where it has no more; 0
    stays 0.
    """
    few, most = settings.flight_elements, max(p.elements for p in half.phalanges)
    return 2 * few if 2 * few <= most else max(few // 2, 1)


def undamped_settings(settings: Settings, own: TapResult) -> Settings:
    """The companion's `settings` with xi = 1 and equal steps, STEP_RATIO times the run's mean ones.

    Steps that followed each swing of an undamped vibration would cost more than the run.
    """
    time, contact = own.history.time_s, first_contact(own)
    if settings.flight == "elastic" and settings.flight_integrator != GAUSS:
        step = STEP_RATIO * float(time[contact] - time[0]) / max(contact, 1)
        settings = replace(settings, flight_step=_allowed(step), flight_tolerance=0.0)
    if settings.contact_integrator == GAUSS:  # undamped already, and its rows are not steps
        return settings
    rows = first_tap(own)
    step = STEP_RATIO * float(time[rows.stop - 1] - time[contact]) / max(rows.stop - contact - 1, 1)
    return replace(
        settings, contact_step=_allowed(step), contact_tolerance=0.0, spectral_radius=1.0
    )


def _allowed(step: float) -> float:
    return min(max(step, 1e-300), 1.0)


def first_contact(result: TapResult) -> int:
    """Row of the history at which the tip first touches."""
    contact = result.summary.contact_time_s
    assert contact is not None
    return int(result.history.time_s.searchsorted(contact))


def first_tap(result: TapResult) -> slice:
    """Rows of the history of a first tap that ends."""
    s = result.summary
    assert s.contact_time_s is not None
    assert s.contact_duration_s is not None
    end = result.history.time_s.searchsorted(s.contact_time_s + s.contact_duration_s, side="right")
    return slice(first_contact(result), int(end))


def lost_energy(run: TapResult) -> float:
    """Largest |energy balance| up to the end of the first tap, over the kinetic energy at its
    touch.
    """
    history = run.history
    lost = float(np.abs(history.energy_balance_J[: first_tap(run).stop]).max())
    return lost / max(float(history.kinetic_energy_J[first_contact(run)]), 1e-300)


def folded(result: TapResult, length: float) -> bool:
    """Whether the tip came close to the fixed hinge before the first contact."""
    before = result.history.tip_position_m[: first_contact(result) + 1]
    return bool(np.einsum("ij,ij->i", before, before).min() < (FOLDED * length) ** 2)


def grazes(result: TapResult, share: float = GRAZE) -> bool:
    """Whether the first tap barely ended or barely went on: by less than `share` (see `GRAZE`)."""
    history, summary = result.history, result.summary
    assert summary.contact_time_s is not None
    assert summary.tip_velocity_at_contact_m_per_s is not None
    slow = share * abs(summary.tip_velocity_at_contact_m_per_s[1])
    weak = share * (summary.peak_normal_force_N or 0.0)
    _, over = result.taps[0]
    for event in result.events:
        left, turned_back = event.kind == "separation", event.kind == "restitution_to_compression"
        # a whole tap goes on after all separations but its last
        left &= event.time_s >= over
        if event.time_s < summary.contact_time_s or not (left or turned_back):
            continue
        row = int(history.time_s.searchsorted(event.time_s, side="right")) - 1
        if left:
            return float(history.tip_velocity_m_per_s[row, 1]) < slow
        if float(history.normal_force_N[row]) < weak:
            return True
    return False
