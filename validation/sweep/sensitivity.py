"""Sobol's indices of what a sweep computes, by SciPy from a surrogate through its points.

`scipy.stats.sobol_indices` (Saltelli's estimators) wants a function of independent variables that
it may call some thousand times. The function is a thin-plate spline through the sweep's points over
the variables' ranks, drawn as often as the points have them; its smoothing is the one that predicts
left-out points best. How well it does is Q^2, the share of their variance that it explains: the
indices are those of the surrogate, and say nothing of the rest. Points whose value is missing leave
variables that depend on each other: of more than `MOST_MISSING` there are no indices.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from validation.harness.record import Floats

SMOOTHINGS = (0.0, 1e-4, 1e-2, 1.0, 1e2)
FOLDS = 5
MOST_POINTS = 1500  # of the fit, whose cost grows with their cube
LEAST_POINTS = 10  # per variable
SAMPLES = 1024
LEAST_Q2 = 0.5
MOST_MISSING = 0.05


@dataclass(frozen=True)
class Indices:
    """First-order and total indices by variable, NaN where there are none; the surrogate's Q^2."""

    first: Floats
    total: Floats
    q2: float


@dataclass(frozen=True)
class Drawn:
    """A column's own distribution: a grid's variable has its levels, and none between."""

    column: Floats

    def ppf(self, q: Floats) -> Floats:
        """Quantiles."""
        return np.asarray(np.quantile(self.column, q, method="inverted_cdf"))


def ranks(columns: Floats) -> Floats:
    """Each column's values (n, d) as shares of their order, equal ones alike."""
    from scipy.stats import rankdata

    return np.asarray((rankdata(columns, axis=0) - 0.5) / len(columns))


def _surrogate(x: Floats, y: Floats, smoothing: float) -> Any:
    from scipy.interpolate import RBFInterpolator

    return RBFInterpolator(x, y, smoothing=smoothing * len(x), kernel="thin_plate_spline")


def cross_validated(x: Floats, y: Floats, smoothing: float) -> float:
    """Q^2 of the surrogate on points that it has not seen."""
    parts = np.arange(len(y)) % FOLDS
    missed = np.empty_like(y)
    for fold in range(FOLDS):
        out = parts == fold
        try:
            missed[out] = _surrogate(x[~out], y[~out], smoothing)(x[out]) - y[out]
        except np.linalg.LinAlgError:  # two points in one place, and no smoothing
            return -np.inf
    return float(1.0 - np.mean(missed**2) / np.var(y))


def sobol(columns: Floats, values: Floats) -> Indices | None:
    """Indices of `values` (n,) over the variables `columns` (n, d); None of too few points."""
    from scipy.stats import sobol_indices

    known = np.isfinite(values)
    n, d = columns[known].shape
    if n < LEAST_POINTS * d or not np.ptp(values[known]) > 0.0:
        return None
    none = np.full(d, np.nan)
    if n < (1.0 - MOST_MISSING) * len(values):
        return Indices(none, none, np.nan)
    # in no order: a grid's folds would each leave out a whole side
    order = np.random.default_rng(0).permutation(n)[:MOST_POINTS]
    x, y = ranks(columns[known])[order], values[known][order]
    q2, smoothing = max((cross_validated(x, y, s), s) for s in SMOOTHINGS)
    if q2 < LEAST_Q2:
        return Indices(none, none, q2)
    if d == 1:  # which scipy can't take
        return Indices(np.ones(1), np.ones(1), q2)
    fitted = _surrogate(x, y, smoothing)

    def function(points: Floats) -> Floats:
        return np.asarray(fitted(points.T))[None, :]

    found = sobol_indices(
        func=function,
        n=SAMPLES,
        dists=[Drawn(column) for column in x.T],
        rng=np.random.default_rng(1),
    )
    return Indices(np.ravel(found.first_order), np.ravel(found.total_order), q2)
