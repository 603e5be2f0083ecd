"""How far two runs' scalars lie apart, and how far those of several runs spread."""

from collections.abc import Sequence
from dataclasses import dataclass

from validation.compare.verdict import Verdict, error_percent, judge
from validation.harness.quantities import Quantity
from validation.harness.record import RunRecord


@dataclass(frozen=True)
class Difference:
    """One number of a model on a scene, beside the reference's.

    reduced, reference : values in the quantity's unit; None where a run is missing.
    reduced_error, reference_error : absolute errors that the runs state.
    tolerance : percent; None where none was asked for.
    """

    scene: str
    model: str
    quantity: Quantity
    reduced: float | None
    reference: float | None
    reduced_error: float | None = None
    reference_error: float | None = None
    tolerance: float | None = None

    @property
    def error_percent(self) -> float | None:
        """Difference in percent of the reference; negative: the model's is smaller in magnitude."""
        return error_percent(self.reduced, self.reference)

    @property
    def verdict(self) -> Verdict | None:
        """The difference judged by both errors and the tolerance; None if a number is missing."""
        errors = self.reduced_error, self.reference_error
        return judge(self.reduced, self.reference, *errors, self.tolerance)


def difference(
    scene: str,
    model: str,
    of: Quantity,
    reduced: RunRecord | None,
    reference: RunRecord | None,
    tolerance: float | None = None,
) -> Difference:
    """One quantity of two runs; a run may be missing."""
    return Difference(
        scene,
        model,
        of,
        reduced=None if reduced is None else of.read(reduced),
        reference=None if reference is None else of.read(reference),
        reduced_error=None if reduced is None else of.error(reduced),
        reference_error=None if reference is None else of.error(reference),
        tolerance=tolerance,
    )


@dataclass(frozen=True)
class Spread:
    """How far runs that should agree lie apart. Not a convergence study.

    low, high : smallest and largest value.
    count : number of runs.
    """

    low: float
    high: float
    count: int


def spread(runs: Sequence[RunRecord], of: Quantity) -> Spread | None:
    """Spread of one quantity over completed runs, in its shown unit; None below two values."""
    values = [value for run in runs if run.ok and (value := of.read(run)) is not None]
    if len(values) < 2:
        return None
    return Spread(min(values), max(values), len(values))
