"""How far two runs' numbers lie apart, what that means given their errors, and how several spread.

ASME V&V 20 (2009): the comparison error E = S - D against the uncertainty u of the comparison,
u^2 = u_S^2 + u_D^2. |E| > u: E is an error of the model, of that size and sign. |E| <= u: the
model's error lies within what the comparison can see.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

from validation.harness.quantities import OF_A_TAP, Quantity, finite
from validation.harness.record import RunRecord

Judgement = Literal["resolved", "within uncertainty", "cannot tell"]
Check = Literal["inside", "outside", "cannot tell"]
# Tolerance on the decimal logarithm of a ratio: models differ by less than a factor of two.
DECADE_TOLERANCE = 0.3


@dataclass(frozen=True)
class Verdict:
    """A comparison of one number.

    difference : E = S - D over D, percent: negative where S is smaller in magnitude.
    uncertainty : u over |D|, percent; None where a result states no error.
    tolerance : largest allowed difference, percent; None: none was asked for.
    """

    difference: float
    uncertainty: float | None
    tolerance: float | None = None

    @property
    def judgement(self) -> Judgement:
        """The judgement; *cannot tell* if u is unknown."""
        if self.uncertainty is None:
            return "cannot tell"
        return "resolved" if abs(self.difference) > self.uncertainty else "within uncertainty"

    @property
    def check(self) -> Check | None:
        """Whether the difference is within the tolerance, None where none was asked for.

        *Cannot tell* if u is unknown, or larger than the tolerance unless |E| is beyond both.
        """
        size, u, most = abs(self.difference), self.uncertainty, self.tolerance
        if most is None:
            return None
        if u is None or (u > most and size <= most + u):
            return "cannot tell"
        return "inside" if size <= most else "outside"


# Below this ratio of target to value a percentage means nothing (an arrival timed from the touch).
LEAST_TARGET = 1e-9


def error_percent(value: float | None, target: float | None) -> float | None:
    """100 E/D = 100 (S - D)/D; None where it has no meaning.

    Negative means smaller in magnitude, for negative numbers (Ft, vy, a stress) as for others.
    """
    if value is None or target is None or abs(target) <= LEAST_TARGET * abs(value):
        return None
    return 100.0 * (value - target) / target + 0.0  # never "-0"


def judge(
    value: float | None,
    target: float | None,
    value_error: float | None,
    target_error: float | None,
    tolerance: float | None = None,
) -> Verdict | None:
    """The verdict on a number and its reference; None where there is nothing to compare.

    value, target : S and D, in one unit.
    value_error, target_error : u_S and u_D in that unit; None or infinite: not known.
    tolerance : percent of D.
    """
    if value == target == value_error == target_error == 0.0:  # F_t without friction
        return Verdict(0.0, 0.0, tolerance)
    percent = error_percent(value, target)
    if percent is None or target is None:
        return None
    u = None
    if value_error is not None and target_error is not None:
        u = finite(100.0 * math.hypot(value_error, target_error) / abs(target))
    return Verdict(percent, u, tolerance)


def thousands_apart(value: float, target: float) -> int:
    """The power of 1000 by which a number seems to be in another unit; 0 if it does not."""
    if value == 0.0 or target == 0.0:
        return 0
    decades = math.log10(abs(value / target))
    power = round(decades / 3.0)
    return power if power and abs(decades - 3.0 * power) < DECADE_TOLERANCE else 0


def turned(value: float, target: float) -> bool:
    """Whether two numbers are of about one size, to a factor of two, and of opposite signs."""
    return value * target < 0.0 and 0.5 < abs(value / target) < 2.0


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
        verdict = self.verdict
        return None if verdict is None else verdict.difference

    @property
    def verdict(self) -> Verdict | None:
        """The difference judged by both errors and the tolerance; None if a number is missing."""
        errors = self.reduced_error, self.reference_error
        return judge(self.reduced, self.reference, *errors, self.tolerance)

    @property
    def numbers(self) -> dict[str, Any]:
        """Values, errors and verdict by the columns of a table; None: not known."""
        verdict = self.verdict
        return {
            "reduced": self.reduced,
            "reduced_error": self.reduced_error,
            "reference": self.reference,
            "reference_error": self.reference_error,
            "error_percent": verdict and verdict.difference,
            "uncertainty_percent": verdict and verdict.uncertainty,
            "verdict": verdict and verdict.judgement,
            "tolerance_percent": verdict and verdict.tolerance,
            "check": verdict and verdict.check,
        }


def differences_of(
    scene: str,
    model: str,
    reduced: RunRecord | None,
    reference: RunRecord | None,
    wanted: Sequence[Quantity] = OF_A_TAP,
    tolerances: Mapping[str, float] = MappingProxyType({}),
) -> list[Difference]:
    """These quantities of two runs; a run may be missing.

    tolerances : largest difference by a quantity's key, percent.
    """
    return [
        Difference(scene, model, of, of.read(reduced), of.read(reference),
                   of.error(reduced), of.error(reference), tolerances.get(of.key))
        for of in wanted
    ]  # fmt: skip


def spread(runs: Sequence[RunRecord], of: Quantity) -> tuple[float, float, int] | None:
    """Smallest and largest value of completed runs that should agree, in the shown unit, and their
    number; None below two values.
    """
    values = [value for run in runs if run.ok and (value := of.read(run)) is not None]
    if len(values) < 2:
        return None
    return min(values), max(values), len(values)
