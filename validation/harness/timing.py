"""Timing on a shared machine: the smallest of several times, after a warm-up."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from validation.harness.interrupts import unless_interrupted

Result = TypeVar("Result")

LEAST_RUNS = 3
MOST_RUNS = 25
# s; runs of a millisecond are repeated for longer than a burst of other work may last
LEAST_SPENT_S = 0.2


@dataclass(frozen=True)
class Timed(Generic[Result]):
    """The last run's result, the shortest time in s, and the number of timed runs."""

    result: Result
    wall_time_s: float
    runs: int


def shortest(
    run: Callable[[], Result], budget_s: float, least: int = LEAST_RUNS, warm_up: bool = True
) -> Timed[Result]:
    """Run once unmeasured (`warm_up`), then until `budget_s` is spent; at least `least` times."""
    if warm_up:
        unless_interrupted(run())
    best, runs, spent = float("inf"), 0, 0.0
    while runs < least or (
        spent < budget_s and (runs < MOST_RUNS or spent < min(LEAST_SPENT_S, budget_s))
    ):
        start = time.perf_counter()
        result = unless_interrupted(run())
        elapsed = time.perf_counter() - start
        best, runs, spent = min(best, elapsed), runs + 1, spent + elapsed
    return Timed(result, best, runs)


def shortest_in_turns(
    runs: Sequence[Callable[[], Result]], budget_s: float, most: int = MOST_RUNS
) -> list[Timed[Result]]:
    """`shortest` of runs that are compared: they take turns, so that a load hits all of them."""
    for run in runs:
        unless_interrupted(run())
    best = [float("inf")] * len(runs)
    start = time.perf_counter()
    rounds = 0
    while rounds < LEAST_RUNS or (time.perf_counter() - start < budget_s and rounds < most):
        rounds += 1
        latest = [shortest(run, 0.0, 1, warm_up=False) for run in runs]
        best = [min(old, new.wall_time_s) for old, new in zip(best, latest, strict=True)]
    return [Timed(new.result, old, rounds) for new, old in zip(latest, best, strict=True)]
