"""Contact forces of two runs over the time since first contact, t - t_c."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from validation.harness.record import RunRecord

FORCES = {"normal_force_N": "Fn", "tangential_force_N": "Ft"}  # names and titles


def contact_curve(record: RunRecord, name: str, time: NDArray[Any]) -> NDArray[Any]:
    """A force at the times t - t_c: linear between two steps, zero before the first and after all.

    Parameters
    ----------
    time : (n,), s after first contact.
    """
    contact = record.value("contact_time_s")
    if contact is None:
        raise ValueError(f"{record.label}: no contact, no curve")
    forces = record.contact_forces
    return np.interp(time, forces["time_s"] - contact, forces[name], left=0.0, right=0.0)


def later_separation(*records: RunRecord) -> float | None:
    """The longest first tap, s; None where one is not over or lasts no time."""
    ends = [record.value("contact_duration_s") for record in records]
    longest = max((end for end in ends if end is not None), default=0.0)
    return None if None in ends or longest <= 0.0 else longest


def steps_within(end: float, records: Sequence[RunRecord]) -> NDArray[Any]:
    """Times t - t_c from 0 to ``end`` (s): every step of every run, and both ends."""
    starts = [record.value("contact_time_s") or 0.0 for record in records]
    steps = [record.contact_forces["time_s"] - t for record, t in zip(records, starts, strict=True)]
    time = np.unique(np.concatenate([[0.0, end], *steps]))
    return time[(time >= 0.0) & (time <= end)]
