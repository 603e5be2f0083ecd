"""Times on a machine that others use too: the smallest of several, after a warm-up."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

Result = TypeVar("Result")

LEAST_RUNS = 3
MOST_RUNS = 25


@dataclass(frozen=True)
class Timed(Generic[Result]):
    """The last run's result, the shortest time in s, and how many runs it is the shortest of."""

    result: Result
    wall_time_s: float
    runs: int


def shortest(run: Callable[[], Result], budget_s: float, least: int = LEAST_RUNS) -> Timed[Result]:
    """Run once unmeasured, then until `budget_s` is spent; at least `least` times."""
    run()
    best, runs, spent = float("inf"), 0, 0.0
    while runs < least or (spent < budget_s and runs < MOST_RUNS):
        start = time.perf_counter()
        result = run()
        elapsed = time.perf_counter() - start
        best, runs, spent = min(best, elapsed), runs + 1, spent + elapsed
    return Timed(result, best, runs)
