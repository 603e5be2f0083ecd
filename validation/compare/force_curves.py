"""Contact forces of two runs over the time since first contact, t - t_c."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from validation.harness.record import RunRecord

FORCES = {"normal_force_N": "Fn", "tangential_force_N": "Ft"}  # names and titles


def contact_curve(record: RunRecord, name: str, time: NDArray[Any]) -> NDArray[Any]:
    """A force at times t - t_c: linear between steps, zero before the first and after the last.

    time : (n,), s after first contact.
    """
    contact = record.value("contact_time_s")
    if contact is None:
        raise ValueError(f"{record.label}: no contact, no curve")
    forces = record.contact_forces
    return np.interp(time, forces["time_s"] - contact, forces[name], left=0.0, right=0.0)


def first_tap(
    records: Sequence[RunRecord], name: str, samples: int | None = None
) -> tuple[NDArray[Any], list[NDArray[Any]]] | None:
    """A force of all runs from first contact to the latest separation, over t - t_c (s).

    None where a run has no contact or one that is not over, or where no contact lasts any time.

    samples : equally spaced times; None takes every step of every run, and both ends.
    """
    ends = [record.value("contact_duration_s") for record in records]
    latest = max((end for end in ends if end is not None), default=0.0)
    if None in ends or latest <= 0.0:
        return None
    if samples:
        time = np.linspace(0.0, latest, samples)
    else:
        steps = [r.contact_forces["time_s"] - (r.value("contact_time_s") or 0.0) for r in records]
        time = np.unique(np.concatenate([[0.0, latest], *steps]))
        time = time[(time >= 0.0) & (time <= latest)]
    return time, [contact_curve(record, name, time) for record in records]
