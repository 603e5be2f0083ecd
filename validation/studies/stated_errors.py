"""A run's stated errors beside those found by a tighter solve, and when they are too small."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from validation.harness.quantities import COMPONENTS, ESTIMATED, TIP_VELOCITY

# A stated error is too small if the true one is more than this many times as large ...
UNDERSTATED_FACTOR = 2.0
# ... plus this share of the number, by which round-off and iterations make any two solves differ.
ROUND_OFF_SHARE = 1e-5
# A run is wrong and silent if a number is off by more than this share and it has no caution.
WRONG_SHARE = 0.02


class StatedError(NamedTuple):
    """A number's stated and true error, and the scale of relative errors, in SI units."""

    stated: float
    true: float
    scale: float

    @property
    def shares(self) -> tuple[float, float]:
        """The stated and the true error, relative."""
        return self.stated / self.scale, self.true / self.scale


def understated(stated: float, true: float) -> bool:
    """Whether the true relative error exceeds what the stated one allows."""
    return true > UNDERSTATED_FACTOR * stated + ROUND_OFF_SHARE


def true_errors(
    summary: Mapping[str, Any], errors: Mapping[str, Any], truth: Mapping[str, Any]
) -> dict[str, StatedError]:
    """Compare every number with a stated error; it is infinite if only one run has the number.

    summary, truth : scalars of the run and of the tighter one. errors : as stated by the run.
    """
    parts = {entry.key: entry.component_of for entry in COMPONENTS}
    keys = [key for key in ESTIMATED if key != TIP_VELOCITY]
    found = {}
    for key in (*keys, *parts):
        whole, axis = parts.get(key) or (key, 0)
        exact = truth.get(whole)
        if summary.get(whole) is None and exact is not None:  # a tap is lost
            found[key] = StatedError(0.0, np.inf, 1.0)
        if summary.get(whole) is None or whole not in errors:
            continue
        value, stated = (np.atleast_1d(of[whole]) for of in (summary, errors))
        true = np.inf if exact is None else abs(value[axis] - np.atleast_1d(exact)[axis])
        true = np.inf if np.isnan(true) else true
        scale = max(float(np.linalg.norm(value)), 1e-300)
        found[key] = StatedError(float(stated[axis]), float(true), scale)
    return found
