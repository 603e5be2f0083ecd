"""Random scenes through hcm on all cores: how many a second, and how they end."""

from __future__ import annotations

import os
import time
from collections import Counter
from dataclasses import dataclass, replace

from validation.harness.processes import workers
from validation.models.adapter import Progress
from validation.models.hcm import warm_up
from validation.studies.random_scenes import random_numbers, random_scene

SCENES, QUICK_SCENES = 1000, 200
SEED = 1
A_JOB = 20  # scenes: their work differs a thousandfold


@dataclass(frozen=True)
class Throughput:
    """Scenes solved, the processes that shared them, accepted steps, how the scenes ended."""

    scenes: int
    processes: int
    wall_time_s: float
    scenes_per_s: float
    steps_per_s: float
    endings: str


def solve_scenes(first: int, last: int) -> tuple[Counter[str], int]:
    """Endings and accepted steps of the stress campaign's scenes `first` to `last` - 1.

    All of them by generalized-alpha.
    """
    import hcm

    endings: Counter[str] = Counter()
    steps = 0
    for index in range(first, last):
        given = random_scene(random_numbers(SEED, index)).arguments()
        # collocation is for many digits of a smooth flight, not for any scene: 8 times as long here
        settings = replace(given["settings"], flight_integrator="generalized-alpha", estimate=False)
        try:
            result = hcm.simulate(**{**given, "settings": settings})
        except hcm.ParameterError:
            endings["refused"] += 1
            continue
        endings[result.status.value] += 1
        steps += result.statistics.steps
    return endings, steps


def measure_throughput(quick: bool, progress: Progress) -> Throughput:
    """Share the scenes out; the processes have started and loaded their code before."""
    scenes, processes = QUICK_SCENES if quick else SCENES, os.cpu_count() or 1
    with workers(processes) as pool:
        progress(0.0, "random scenes")
        for ready in [pool.submit(warm_up) for _ in range(processes)]:
            ready.result()
        start = time.perf_counter()
        jobs = [
            pool.submit(solve_scenes, n, min(n + A_JOB, scenes)) for n in range(0, scenes, A_JOB)
        ]
        found: list[tuple[Counter[str], int]] = []
        for job in jobs:
            found.append(job.result())
            progress(len(found) / len(jobs), "random scenes")
        wall_time_s = time.perf_counter() - start
    endings: Counter[str] = sum((counts for counts, _ in found), Counter())
    return Throughput(
        scenes=scenes,
        processes=processes,
        wall_time_s=wall_time_s,
        scenes_per_s=scenes / wall_time_s,
        steps_per_s=sum(steps for _, steps in found) / wall_time_s,
        endings=", ".join(f"{count} {name}" for name, count in sorted(endings.items())),
    )
