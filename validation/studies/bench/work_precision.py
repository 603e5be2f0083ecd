"""hcm's work-precision ladders on the soft scene: the whole tap from rest, and the contact alone.

The tap's truth has hcm's own five elements a phalanx, so that its ladders show the error of time
integration. The contact's ladder of elements is measured against 20 elements a phalanx.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

from validation.compare.tap_errors import TapQuantities, tap_errors
from validation.harness.timing import shortest
from validation.models.hcm import translate
from validation.scenes.load import load_scene
from validation.studies.bench import truths
from validation.studies.bench.kept import Kept
from validation.studies.bench.measured import Point

Number = int | float
Value = Number | str
Progress = Callable[[float, str], None]

# Error control in flight and contact; each ladder changes what its name says.
BASE: Mapping[str, Number] = {
    "flight_step": 1e-3,
    "flight_tolerance": 1e-7,
    "contact_step": 1e-5,
    "contact_tolerance": 1e-9,
}
FIXED: Mapping[str, Number] = {"flight_tolerance": 0, "contact_tolerance": 0}
GAUSS: Mapping[str, Value] = {
    "flight_integrator": "gauss",
    "newton_tolerance": 1e-7,
    "spectral_radius": 1.0,
}
IMPACT_TOLERANCE = {"contact_step": 1e-5, "contact_tolerance": 1e-13, "newton_tolerance": 1e-11}


@dataclass(frozen=True)
class Rung:
    """One setting: elements a phalanx, and what differs from hcm's own defaults."""

    study: str
    series: str
    elements: int
    changes: Mapping[str, Value]

    @property
    def setting(self) -> str:
        """What was set, for the table."""
        changed = ", ".join(
            f"{key} {value if isinstance(value, str) else format(value, 'g')}"
            for key, value in self.changes.items()
        )
        return f"{self.elements} elements" + (f", {changed}" if changed else "")

    def inputs(self) -> dict[str, Any]:
        """Keyword arguments of `hcm.simulate`."""
        overrides = [f"solver.hcm.{key}={value!r}" for key, value in self.changes.items()]
        scene = load_scene("soft", (f"finger.elements={self.elements}", *overrides))
        given = translate(scene)
        if self.study == "contact":
            length = given["finger"].phalanges[0].length
            given["start"] = truths.impact_start(given["surface"].height, length)
        return given


def ladders(quick: bool) -> tuple[Rung, ...]:
    """All settings; `quick` leaves out the dearest."""

    def tap(series: str, *changes: Mapping[str, Value]) -> Rung:
        merged = {key: value for change in changes for key, value in change.items()}
        return Rung("tap", series, truths.TAP_ELEMENTS, merged)

    tolerances = [(1e-5, 1e-7), (1e-6, 1e-8), (1e-7, 1e-9), (1e-8, 1e-10), (1e-9, 1e-11)]
    steps = [(1e-3, 1e-5), (3e-4, 3e-6), (1e-4, 1e-6), (3e-5, 3e-7)]
    counts = [1, 2, 3, 5, 10]
    # the loop with collocation is compiled apart, in half a minute: not for a quick look
    collocated: list[tuple[float, float]] = []
    if not quick:
        tolerances += [(1e-10, 1e-12), (1e-11, 1e-13)]
        steps += [(1e-5, 1e-7), (3e-6, 3e-8)]
        collocated += [(5e-4, 1e-6), (2e-4, 5e-7), (1e-4, 3e-7), (5e-5, 1e-7), (3e-5, 3e-8)]
        counts += [20, 40]
    rungs = [tap("default settings")]
    rungs += [
        tap("tolerances", BASE, {"flight_tolerance": f, "contact_tolerance": c})
        for f, c in tolerances
    ]
    rungs += [tap("fixed steps", {"flight_step": f, "contact_step": c}, FIXED) for f, c in steps]
    rungs += [
        tap("flight by Gauss collocation", GAUSS, FIXED, {"flight_step": f, "contact_step": c})
        for f, c in collocated
    ]
    rungs += [
        tap("rigid flight", BASE, {"flight": "rigid", "flight_step": 1e-2, "contact_tolerance": c})
        for c in (1e-7, 1e-8, 1e-9, 1e-10)
    ]
    rungs += [tap("xi", BASE, {"spectral_radius": xi}) for xi in (0.0, 0.4, 0.8, 0.9, 1.0)]
    rungs += [tap("newton tolerance", BASE, {"newton_tolerance": t}) for t in (1e-3, 1e-5, 1e-7)]
    rungs += [Rung("contact", "elements", n, IMPACT_TOLERANCE) for n in counts]
    return tuple(rungs)


def quantities(result: Any) -> TapQuantities | None:
    """What a run of hcm found; None if it did not get to separation."""
    summary = result.summary
    turns = [e.time_s for e in result.events if e.kind == "compression_to_restitution"]
    if result.status.name != "COMPLETED" or summary.contact_duration_s is None or not turns:
        return None
    return TapQuantities(
        contact_time_s=summary.contact_time_s,
        turn_s=turns[0] - summary.contact_time_s,
        duration_s=summary.contact_duration_s,
        peak_normal_force_N=summary.peak_normal_force_N,
        normal_impulse_N_s=summary.normal_impulse_N_s,
    )


def measure(rung: Rung, truth: TapQuantities, budget_s: float) -> Point:
    """Time a setting and compare it with the truth."""
    import hcm

    given = rung.inputs()
    timed = shortest(lambda: hcm.simulate(**given), budget_s)
    found = quantities(timed.result)
    return Point(
        rung.study,
        "hcm",
        rung.series,
        rung.setting,
        timed.result.status.name,
        timed.wall_time_s,
        timed.runs,
        timed.result.statistics.steps,
        None if found is None else tap_errors(found, truth),
    )


def measure_all(
    rungs: Iterable[Rung],
    known: Mapping[str, truths.Known],
    budget_s: float,
    kept: Kept,
    progress: Progress,
) -> list[Point]:
    """Every setting in turn."""
    rungs = tuple(rungs)
    points = []
    for number, rung in enumerate(rungs):
        progress(number / len(rungs), f"hcm, {rung.study}, {rung.setting}")
        measure_it = partial(measure, rung, known[rung.study].values, budget_s)
        points.append(kept.point("hcm", rung, measure_it, truth=asdict(known[rung.study].values)))
    return points
