"""The errors that a run states beside those that a tighter solve finds; when they are too small."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from validation.harness.quantities import COMPONENTS, ESTIMATED, TIP_VELOCITY

# A stated error is too small where the true one is more than this many times as large ...
TIMES = 2.0
# ... beside the share of a number that round-off and iterations leave open in any two solves.
FLOOR = 1e-5
# A run is wrong and silent where a number is off by more than this share, and it has no caution.
WRONG = 0.02

# A number's value, stated and true error, and what a relative error is taken over, SI units.
Compared = tuple[float, float, float, float]


def understated(stated: float, true: float) -> bool:
    """Whether a relative error is larger than what is stated allows."""
    return true > TIMES * stated + FLOOR


def compare(
    summary: Mapping[str, Any], errors: Mapping[str, Any], truth: Mapping[str, Any]
) -> dict[str, Compared]:
    """Every number that states an error; one that the truth lacks is infinitely off.

    summary, truth : scalars of the run and of the tighter one. errors : as the run states them.
    """
    parts = {entry.key: entry.component_of for entry in COMPONENTS}
    keys = [key for key in ESTIMATED if key != TIP_VELOCITY]
    found = {}
    for key in (*keys, *parts):
        whole, axis = parts.get(key) or (key, 0)
        if summary.get(whole) is None or whole not in errors:
            continue
        value, stated = (np.atleast_1d(of[whole]) for of in (summary, errors))
        exact = truth.get(whole)
        true = np.inf if exact is None else abs(value[axis] - np.atleast_1d(exact)[axis])
        scale = max(float(np.linalg.norm(value)), 1e-300)
        found[key] = float(value[axis]), float(stated[axis]), float(true), scale
    return found
