"""Sobol's indices of what a sweep computes, by SciPy from a surrogate through its points.

`scipy.stats.sobol_indices` (Saltelli's estimators) needs a function of independent variables that
it can call some thousand times: here a thin-plate spline through the sweep's points over the
variables' ranks, which are drawn as often as the points have them. Its smoothing is the one that
predicts left-out points best. Q^2 is the share of their variance that it explains: the indices are
those of the surrogate, and say nothing about the rest. If the values of some points are missing,
the others' variables may depend on each other: beyond `MOST_MISSING` there are no indices.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from validation.harness.record import Floats

SMOOTHINGS = (0.0, 1e-4, 1e-2, 1.0, 1e2)
FOLDS = 5
MOST_POINTS = 1500  # used by the fit, whose cost grows with their cube
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
    """The distribution of a column's values: a grid's variable takes only its levels."""

    column: Floats

    def ppf(self, q: Floats) -> Floats:
        """Quantiles at the probabilities `q`."""
        return np.asarray(np.quantile(self.column, q, method="inverted_cdf"))


def ranks(columns: Floats) -> Floats:
    """Ranks of each column's values (n, d), scaled to (0, 1); equal values have equal ranks."""
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
        except np.linalg.LinAlgError:  # two points coincide, without smoothing
            return -np.inf
    return float(1.0 - np.mean(missed**2) / np.var(y))


def sobol(columns: Floats, values: Floats) -> Indices | None:
    """Indices of `values` (n,) over variables `columns` (n, d); None: too few or equal values."""
    from scipy.stats import sobol_indices

    known = np.isfinite(values)
    n, d = columns[known].shape
    if n < LEAST_POINTS * d or not np.ptp(values[known]) > 0.0:
        return None
    none = np.full(d, np.nan)
    if n < (1.0 - MOST_MISSING) * len(values):
        return Indices(none, none, np.nan)
    # shuffled: the folds of an ordered grid might each leave out a whole side
    order = np.random.default_rng(0).permutation(n)[:MOST_POINTS]
    x, y = ranks(columns[known])[order], values[known][order]
    q2, smoothing = max((cross_validated(x, y, s), s) for s in SMOOTHINGS)
    if q2 < LEAST_Q2:
        return Indices(none, none, q2)
    if d == 1:  # scipy does not accept it
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
