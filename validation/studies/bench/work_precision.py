"""Work-precision: settings of a solver, each timed and compared with a truth.

A `Solver` says how a solver makes a run of a setting, and how a run's result is read.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any

import hcm
import reference_fem
from validation.compare.tap_errors import TapErrors, TapQuantities, tap_errors
from validation.harness.console import say
from validation.harness.identity import program
from validation.harness.provenance import now
from validation.harness.store import Store
from validation.harness.timing import LEAST_RUNS, Timed, shortest
from validation.models import adapter
from validation.models.adapter import Progress
from validation.models.hcm import hcm_scene
from validation.models.solid_inputs import DIMENSIONS, solid_parts
from validation.models.solid_mesh import build_mesh, flight_mesh
from validation.scenes.load import load_scene
from validation.studies.bench.truths import TRUTHS

Options = Mapping[str, int | float | str]


@dataclass(frozen=True)
class Setting:
    """One setting of one solver on the soft scene.

    study : which truth its errors are taken against
    solver : a model, or a peer
    series : what the settings of its series change
    name : what is set, for the table
    options : the scene's keys, and other options of the solver
    """

    study: str
    solver: str
    series: str
    name: str
    options: Options

    def overrides(self) -> tuple[str, ...]:
        """The scene's keys as the command line writes them."""
        return tuple(f"{key}={value}" for key, value in self.options.items() if "." in key)


@dataclass(frozen=True)
class Solution:
    """A setting's result; `tap` is None if it is not complete, `detail` adds to the name."""

    status: str
    tap: TapQuantities | None
    steps: int | None = None
    detail: str = ""


@dataclass(frozen=True)
class Solver:
    """How settings are run.

    prepare : everything that is not timed; returns the run.
    read : turns a run's result into a `Solution`.
    warm_up_each : whether every setting runs once unmeasured, or only the first of its solver.
    """

    prepare: Callable[[Setting], Callable[[], Any]]
    read: Callable[[Any], Solution]
    least_runs: int = LEAST_RUNS
    warm_up_each: bool = True


@dataclass(frozen=True)
class Point:
    """One setting of one solver, measured. A run that failed has a status but no errors.

    measured : when. read_back : whether an earlier benchmark measured it.
    """

    study: str
    solver: str
    series: str
    setting: str
    status: str
    wall_time_s: float
    runs: int
    steps: int | None = None
    errors: TapErrors | None = None
    measured: str = ""
    read_back: bool = False

    @property
    def ok(self) -> bool:
        """Whether there is a time and an error to draw."""
        return self.errors is not None and math.isfinite(self.wall_time_s)


def simulation(model: str, overrides: Sequence[str]) -> partial[Any]:
    """A model's solve of the soft scene, with all preparation (mesh, translation) done."""
    scene = load_scene("soft", overrides)
    if model == "hcm":
        return partial(hcm.simulate_scene, hcm_scene(scene, estimate=False))

    mesh, light = (make(scene.tables, DIMENSIONS[model]) for make in (build_mesh, flight_mesh))
    return partial(reference_fem.simulate, mesh, *solid_parts(scene.tables), flight_mesh=light)


def complete_tap(result: Any, turn_s: float | None) -> TapQuantities | None:
    """The tap of a model's run; None if the run or its contact is not complete.

    turn_s : end of compression since first contact; None if there is none.
    """
    summary = result.summary
    values = (
        summary.contact_time_s, turn_s, summary.contact_duration_s,
        summary.peak_normal_force_N, summary.normal_impulse_N_s,
    )  # fmt: skip
    if result.status.name != "COMPLETED" or None in values:
        return None
    return TapQuantities(*map(float, values))


def measure_setting(
    setting: Setting, solver: Solver, budget_s: float, warm_up: bool = True
) -> Timed[Solution]:
    """Time a setting for at least `budget_s`, in s, and read its last run."""
    timed = shortest(solver.prepare(setting), budget_s, solver.least_runs, warm_up)
    return Timed(solver.read(timed.result), timed.wall_time_s, timed.runs)


def point_against(
    truth: TapQuantities, setting: Setting, timed: Timed[Solution], study: str = ""
) -> Point:
    """A setting's point; `study` : if the truth is not that of the setting's own study."""
    solution = timed.result
    return Point(
        study or setting.study, setting.solver, setting.series, setting.name + solution.detail,
        solution.status, timed.wall_time_s, timed.runs, solution.steps,
        None if solution.tap is None else tap_errors(solution.tap, truth), now(),
    )  # fmt: skip


def measure_settings(
    settings: Sequence[Setting], solver: Solver, budget_s: float, store: Store, progress: Progress
) -> list[Point]:
    """Measure every setting in turn against its study's truth.

    A point is stored under its setting, its truth, how long it is repeated, and the program and
    machine that measured it.
    """
    warm: set[str] = set()

    def measured(setting: Setting) -> Point:
        first = setting.solver not in warm
        warm.add(setting.solver)
        timed = measure_setting(setting, solver, budget_s, solver.warm_up_each or first)
        return point_against(TRUTHS[setting.study].values, setting, timed)

    points = list[Point]()
    for number, setting in enumerate(settings):
        progress(number / len(settings), f"{setting.solver}, {setting.series}, {setting.name}")
        model = adapter(setting.solver)
        inputs = {
            "point": asdict(setting),
            "truth": asdict(TRUTHS[setting.study].values),
            "budget_s": budget_s,
            "program": program(
                *model.sources, solver.prepare.__module__, without=model.independent_of
            ),
        }
        found = store.find(inputs, Point)
        points.append(
            replace(found, read_back=True) if found
            else store.obtain(inputs, Point, partial(measured, setting))
        )  # fmt: skip
    if read_back := sum(point.read_back for point in points):
        say(f"{read_back} settings were measured by an earlier benchmark")
    return points


def front(points: Sequence[Point], quantity: str) -> list[tuple[float, float]]:
    """Time and error of the settings that no other beats in both, by increasing time."""
    found: list[tuple[float, float]] = []
    pairs = sorted((p.wall_time_s, float(getattr(p.errors, quantity))) for p in points if p.ok)
    for time, error in pairs:
        if not found or error < found[-1][1]:
            found.append((time, error))
    return found


def table(points: Sequence[Point]) -> list[dict[str, Any]]:
    """One row per point."""
    names = {"peak": "peak_error", "impulse": "impulse_error", "duration": "duration_error",
             "event_s": "event_error_s"}  # fmt: skip
    return [
        {
            **{key: value for key, value in vars(point).items() if key != "errors"},
            **{title: getattr(point.errors, name, None) for name, title in names.items()},
            "read_back": point.read_back or None,
        }
        for point in points
    ]
