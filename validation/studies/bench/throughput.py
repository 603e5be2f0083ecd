"""Random scenes through hcm on all cores: how many per second, and how they end."""

import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

import hcm
from validation.harness.provenance import cores
from validation.models.adapter import Progress
from validation.models.hcm import HCM
from validation.studies.random_scenes import random_numbers, random_scene

SCENES, QUICK_SCENES = 1000, 200
SEED = 1


def scenes(count: int) -> Iterator[hcm.Scene]:
    """The stress campaign's first scenes, all of them by generalized-alpha."""
    for index in range(count):
        scene = random_scene(random_numbers(SEED, index))
        # collocation suits many digits of a smooth flight, not every scene: 8 times as long here
        plain = replace(scene.settings, flight_integrator="generalized-alpha", estimate=False)
        yield replace(scene, settings=plain)


def measure_throughput(quick: bool, progress: Progress) -> dict[str, int | float | str]:
    """Solve scenes on all cores, with compiled code loaded before; returns the table's row.

    It has the numbers of scenes and processes, scenes and steps per second, and the endings.
    """
    count, processes = QUICK_SCENES if quick else SCENES, cores()
    progress(0.0, "random scenes")
    HCM.warm_up()
    given = list(scenes(count))
    endings: Counter[str] = Counter()
    steps, start = 0, time.perf_counter()
    for done, outcome in enumerate(hcm.simulate_each(given, processes), 1):
        endings[outcome.status.lower().replace("_", " ")] += 1
        steps += outcome.steps
        progress(done / count, "random scenes")
    wall_time_s = time.perf_counter() - start
    return {
        "scenes": count,
        "processes": processes,
        "wall_time_s": wall_time_s,
        "scenes_per_s": count / wall_time_s,
        "steps_per_s": steps / wall_time_s,
        "endings": ", ".join(f"{number} {name}" for name, number in sorted(endings.items())),
    }
