"""The reference's work-precision ladders on the soft scene, from rest: mesh, penalty, step.

Each ladder changes what its name says. Flight is the reference's own rigid chain, so that a run's
time is that of the contact and of setting it up; the mesh is not charged.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from validation.compare.tap_errors import TapQuantities, tap_errors
from validation.converge.refinements import ROOT, mesh_sizes
from validation.harness.timing import shortest
from validation.models.solid import Dimension, build_mesh, inputs
from validation.scenes.load import load_scene
from validation.studies.bench.kept import Kept
from validation.studies.bench.measured import Point
from validation.studies.bench.reference_truths import KNOWN

Overrides = Mapping[str, float | str]
DIMENSIONS: Mapping[str, Dimension] = {"fem3d": 3, "fem2d": 2}
IMPULSE: Overrides = {"solver.fem.contact": "impulse"}
SHAFT = 2.0  # in units of `ladders`: 1.5 mm, which the truths show to be fine enough
UNSTABLE = 1.2  # a step beyond stability: its failure belongs to the picture
LEAST_RUNS = 2
# The dearest runs of a full benchmark take half a minute: two of each are enough.
BUDGET_S = 2.0


@dataclass(frozen=True)
class Rung:
    """One setting of a solid model; ``series`` says what its ladder changes."""

    model: str
    series: str
    setting: str
    overrides: Overrides

    def scene(self) -> Any:
        """The soft scene with it."""
        texts = [f"{k}={v!r}" if isinstance(v, float) else f"{k}={v}"
                 for k, v in self.overrides.items()]  # fmt: skip
        return load_scene("soft", texts)


def _tip(tip: float) -> Overrides:
    """`ladders`' tip at this refinement: its edge and the growth behind it."""
    return {**IMPULSE, **mesh_sizes(1.0, SHAFT, tip)}


def ladders(model: str, quick: bool) -> tuple[Rung, ...]:
    """All settings of a model; `quick` leaves out what takes more than a second or two."""
    plane = model == "fem2d"
    tips = [2 * ROOT, 2.0] if quick and not plane else [2 * ROOT, 2.0, ROOT, 1.0]
    if plane and not quick:
        tips += [1 / ROOT, 0.5]
    factors = [100.0, 1000.0] if quick else [30.0, 100.0, 300.0, 1000.0, 3000.0]
    nodal = [0.02, 0.1, 0.5, 2.0]
    # The reference's explicit step on the mesh that is cheap enough for three of them.
    base = _tip(1.0) if plane else _tip(2.0)
    surface = {**base, "solver.fem.contact": "surface"}
    steps = [0.9, 0.45] if quick else [0.9, 0.45, 0.225]
    presets = ["fast", "ls-dyna-like"]
    rungs = [
        Rung(model, "presets, nodal penalty", preset, {"solver.fem.preset": preset})
        for preset in presets
    ]
    rungs += [Rung(model, "mesh, impulses", f"tip {0.1 * tip:.3g} mm", _tip(tip)) for tip in tips]
    rungs += [
        Rung(model, "nodal penalty, fast", f"factor {f:g}", {"solver.fem.penalty_factor": f})
        for f in nodal
    ]
    rungs += [
        Rung(model, "surface penalty", f"factor {f:g}", {**surface, "solver.fem.surface_factor": f})
        for f in factors
    ]
    rungs += [
        Rung(model, "step, impulses", f"{s:g} of the stable step",
             {**base, "solver.fem.step_factor": s})
        for s in steps
    ]  # fmt: skip
    rungs.append(
        Rung(model, "step, impulses", f"{UNSTABLE:g} of the stable step: unstable",
             {"solver.fem.step_factor": UNSTABLE})
    )  # fmt: skip
    return tuple(rungs)


def quantities(result: Any) -> TapQuantities | None:
    """What a run found; None if it has no complete contact. The turn is where F_n is largest."""
    summary = result.summary
    values = (summary.contact_time_s, summary.peak_normal_force_time_s,
              summary.contact_duration_s, summary.peak_normal_force_N,
              summary.normal_impulse_N_s)  # fmt: skip
    if result.status.name != "COMPLETED" or None in values:
        return None
    return TapQuantities(*map(float, values))


def measure(rung: Rung, budget_s: float, least: int = LEAST_RUNS) -> Point:
    """Time a setting and compare it with its model's truth."""
    import reference_fem

    scene = rung.scene()
    mesh = build_mesh(scene.tables, DIMENSIONS[rung.model])
    solid = inputs(scene.tables)
    timed = shortest(lambda: reference_fem.simulate(mesh, *solid), budget_s, least, warm_up=False)
    result = timed.result
    found = quantities(result)
    return Point(
        rung.model,
        rung.model,
        rung.series,
        f"{rung.setting}, {result.summary.elements} elements",
        result.status.name,
        timed.wall_time_s,
        timed.runs,
        result.summary.steps,
        None if found is None else tap_errors(found, KNOWN[rung.model].values),
    )


def measure_all(
    rungs: Iterable[Rung], kept: Kept, progress: Callable[[float, str], None]
) -> list[Point]:
    """Every setting in turn, after a warm-up of each model."""
    rungs = tuple(rungs)
    points: list[Point] = []
    warm: set[str] = set()
    for number, rung in enumerate(rungs):
        progress(number / len(rungs), f"{rung.model}, {rung.series}, {rung.setting}")

        def fresh(rung: Rung = rung) -> Point:
            if rung.model not in warm:
                warm.add(rung.model)
                measure(rung, 0.0, 1)
            return measure(rung, BUDGET_S)

        points.append(kept.point(rung.model, rung, fresh))
    return points
