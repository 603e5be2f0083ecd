"""hcm's settings on the soft scene: the whole tap from rest, and the contact alone.

The tap's truth has hcm's own five elements a phalanx, so that its series show the error of time
integration. The contact's series of elements is measured against 20 elements a phalanx.

The contact is also solved by another integrator: Runge-Kutta of order 8 (`hcm.reference_solution`),
the same beams, contact law and event functions in minimal coordinates and in SciPy's Python loop.
Its time against generalized-alpha's is that of the whole program, not of the method alone.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any

import hcm
from hcm import reference_solution
from hcm.beam.chain import build_chain
from hcm.model import rigid_motion
from validation.compare.tap_errors import TapQuantities
from validation.models.hcm import hcm_scene
from validation.scenes.load import load_scene
from validation.studies.bench.truths import TAP_ELEMENTS
from validation.studies.bench.work_precision import Options, Setting, Solution, Solver, complete_tap

# `hcm.Settings`: error control in flight and contact; each series changes what its name says.
BASE: Options = {
    "flight_step": 1e-3,
    "flight_tolerance": 1e-6,
    "contact_step": 1e-5,
    "contact_tolerance": 1e-9,
}
GAUSS: Options = {
    "flight_integrator": "gauss", "newton_tolerance": 1e-7, "spectral_radius": 1.0,
    "flight_tolerance": 0, "contact_tolerance": 0,
}  # fmt: skip
IMPACT_TOLERANCE = {"contact_step": 1e-5, "contact_tolerance": 1e-13, "newton_tolerance": 1e-11}
# A rigid state like the one at impact: the paper's posture, the tip just above the surface.
IMPACT_ANGLES = (1.3089969389957472, 1.0471975511965976)  # rad below -X, phalanges 1 and 2
IMPACT_RATES = (12.0, 14.0, 40.0)  # rad/s
CLEARANCE = 1e-9  # m


def hcm_setting(study: str, series: str, elements: int, *changes: Options) -> Setting:
    """A setting of elements per phalanx and of changes of hcm's defaults (later ones win)."""
    merged = {key: value for change in changes for key, value in change.items()}
    words = [f"{elements} elements"]
    words += [f"{key} {value if isinstance(value, str) else format(value, 'g')}"
              for key, value in merged.items()]  # fmt: skip
    solver = {f"solver.hcm.{key}": value for key, value in merged.items()}
    options = {"finger.elements": elements, **solver}
    return Setting(study, "hcm", series, ", ".join(words), options)


def hcm_series(
    study: str, series: str, counts: Iterable[int], keys: str, rows: Iterable[Sequence[Any]],
    *base: Options,
) -> list[Setting]:  # fmt: skip
    """A setting of each number of elements per phalanx with each row of values of the `keys`.

    base : changes of hcm's defaults that all of them share.
    """
    changes = [dict(zip(keys.split(), row, strict=True)) for row in rows]
    return [hcm_setting(study, series, n, *base, change) for n in counts for change in changes]


def tap_and_contact_settings(quick: bool) -> list[Setting]:
    """All settings of generalized-alpha and collocation; `quick` leaves out the costliest."""
    tap, n = partial(hcm_series, "tap"), (TAP_ELEMENTS,)
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
    fixed = "flight_step contact_step flight_tolerance contact_tolerance"
    rigid = [("rigid", 1e-2, tolerance) for tolerance in (1e-7, 1e-8, 1e-9, 1e-10)]
    return [
        hcm_setting("tap", "default settings", TAP_ELEMENTS),
        *tap("tolerances", n, "flight_tolerance contact_tolerance", tolerances, BASE),
        *tap("fixed steps", n, fixed, [(*pair, 0, 0) for pair in steps]),
        *tap("flight by Gauss collocation", n, "flight_step contact_step", collocated, GAUSS),
        *tap("rigid flight", n, "flight flight_step contact_tolerance", rigid, BASE),
        *tap("xi", n, "spectral_radius", product((0.0, 0.4, 0.8, 0.9, 1.0)), BASE),
        *tap("newton tolerance", n, "newton_tolerance", product((1e-3, 1e-5, 1e-7)), BASE),
        *(hcm_setting("contact", "elements", count, IMPACT_TOLERANCE) for count in counts),
    ]


def _prepare(setting: Setting) -> Callable[[], Any]:
    scene = hcm_scene(load_scene("soft", setting.overrides()), estimate=False)
    if setting.study == "contact":
        scene = replace(scene, start=impact_start(scene))
    return partial(hcm.simulate_scene, scene)


def _read(result: Any) -> Solution:
    turns = [e.time_s for e in result.events if e.kind == "compression_to_restitution"]
    turn = turns[0] - result.summary.contact_time_s if turns else None
    return Solution(result.status.name, complete_tap(result, turn), result.statistics.steps)


HCM_SOLVER = Solver(_prepare, _read)


def impact_start(scene: hcm.Scene) -> hcm.RigidStart:
    """The rigid state from which the contact alone is solved."""
    length = scene.finger.phalanges[0].length
    upper = sum(length * math.sin(angle) for angle in IMPACT_ANGLES)
    last = math.asin((scene.surface.height - CLEARANCE - upper) / length)
    return hcm.RigidStart((*IMPACT_ANGLES, last), IMPACT_RATES)


def solve_tap(elements: int, rtol: float) -> TapQuantities:
    """Solve the tap from rest; takes minutes."""
    return _solve(soft_scene(elements), rtol)


def solve_impact(elements: int, rtol: float) -> TapQuantities:
    """Solve the contact alone, from `impact_start`: a second with 5 elements, half a minute, 20."""
    scene = soft_scene(elements)
    chain, _ = build_chain(scene.finger, scene.drive)
    motion = rigid_motion(scene.finger, chain, impact_start(scene))
    return _solve(scene, rtol, reference_solution.ChainStart(*motion))


def soft_scene(elements: int) -> hcm.Scene:
    """The soft scene with that many elements per phalanx."""
    return hcm_scene(load_scene("soft", (f"finger.elements={elements}",)), estimate=False)


def _solve(
    scene: hcm.Scene, rtol: float, start: reference_solution.ChainStart | None = None
) -> TapQuantities:
    of = scene.finger, scene.surface, scene.tip, scene.drive
    solved = reference_solution.solve(*of, rtol=rtol, atol=1e-4 * rtol, start=start)
    contact = solved.time_of("contact")
    return TapQuantities(
        contact_time_s=contact,
        turn_s=solved.time_of("compression_to_restitution") - contact,
        duration_s=solved.time_of("separation") - contact,
        peak_normal_force_N=solved.peak_normal_force_N,
        normal_impulse_N_s=solved.normal_impulse_N_s,
    )


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
