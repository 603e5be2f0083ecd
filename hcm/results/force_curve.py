"""The contact force between the rows of a history, where collocation takes few and long steps.

In a step of s stages in contact the force is smooth, as events end steps: the polynomial of degree
s + 1 through its s + 2 rows, both ends and the stages, is of the stages' order. A curve through the
rows alone, by straight lines, is up to 2 % of the peak off between them.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hcm.arrays import Floats
from hcm.compiled import entry_with
from hcm.integrators.gauss_tableau import tableau
from hcm.parameters import GAUSS

# Parts of the time between two rows: the straight lines of a tap of three steps of eight stages are
# then 1e-5 of its peak off (5 stages: 4e-5).
PARTS = 8


@entry_with()
def next_contact_step(i: int, time: Floats, mode: NDArray[np.int8], rows: int, end: int) -> int:
    """The row, from i on, that begins a step in contact; its `rows` others, of its stages and its
    end, come before row `end`, which is returned if there is no such step.
    """
    # neither in flight, nor one of two rows of one moment
    while i + rows < end and (mode[i] < 3 or time[i + 1] == time[i]):
        i += 1
    return i if i + rows < end else end


@dataclass(frozen=True)
class ForceCurve:
    """Contact force on the tip over time, (n,) each, s and N; signs as in `History`."""

    time_s: Floats
    normal_force_N: Floats
    tangential_force_N: Floats


def force_curve(history: Any, given: Mapping[str, Any]) -> ForceCurve | None:
    """The curve of a run: its rows, and `PARTS` - 1 points between any two of a step in contact.

    Between rows F_n >= 0 and |F_t| <= mu F_n, as in them. None: each row is a step's end.

    history, given : of `TapResult`.
    """
    settings = given["settings"]
    if settings.contact_integrator != GAUSS:
        return None
    stages, time, mode = settings.stages, history.time_s, history.mode
    starts, i = [], next_contact_step(0, time, mode, stages + 1, time.size)
    while i < time.size:
        starts.append(i)
        i = next_contact_step(i + stages + 1, time, mode, stages + 1, time.size)
    if not starts:
        return None
    places, weights = _interpolation(stages)
    rows = np.array(starts)[:, None] + np.arange(stages + 2)
    begin, lasts = time[rows[:, 0]], time[rows[:, -1]] - time[rows[:, 0]]
    between = (begin[:, None] + lasts[:, None] * places).ravel()
    normal, tangential = (
        (force[rows] @ weights.T).ravel()
        for force in (history.normal_force_N, history.tangential_force_N)
    )
    normal = np.maximum(normal, 0.0)
    held = given["surface"].friction * normal
    columns = [
        np.concatenate([of, new])
        for of, new in (
            (time, between),
            (history.normal_force_N, normal),
            (history.tangential_force_N, np.clip(tangential, -held, held)),
        )
    ]
    order = np.argsort(columns[0], kind="stable")
    return ForceCurve(*(column[order] for column in columns))


def _interpolation(stages: int) -> tuple[Floats, Floats]:
    """Places between a step's rows, (m,) as shares of it, and weights of its rows, (m, s + 2)."""
    nodes = np.array([0.0, *tableau(stages).c, 1.0])
    parts = np.arange(1, PARTS) / PARTS
    places = (nodes[:-1, None] + np.diff(nodes)[:, None] * parts).ravel()
    apart = nodes[:, None] - nodes
    np.fill_diagonal(apart, 1.0)
    terms = 1.0 / apart.prod(axis=1) / (places[:, None] - nodes)  # barycentric
    return places, terms / terms.sum(axis=1, keepdims=True)
