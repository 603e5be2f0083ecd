"""The contract of a stability map, whichever solver it is about: axes, scenes, a judge, verdicts.

A `Map` names its axes and gives, for each of its cells, a *scene* and a *judge*:

    scene(x, y[, panel]) -> a frozen dataclass whose repr is the cell's whole identity
    judge(scene) -> CellVerdict, a function of a module (it is sent to other processes)

The judge runs the solver, bounded in work, and checks what comes back by something that did not
produce it; a scene that the solver refuses is REFUSED, a run that ends early is STOPPED, and only a
run that claims to be good can be RIGHT, SMALLER, UNDERSTATED or WRONG. A stored verdict counts
until its scene, or the code of its scene or of its judge changes (`studies.campaign`).

To add maps, write a function ``some_maps(quick: bool) -> tuple[Map, ...]`` and name it in
`command.all_maps`. `studies.campaign` stores one line per cell as soon as it is judged and
goes on where it was; tables, figures and the page follow.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import product
from math import inf
from typing import Any, Self

from validation.studies.stated_errors import ROUND_OFF_SHARE, WRONG_SHARE, StatedError, understated

# Largest relative error of what is still called right (the README's and the page's definition).
RIGHT_WITHIN = 0.05


class Answer(StrEnum):
    """The verdict on a cell's run."""

    RIGHT = "right"
    SMALLER = "right at a smaller step"
    UNDERSTATED = "more than its stated error off"
    REFUSED = "refused"
    STOPPED = "stopped"
    FLAGGED = "flagged as not reliable"
    WRONG = "wrong and silent"


@dataclass(frozen=True)
class CellVerdict:
    """A cell's answer; its fields are the columns of the CSV.

    reason : why. checked_by : the checks, independent of the solver, that the answer rests on.
    error : largest relative difference from them, if there is one; stated : the error that the run
    itself states for that number. energy_residual : the solver's own. steps, wall_time_s : cost of
    the run that was judged (not of its checks).
    """

    answer: Answer
    reason: str
    checked_by: str = ""
    error: float | None = None
    energy_residual: float | None = None
    steps: int = 0
    wall_time_s: float = 0.0
    stated: float | None = None

    def judged(self, answer: Answer, reason: str) -> Self:
        """The verdict with another answer and reason."""
        return replace(self, answer=answer, reason=reason)

    def compared(self, other: str, error: float | None, quantity: str = "the tap") -> Self:
        """With one more check: wrong where it differs from `other` by more than `RIGHT_WITHIN`.

        error : relative; None where neither has a tap.
        """
        found = replace(self, error=error, checked_by=f"{self.checked_by}, {other}")
        if error is None or error <= RIGHT_WITHIN:
            return found
        return found.judged(Answer.WRONG, f"{quantity} differs by {100 * error:.2g} % from {other}")

    def within_stated(
        self, other: str, numbers: Mapping[str, StatedError], cautioned: bool
    ) -> Self:
        """The verdict after one more check: right if off `other` by no more than the run states.

        numbers : from `stated_errors.true_errors`; the one farthest beyond its stated error counts.
        One that the run says it does not know may not be off by `WRONG_SHARE` without a flag.
        """
        found = replace(self, checked_by=f"{self.checked_by}, {other}")
        if not numbers:
            return found
        shares = {name: number.shares for name, number in numbers.items()}
        off = {n: t for n, (stated, t) in shares.items() if stated == inf and t > WRONG_SHARE}
        if off:
            worst = max(off, key=off.__getitem__)
            apart = f"{worst} differs by {100 * off[worst]:.2g} % from {other}"
            answer = Answer.FLAGGED if cautioned else Answer.WRONG
            found = found.judged(answer, f"{apart}, and its error is not known to the run")
            return replace(found, error=off[worst], stated=inf)
        worst = max(shares, key=lambda name: shares[name][1] / (shares[name][0] + ROUND_OFF_SHARE))
        stated, true = shares[worst]
        found = replace(found, error=true, stated=stated)
        if not understated(stated, true):
            return found
        answer = Answer.WRONG if true > WRONG_SHARE and not cautioned else Answer.UNDERSTATED
        apart = f"{worst} differs by {100 * true:.2g} % from {other}"
        return found.judged(answer, f"{apart}, and {100 * stated:.2g} % is stated")


Judge = Callable[[Any], CellVerdict]


@dataclass(frozen=True)
class Map:
    """A grid of cells: the solver it examines, its axes, the scene of a cell and its judge.

    axes : the values of x, of y and, if it has panels, of these, by their names in the table. A map
    of one y is a list: it gets no figure. scene : takes a value of each.
    """

    name: str
    axes: dict[str, tuple[float, ...]]
    scene: Callable[..., Any]
    judge: Judge
    solver: str

    def cells(self) -> Iterator[tuple[dict[str, float], Any]]:
        """Where each cell lies, by the axes' names, and its scene: panel by panel, row by row."""
        for values in product(*reversed(self.axes.values())):
            place = dict(zip(self.axes, reversed(values), strict=True))
            yield place, self.scene(*place.values())
