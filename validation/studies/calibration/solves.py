"""A random scene solved at the fixed settings, with estimates, and the same solved tightly.

The tight solve is defined here for each model.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import hcm
from validation.errors import RunFailedError, UserError
from validation.harness.interrupts import unless_interrupted
from validation.harness.record import RunRecord
from validation.models import adapter, estimate_override, solid_inputs, solid_mesh
from validation.models.adapter import to_record
from validation.models.hcm import hcm_scene
from validation.models.impact import impact_of
from validation.scenes.load import NamedScene, load_scene
from validation.scenes.scene import Scene
from validation.studies.calibration.scenes import AFTER_S, RandomTap
from validation.studies.stated_errors import StatedError, true_errors

# Of the reduced model: tolerances are divided and elements multiplied by these factors.
TOLERANCES, ELEMENTS = 100.0, 2
MOST_STEPS = 2_000_000
# If it has an accuracy: that is divided by the first of these that `MOST_BENT` allows, and the
# elements that this asks for are multiplied by FINER, in flight and in contact.
WITHIN, FINER = (10.0, 3.0), 1.5
# Predicted elements times steps of the tight flight beyond which a scene is left out: some 5 s.
MOST_BENT = 2e6
# Of the solid: accuracy for which the tight mesh is sized, 0.3 of the fixed settings' error, and
# its largest share of an accuracy that the run must keep.
TIGHT_SOLID, TIGHT_SHARE = 3e-3, 0.3
# Predicted element updates of the tight tap beyond which a solid's scene is left out: some 10 s.
MOST_UPDATES, LONG = 5e7, "LEFT OUT"

Solve = Callable[[], RunRecord]


@dataclass(frozen=True)
class Solved:
    """One scene's outcome, as the line store keeps it.

    status, tight_status : of both solves. caution, tight_caution : their messages.
    numbers : by quantity. seconds : of the run without its estimates, and of the tight solve.
    expected : the relative error that a run held to an accuracy says it has.
    """

    status: str
    tight_status: str
    caution: str
    numbers: dict[str, StatedError]
    seconds: tuple[float, float]
    tight_caution: str = ""
    expected: float | None = None


def solve_case(case: RandomTap) -> Solved:
    """Solve a scene twice; one that is refused, left out or does not complete has no numbers."""
    try:
        scene = load_scene("soft", case.overrides)
        solve_tightly = _tight_beams(scene, case) if case.model == "hcm" else _tight_solid(case)
        if solve_tightly is None:
            return Solved(LONG, "", "", {}, (0.0, 0.0))
        start = time.perf_counter()
        run = unless_interrupted(adapter(case.model).run(scene).record)
        middle = time.perf_counter()
        if not run.ok:
            return Solved(run.status, "", run.message, {}, (middle - start, 0.0))
        tight = solve_tightly()
    except (UserError, RunFailedError, hcm.ParameterError) as refusal:
        return Solved("REFUSED", "", str(refusal), {}, (0.0, 0.0))
    seconds = float(run.summary["wall_time_s"]), time.perf_counter() - middle
    numbers = true_errors(run.summary, run.errors, tight.summary) if tight.ok else {}
    expected = run.accuracy.get("expected")
    return Solved(run.status, tight.status, run.message, numbers, seconds, tight.message, expected)


def _updates(tables: Scene, kind: str) -> float:
    """Predicted elements times steps of the tight tap, for the half model.

    Contact lasts 2.94 δ/v (Johnson, Contact Mechanics, 11.4.1), or `AFTER_S` with further taps; a
    step is the time of a wave through half the smallest edge.
    """
    import meshes

    try:
        sizing, touch = solid_mesh.sizing_of(tables, 3)
    except ValueError as error:
        raise UserError(str(error)) from error
    if touch is None:
        return 0.0
    geometry = solid_inputs.finger_geometry(tables)
    material = solid_inputs.solid_parts(tables).materials[-1]
    stays = 2.94 * touch.patch_radius**2 / geometry.radii[-1] / max(touch.speed, 1e-9)
    if kind == "three taps":
        stays = max(stays, AFTER_S)
    nu = material.poisson_ratio
    modulus = material.youngs_modulus * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu))
    step = 0.5 * min(sizing.tip_size, sizing.section_size) / math.sqrt(modulus / material.density)
    return meshes.count_elements(geometry, sizing, 3) * stays / step


def _tight_solid(case: RandomTap) -> Solve | None:
    tight = min(TIGHT_SOLID, TIGHT_SHARE * (case.accuracy or 1.0))
    held = f"solver.fem.accuracy={tight:.3g}"
    scene = load_scene("soft", (*case.overrides, held, *estimate_override(case.model)))
    if _updates(scene.tables, case.kind) > MOST_UPDATES:
        return None
    return lambda: unless_interrupted(adapter(case.model).run(scene).record)


def _tight_beams(scene: NamedScene, case: RandomTap) -> Solve | None:
    given = hcm_scene(scene, estimate=False)
    if case.accuracy is None:
        s = given.settings
        flight, contact = s.flight_tolerance / TOLERANCES, s.contact_tolerance / TOLERANCES
        tight = _finer(given, ELEMENTS, flight_tolerance=flight, contact_tolerance=contact)
    else:
        tight = _within(scene, given, case.accuracy)

    def solve() -> RunRecord:
        return to_record(unless_interrupted(hcm.simulate_scene(tight)), scene, "hcm")

    return solve if tight is not None else None


def _within(scene: NamedScene, given: Any, accuracy: float) -> Any:
    """The scene with settings for a tenth of the accuracy, an elastic flight and finer elements.

    For a third of it if the first's flight is beyond `MOST_BENT`; None if both are. The accuracy
    asked for is at least `hcm.SMALLEST`. Raises RunFailedError: the surface is not reached.
    """
    lasts = impact_of(scene).time_s
    for share in WITHIN:
        smaller = max(accuracy / share, hcm.SMALLEST)
        chosen = hcm.settings_for(smaller, given, {"flight": "elastic"}).scene
        s = chosen.settings
        tight = _finer(
            chosen,
            FINER,
            flight_elements=math.ceil(FINER * s.flight_elements),
            flight_step=s.flight_step / ELEMENTS,
            contact_step=s.contact_step / ELEMENTS,
            end_time=None,
        )
        elements = sum(p.elements for p in tight.finger.phalanges)
        if elements * lasts / tight.settings.flight_step <= MOST_BENT:
            return tight
    return None


def _finer(given: Any, factor: float, **changes: Any) -> Any:
    """The scene's first tap with that many times the elements, and changed settings."""
    settings = replace(given.settings, max_steps=MOST_STEPS, taps=1, **changes)
    more = [replace(p, elements=math.ceil(factor * p.elements)) for p in given.finger.phalanges]
    return replace(given, finger=hcm.Finger(tuple(more)), settings=settings)
