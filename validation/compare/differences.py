"""How far two runs' scalars lie apart, and how far those of several runs spread."""

from collections.abc import Sequence
from dataclasses import dataclass

from validation.harness.quantities import Quantity
from validation.harness.record import RunRecord


def error_percent(reduced: float | None, reference: float | None) -> float | None:
    """100 (reduced - reference) / reference; None where it has no meaning.

    Negative means smaller in magnitude, for negative quantities (Ft, vy) as for positive ones.
    """
    if reduced is None or reference is None or reference == 0:
        return None
    return 100 * (reduced - reference) / reference


@dataclass(frozen=True)
class Spread:
    """How far runs that should agree lie apart. Not a convergence study.

    Attributes
    ----------
    low, high : smallest and largest value.
    count : number of runs.
    """

    low: float
    high: float
    count: int

    def percent_of(self, value: float) -> float:
        """The whole spread as a share of a value, percent."""
        return 100 * (self.high - self.low) / abs(value)


def spread(runs: Sequence[RunRecord], of: Quantity) -> Spread | None:
    """Spread of one quantity over completed runs, in its shown unit; None below two values."""
    values = [value for run in runs if run.ok and (value := of.read(run)) is not None]
    if len(values) < 2:
        return None
    return Spread(min(values), max(values), len(values))
