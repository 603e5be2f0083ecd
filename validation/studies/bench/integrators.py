"""The contact by another integrator: Runge-Kutta of order 8 (`hcm.reference_solution`).

The same beams, contact law and event functions, in minimal coordinates and in SciPy's Python loop:
its time against generalized-alpha's is that of the whole program, not of the method alone.
"""

from collections.abc import Iterable
from dataclasses import asdict, dataclass

from validation.compare.tap_errors import TapQuantities, tap_errors
from validation.harness.timing import shortest
from validation.studies.bench import truths
from validation.studies.bench.kept import Kept
from validation.studies.bench.measured import Point
from validation.studies.bench.work_precision import Progress

STUDY, SERIES = "contact", "integrator: DOP853"


@dataclass(frozen=True)
class Rung:
    """Elements a phalanx, and the relative tolerance of the Runge-Kutta pair."""

    elements: int
    rtol: float

    @property
    def setting(self) -> str:
        """What was set, for the table."""
        return f"{self.elements} elements, rtol {self.rtol:g}"


def ladder(quick: bool) -> tuple[Rung, ...]:
    """All settings; `quick` leaves out the dearest."""
    rungs = tuple(Rung(n, rtol) for n in (3, truths.TAP_ELEMENTS) for rtol in (1e-2, 1e-6))
    return rungs if quick else (*rungs, Rung(10, 1e-6))


def measure(rung: Rung, truth: TapQuantities, budget_s: float) -> Point:
    """Time a setting and compare it with the truth."""
    timed = shortest(lambda: truths.solve_impact(rung.elements, rung.rtol), budget_s)
    return Point(
        STUDY, "hcm", SERIES, rung.setting, "COMPLETED", timed.wall_time_s, timed.runs,
        errors=tap_errors(timed.result, truth),
    )  # fmt: skip


def measure_all(
    rungs: Iterable[Rung], known: truths.Known, budget_s: float, kept: Kept, progress: Progress
) -> list[Point]:
    """Every setting in turn."""
    rungs = tuple(rungs)
    points = []
    for number, rung in enumerate(rungs):
        progress(number / len(rungs), f"DOP853, {rung.setting}")

        def measure_it(rung: Rung = rung) -> Point:
            return measure(rung, known.values, budget_s)

        points.append(kept.point("hcm", rung, measure_it, truth=asdict(known.values)))
    return points
