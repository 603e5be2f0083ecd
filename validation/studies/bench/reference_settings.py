"""The reference's settings on the soft scene, from rest: mesh, penalty, step.

Each series changes what its name says. Flight is the reference's own rigid chain, so that a run's
time is that of the contact and of setting it up; meshing is not timed.
"""

from typing import Any

from validation.compare.tap_errors import TapQuantities
from validation.converge.refinements import ROOT, mesh_sizes
from validation.studies.bench.work_precision import (
    Options,
    Setting,
    Solution,
    Solver,
    complete_tap,
    simulation,
)

FAST: Options = {"solver.fem.preset": "fast"}
IMPULSE: Options = {"solver.fem.contact": "impulse"}
SHAFT = 2.0  # in units of `mesh_sizes`: 1.5 mm, which the truths show to be fine enough
UNSTABLE = 1.2  # a step beyond stability, included to show its failure
FAILS = f"{UNSTABLE:g} of the stable step: unstable"
BUDGET_S = 2.0  # the longest runs of a full benchmark take half a minute: two of each are enough


def impulse_mesh(shaft: float, tip: float) -> Options:
    """Contact by impulses, with edges of 0.1 mm times `tip` there and their growth behind it."""
    return {**IMPULSE, **mesh_sizes(1.0, shaft, 1e-4 * tip, 1.25**tip)}


def reference_settings(model: str, quick: bool) -> list[Setting]:
    """All settings of a model; `quick` leaves out what takes more than a second or two."""
    plane = model == "fem2d"
    tips = [2 * ROOT, 2.0] if quick and not plane else [2 * ROOT, 2.0, ROOT, 1.0]
    if plane and not quick:
        tips += [1 / ROOT, 0.5]
    factors = [100.0, 1000.0] if quick else [30.0, 100.0, 300.0, 1000.0, 3000.0]
    # The mesh of the steps' and surface penalties' series: cheap enough for three steps.
    base = impulse_mesh(SHAFT, 1.0) if plane else impulse_mesh(SHAFT, 2.0)
    surface = {**base, "solver.fem.contact": "surface"}
    steps = [0.9, 0.45] if quick else [0.9, 0.45, 0.225]
    step = "solver.fem.step_factor"
    cases: list[tuple[str, str, Options]] = [
        *(
            ("presets", preset, {"solver.fem.preset": preset})
            for preset in ("contact", "fast", "ls-dyna-like")
        ),
        *(("mesh, impulses", f"tip {0.1 * tip:.3g} mm", impulse_mesh(SHAFT, tip)) for tip in tips),
        *(
            ("nodal penalty, fast", f"factor {f:g}", {**FAST, "solver.fem.penalty_factor": f})
            for f in (0.02, 0.1, 0.5, 2.0)
        ),
        *(
            ("surface penalty", f"factor {f:g}", {**surface, "solver.fem.surface_factor": f})
            for f in factors
        ),
        *(("step, impulses", f"{s:g} of the stable step", {**base, step: s}) for s in steps),
        ("step, impulses", FAILS, {**FAST, step: UNSTABLE}),
    ]
    return [Setting(model, model, *case) for case in cases]


def solid_tap(result: Any) -> TapQuantities | None:
    """A run's tap; None if it has no complete contact. The turn is where F_n is largest."""
    return complete_tap(result, result.summary.peak_normal_force_time_s)


def _read(result: Any) -> Solution:
    summary = result.summary
    elements = f", {summary.elements} elements"
    return Solution(result.status.name, solid_tap(result), summary.steps, elements)


REFERENCE_SOLVER = Solver(
    lambda setting: simulation(setting.solver, setting.overrides()),
    _read,
    least_runs=2,
    warm_up_each=False,
)
