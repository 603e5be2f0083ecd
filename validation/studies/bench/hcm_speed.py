"""hcm's speed: random scenes on all cores; the cost of a step against elements and phalanges.

Steps of the latter are fixed, so that every size takes about the same number of them: the time of
one accepted step is what an ordered elimination of a chain makes proportional to its length.
"""

import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import hcm
from validation.harness.provenance import cores
from validation.harness.timing import shortest
from validation.models.adapter import Progress
from validation.models.hcm import HCM
from validation.scenes.load import load_scene
from validation.studies.bench.work_precision import simulation
from validation.studies.random_scenes import random_numbers, random_scene

SCENES, QUICK_SCENES = 1000, 200
SEED = 1
ELEMENTS = (5, 10, 20, 40, 80, 160, 320)
PHALANGES = (1, 2, 3, 5, 10, 20, 30)
FIXED = ("solver.hcm.flight_tolerance=0", "solver.hcm.contact_tolerance=0")
# The surface is out of reach within the simulated time: flight only.
FLIGHT_S = 0.02
REACH = 0.9  # height of the surface over the finger's length
QUICK_STEPS = ("solver.hcm.flight_step=1e-3", "solver.hcm.contact_step=2e-6")


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
        steps += outcome.steps or 0
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


@dataclass(frozen=True)
class Size:
    """One size: what grows, how large, time of an accepted step, all steps, runs."""

    what: str
    size: int
    step_time_us: float
    steps: int
    runs: int


def exponent(sizes: Sequence[int], times: Sequence[float]) -> float:
    """Slope p of the least-squares line log t = p log n + c."""
    slope, _ = np.polyfit(np.log(sizes), np.log(times), 1)
    return float(slope)


def _overrides(what: str, size: int, quick: bool) -> tuple[str, ...]:
    if what == "elements":
        return (f"finger.elements={size}", *FIXED, *(QUICK_STEPS if quick else ()))
    tables = load_scene("soft").tables
    length = tables.per_phalanx(tables.finger.length)[0]
    return (
        f"finger.phalanges={size}",
        "finger.elements=20",
        f"surface.height={REACH * length * size!r}",
        f"solver.hcm.end_time={FLIGHT_S}",
        *FIXED,
    )


def measure_scaling(quick: bool, budget_s: float, progress: Progress) -> list[Size]:
    """Measure over elements per phalanx, then over phalanges."""
    cases = [("elements", n) for n in ELEMENTS] + [("phalanges", n) for n in PHALANGES]
    found = []
    for number, (what, size) in enumerate(cases):
        progress(number / len(cases), f"hcm, {size} {what}")
        timed = shortest(simulation("hcm", _overrides(what, size, quick)), budget_s, least=2)
        steps = timed.result.statistics.steps
        found.append(Size(what, size, timed.wall_time_s / steps * 1e6, steps, timed.runs))
    return found


def table(sizes: Sequence[Size]) -> list[dict[str, Any]]:
    """One row per size, with the exponents over the whole range and over its larger half."""
    rows = []
    for what in dict.fromkeys(size.what for size in sizes):
        mine = [size for size in sizes if size.what == what]
        whole, half = (
            exponent([s.size for s in part], [s.step_time_us for s in part])
            for part in (mine, mine[len(mine) // 2 :])
        )
        rows += [{**vars(s), "exponent": whole, "exponent_larger_half": half} for s in mine]
    return rows
