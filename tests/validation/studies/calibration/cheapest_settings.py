"""What the settings chosen for an accuracy cost, over the cheapest that an exhaustive search finds.

    python -m tests.validation.studies.calibration.cheapest_settings 1e-3

prints a line per scene, then the median ratios: of the run with its estimate, and of its solve
alone, to the fastest of some thousand fixed settings whose four numbers happen to be as accurate,
the chosen ones among them.
The scenes are the first undriven ones of ``fingertap calibrate``. Times are the least of several,
taken in turns on one thread; ten seconds or more a scene.
"""

import math
import statistics
import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import product

import cyclopts

import hcm
from hcm.accuracy.coarser_run import ACCURACY_QUANTITIES
from validation.harness.console import output
from validation.harness.timing import shortest_in_turns
from validation.models.hcm import hcm_scene
from validation.scenes.load import load_scene
from validation.studies.calibration.scenes import case
from validation.studies.calibration.solves import _within

FLIGHT_ELEMENTS, FLIGHT_STEPS = (1, 2, 4), (6, 10, 17, 30, 60)
ELEMENTS, STAGES = (1, 2, 3, 4, 6, 8, 12), (3, 5)
LONGER = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 9.0)  # steps in contact, over the chosen ones
TIMED_AGAIN, TIMING_S = 12, 3.0


def error(result: hcm.TapResult, truth: hcm.TapResult) -> float:
    """The largest relative error of what an accuracy bounds; inf for a run that is not complete."""
    if result.status is not hcm.Status.COMPLETED:
        return math.inf
    both = (result.summary, truth.summary)
    pairs = [[getattr(of, name) for of in both] for name in ACCURACY_QUANTITIES]
    return max(math.inf if own is None else abs(own / true - 1.0) for own, true in pairs)


def settings_searched(chosen: hcm.Scene, contact_time: float) -> Iterator[hcm.Scene]:
    """The scene with each combination of flight, elements, stages and step in contact."""
    own = chosen.settings
    rods = replace(own, flight="rigid", flight_step=1.0)
    flights = [rods] + [
        replace(
            own, flight="elastic", flight_integrator="gauss", flight_elements=elements,
            flight_step=min(contact_time / steps, 1.0), flight_tolerance=1e-4,
        )
        for elements, steps in product(FLIGHT_ELEMENTS, FLIGHT_STEPS)
    ]  # fmt: skip
    for flight, elements, longer, stages in product(flights, ELEMENTS, LONGER, STAGES):
        if flight is rods or flight.flight_elements <= elements:
            step = min(longer * own.contact_step, 1.0)
            settings = replace(flight, contact_step=step, stages=stages)
            parts = tuple(replace(p, elements=elements) for p in chosen.finger.phalanges)
            yield replace(chosen, finger=hcm.Finger(parts), settings=settings)


def ratios(number: int, accuracy: float) -> tuple[float, float] | None:
    """Times over the cheapest's, of the run and of its solve; None if the scene has no tap."""
    scene = load_scene("soft", case("hcm", number, accuracy).overrides)
    given = hcm_scene(scene, estimate=False)
    given = replace(given, settings=replace(given.settings, taps=1))
    tight = _within(scene, given, accuracy)
    truth = hcm.simulate_scene(tight) if tight else None
    if truth is None or truth.status is not hcm.Status.COMPLETED:
        return None
    chosen = hcm.settings_for(accuracy, given).scene
    keeps = [(math.inf, chosen)]
    for trial in settings_searched(chosen, truth.summary.contact_time_s or 0.0):
        began = time.perf_counter()
        if error(hcm.simulate_scene(trial), truth) <= accuracy:
            keeps.append((time.perf_counter() - began, trial))
    keeps.sort(key=lambda one: one[0])
    judged = replace(given, settings=replace(given.settings, estimate=True))
    solves = [partial(hcm.simulate_within, accuracy, one) for one in (judged, given)]
    fastest = [one for _, one in (*keeps[:TIMED_AGAIN], keeps[-1])]
    solves += [partial(hcm.simulate_scene, one) for one in fastest]
    run, alone, *others = (one.wall_time_s for one in shortest_in_turns(solves, TIMING_S))
    cheapest = min(others)
    best = fastest[others.index(cheapest)]
    how = f"{best.settings.flight} flight, {best.settings.stages} stages"
    if best is chosen:
        how = "the chosen settings"
    output(
        f"{number:4}  {1e3 * run:7.2f} ms, solve {1e3 * alone:7.2f}, cheapest {1e3 * cheapest:6.2f}"
        f"  ({how}; {len(keeps) - 1} others keep it)"
    )
    return run / cheapest, alone / cheapest


def cheapest_settings(accuracy: float, scenes: int = 20) -> None:
    """Search settings for so many scenes; print the ratios."""
    found = list[tuple[float, float]]()
    number = 0
    while len(found) < scenes:
        if case("hcm", number, accuracy).kind != "driven" and (one := ratios(number, accuracy)):
            found.append(one)
        number += 1
    for name, of in zip(
        ("with its estimate", "solve alone"), zip(*found, strict=True), strict=True
    ):
        ordered = sorted(of)
        output(
            f"{accuracy:g}, {name}: {statistics.median(of):.2f} times the cheapest's time"
            f" (median of {len(of)}; {ordered[0]:.2f} to {ordered[-1]:.2f})"
        )


if __name__ == "__main__":
    cyclopts.run(cheapest_settings)
