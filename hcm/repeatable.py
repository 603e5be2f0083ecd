"""Whether a tap would come out the same again: a finger that folds up moves chaotically.

A chain that swings through itself multiplies every error by e^(Lambda t), those of its own steps
included: a run may complete, keep its energy and be nothing like the motion. What a map of torques
shows is that such a chain's tip has first come close to the fixed hinge; a finger on its way to the
surface stays stretched. So only a run whose tip has come closer than `FOLDED` of the finger's
length is repeated at `COARSER` tolerances, and says so when its first tap depends on them. In a
motion that converges the coarser run is COARSER^(2/3) times as wrong as the run itself.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hcm.parameters import Settings
from hcm.result import History, Status, Summary, TapResult

FOLDED = 0.5
COARSER = 10.0
# Largest relative change of the first tap's numbers that a run may show against the coarser one.
LARGEST_CHANGE = 0.02


def folded(history: History, summary: Summary, length: float) -> bool:
    """Whether the tip came close to the fixed hinge before the first contact."""
    if summary.contact_time_s is None:
        return False
    path = history.tip_position_m[history.time_s <= summary.contact_time_s]
    return float((path**2).sum(axis=1).min()) < (FOLDED * length) ** 2


def coarser(settings: Settings) -> Settings:
    """Settings of the repetition: one tap, longer steps, not repeated itself."""
    fixed = settings.flight_tolerance == 0.0
    return replace(
        settings,
        flight_step=settings.flight_step * (2.0 if fixed else 1.0),
        flight_tolerance=COARSER * settings.flight_tolerance,
        contact_tolerance=COARSER * settings.contact_tolerance,
        taps=1,
        end_time=None,
        frame_times=(),
        repeat_folded=False,
    )


def change(own: Summary, other: TapResult) -> tuple[str, float]:
    """The number of the first tap that changes most, and by which share; inf without a tap."""
    told = other.summary
    if other.status is not Status.COMPLETED:
        return f"the tap ({other.status.value} then)", float("inf")
    assert own.tip_velocity_at_contact_m_per_s is not None
    assert told.tip_velocity_at_contact_m_per_s is not None
    velocity = np.array(own.tip_velocity_at_contact_m_per_s)
    apart = float(np.abs(velocity - told.tip_velocity_at_contact_m_per_s).max())
    changes = {"the velocity at contact": apart / max(abs(float(velocity[1])), 1e-300)}
    for name, words in (
        ("contact_time_s", "the time of contact"),
        ("peak_normal_force_N", "the peak normal force"),
        ("normal_impulse_N_s", "the normal impulse"),
    ):
        a, b = getattr(own, name), getattr(told, name)
        changes[words] = abs(b - a) / max(abs(a), 1e-300)
    largest = max(changes, key=lambda words: changes[words])
    return largest, changes[largest]
