"""hcm's settings on the soft scene: the whole tap from rest, and the contact alone.

The tap's truth has hcm's own five elements a phalanx, so that its series show the error of time
integration. The contact's series of elements is measured against 20 elements a phalanx.

The contact is also solved by another integrator: Runge-Kutta of order 8 (`hcm.reference_solution`),
the same beams, contact law and event functions in minimal coordinates and in SciPy's Python loop.
Its time against generalized-alpha's is that of the whole program, not of the method alone.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import hcm
from validation.compare.tap_errors import TapQuantities
from validation.models.hcm import hcm_scene
from validation.scenes.load import load_scene
from validation.studies.bench.hcm_truth import impact_start, solve_impact
from validation.studies.bench.truths import TAP_ELEMENTS
from validation.studies.bench.work_precision import Options, Setting, Solution, Solver

# `hcm.Settings`: error control in flight and contact; each series changes what its name says.
BASE: Options = {
    "flight_step": 1e-3,
    "flight_tolerance": 1e-6,
    "contact_step": 1e-5,
    "contact_tolerance": 1e-9,
}
FIXED: Options = {"flight_tolerance": 0, "contact_tolerance": 0}
GAUSS: Options = {"flight_integrator": "gauss", "newton_tolerance": 1e-7, "spectral_radius": 1.0}
IMPACT_TOLERANCE = {"contact_step": 1e-5, "contact_tolerance": 1e-13, "newton_tolerance": 1e-11}


def hcm_setting(study: str, series: str, elements: int, *changes: Options) -> Setting:
    """A setting of elements per phalanx and of changes of hcm's defaults (later ones win)."""
    merged = {key: value for change in changes for key, value in change.items()}
    words = [f"{elements} elements"]
    words += [f"{key} {value if isinstance(value, str) else format(value, 'g')}"
              for key, value in merged.items()]  # fmt: skip
    solver = {f"solver.hcm.{key}": value for key, value in merged.items()}
    options = {"finger.elements": elements, **solver}
    return Setting(study, "hcm", series, ", ".join(words), options)


def tap_and_contact_settings(quick: bool) -> list[Setting]:
    """All settings of generalized-alpha and collocation; `quick` leaves out the costliest."""
    tap = partial(hcm_setting, "tap")
    tolerances = [(1e-4, 1e-7), (1e-5, 1e-8), (1e-6, 1e-9), (1e-7, 1e-10), (1e-8, 1e-11)]
    steps = [(1e-3, 1e-5), (3e-4, 3e-6), (1e-4, 1e-6), (3e-5, 3e-7)]
    counts = [1, 2, 3, 5, 10]
    # the loop with collocation is compiled separately, in half a minute: not for a quick look
    collocated: list[tuple[float, float]] = []
    if not quick:
        tolerances += [(1e-9, 1e-12), (1e-10, 1e-13)]
        steps += [(1e-5, 1e-7), (3e-6, 3e-8)]
        collocated += [(5e-4, 1e-6), (2e-4, 5e-7), (1e-4, 3e-7), (5e-5, 1e-7), (3e-5, 3e-8)]
        counts += [20, 40]
    n = TAP_ELEMENTS
    return [
        tap("default settings", n),
        *(
            tap("tolerances", n, BASE, {"flight_tolerance": f, "contact_tolerance": c})
            for f, c in tolerances
        ),
        *(tap("fixed steps", n, {"flight_step": f, "contact_step": c}, FIXED) for f, c in steps),
        *(
            tap("flight by Gauss collocation", n, GAUSS, FIXED,
                {"flight_step": f, "contact_step": c})
            for f, c in collocated
        ),
        *(
            tap("rigid flight", n, BASE,
                {"flight": "rigid", "flight_step": 1e-2, "contact_tolerance": c})
            for c in (1e-7, 1e-8, 1e-9, 1e-10)
        ),
        *(tap("xi", n, BASE, {"spectral_radius": xi}) for xi in (0.0, 0.4, 0.8, 0.9, 1.0)),
        *(tap("newton tolerance", n, BASE, {"newton_tolerance": t}) for t in (1e-3, 1e-5, 1e-7)),
        *(hcm_setting("contact", "elements", count, IMPACT_TOLERANCE) for count in counts),
    ]  # fmt: skip


def _prepare(setting: Setting) -> Callable[[], Any]:
    scene = hcm_scene(load_scene("soft", setting.overrides()), estimate=False)
    if setting.study == "contact":
        start = impact_start(scene.surface.height, scene.finger.phalanges[0].length)
        scene = replace(scene, start=start)
    return partial(hcm.simulate_scene, scene)


def _read(result: Any) -> Solution:
    summary, steps, tap = result.summary, result.statistics.steps, None
    turns = [e.time_s for e in result.events if e.kind == "compression_to_restitution"]
    if result.status.name == "COMPLETED" and summary.contact_duration_s is not None and turns:
        tap = TapQuantities(
            contact_time_s=summary.contact_time_s,
            turn_s=turns[0] - summary.contact_time_s,
            duration_s=summary.contact_duration_s,
            peak_normal_force_N=summary.peak_normal_force_N,
            normal_impulse_N_s=summary.normal_impulse_N_s,
        )
    return Solution(result.status.name, tap, steps)


HCM_SOLVER = Solver(_prepare, _read)


def dop853_settings(quick: bool) -> list[Setting]:
    """Settings of elements per phalanx and of the Runge-Kutta pair's relative tolerance."""
    pairs = [(n, rtol) for n in (3, TAP_ELEMENTS) for rtol in (1e-2, 1e-6)]
    return [
        Setting("contact", "hcm", "integrator: DOP853", f"{n} elements, rtol {rtol:g}",
                {"finger.elements": n, "rtol": rtol})
        for n, rtol in (pairs if quick else [*pairs, (10, 1e-6)])
    ]  # fmt: skip


def _prepare_dop853(setting: Setting) -> Callable[[], TapQuantities]:
    elements, rtol = (float(value) for value in setting.options.values())
    return partial(solve_impact, int(elements), rtol)


DOP853_SOLVER = Solver(_prepare_dop853, lambda found: Solution("COMPLETED", found))
