"""Tables of runs: the reference against itself, accuracy against cost, the patch beside Hertz's."""

import math
import tomllib
from collections.abc import Sequence
from typing import Any

from validation.compare.differences import error_percent
from validation.harness.quantities import OF_A_TAP, quantity
from validation.harness.record import RunRecord
from validation.models import solid_inputs
from validation.scenes.load import load_scene, validate
from validation.validate.ladder.runs import LadderRuns, full_contact
from validation.validate.plan import (
    DEFAULT_REFERENCE,
    FAST,
    HOLES,
    NO_FEM_ACCURACY,
    PAPER_REDUCED,
    PAPER_REFERENCE,
    PLANE,
    Runs,
)

RUN_LABELS = {PAPER_REDUCED: "hcm, the paper's k"}
PERCENT = ("peak_percent", "impulse_percent", "duration_percent")  # of OF_A_TAP, from another run
CHECK_COLUMNS = ("scene", "change", "mesh", "peak_N", "changed_peak_N", *PERCENT,
                 "contact_time_percent")  # fmt: skip
COST_COLUMNS = ("scene", "model", "wall_time_s", "peak_N", *PERCENT)
# At the largest sampled force: radius of the circle of that area, largest nodal pressure.
PATCH_COLUMNS = ("scene", "model", "force_N", "radius_um", "hertz_radius_um", "pressure_MPa",
                 "hertz_pressure_MPa")  # fmt: skip
Row = dict[str, Any]  # by the names of its table's columns; None where a run has no such number


def _percent(run: RunRecord, base: RunRecord) -> Row:
    """How far a run's peak, impulse and duration are from another's, percent."""
    shares = (error_percent(entry.read(run), entry.read(base)) for entry in OF_A_TAP)
    return dict(zip(PERCENT, shares, strict=True))


def _check(change: str, mesh: str, as_it_is: RunRecord, changed: RunRecord) -> Row:
    """A row on the effect of one of the reference's choices on its own results, on one mesh."""
    peak, arrival = OF_A_TAP[0], quantity("contact_time_s")
    later = error_percent(arrival.read(changed), arrival.read(as_it_is))
    return {
        "scene": as_it_is.scene,
        "change": change,
        "mesh": mesh,
        "peak_N": peak.read(as_it_is),
        "changed_peak_N": peak.read(changed),
        **_percent(changed, as_it_is),
        "contact_time_percent": later,
    }


def shaft_holes(runs: Runs) -> list[Row]:
    """Rows that compare joints at shaft holes' surfaces, as in the paper, with plain hinges."""
    rows = []
    for scene in runs.scenes:
        plain, holed = runs.find(scene, PAPER_REFERENCE), runs.find(scene, HOLES)
        if plain is not None and holed is not None:
            change = "shaft holes instead of plain hinges"
            rows.append(_check(change, PAPER_REFERENCE.variant, plain, holed))
    return rows


def explicit_flight(source: str, runs: LadderRuns) -> Row:
    """A row that compares a fall in explicit steps with the start from a rigid flight."""
    fast = "solver.fem.preset=fast", NO_FEM_ACCURACY
    rigid = runs.obtain(full_contact, load_scene(source, fast), None, "fast")
    scene = load_scene(source, (*fast, "solver.fem.flight=explicit"))
    whole = runs.obtain(full_contact, scene, None, "fast, explicit flight")
    change = f"whole event by {whole.value('steps') or 0:,.0f} explicit steps"
    return _check(f"{change} instead of a rigid flight", "fast", rigid, whole)


def accuracy_against_cost(
    runs: Runs, predictions: Sequence[RunRecord], best: Sequence[RunRecord]
) -> list[Row]:
    """Rows of all models on every scene with a best run of the reference, cheapest first.

    predictions : the reduced model's runs with identified k and eta^2.
    best : rung 3's finest reference runs, from their own flight.
    """
    rows = []
    for reference in best:
        scene = reference.scene
        several = [
            (RUN_LABELS.get(which, " ".join(which)), run)
            for which in (PAPER_REDUCED, PLANE, FAST, PAPER_REFERENCE, DEFAULT_REFERENCE)
            if (run := runs.find(scene, which)) is not None
        ]
        several += [("hcm, identified k", run) for run in predictions if run.scene == scene]
        several.append((f"fem3d {reference.variant}", reference))
        found = [
            {
                "scene": scene,
                "model": name,
                "wall_time_s": run.value("wall_time_s"),
                "peak_N": run.value("peak_normal_force_N"),
                **_percent(run, reference),
            }
            for name, run in several
        ]
        rows += sorted(found, key=lambda row: row["wall_time_s"] or 0.0)
    return rows


def contact_patch(run: RunRecord) -> Row | None:
    """A row on a run's contact patch at its peak force; None if the run has no pressure.

    Beside it Hertz's sphere on a rigid plane at the same force: p_0 = 3 F/(2π a²) (Johnson, Contact
    Mechanics, eq. 4.24).
    """
    from reference_fem.hertz import hertz_contact_radius

    history = run.history
    if not {"contact_area_m2", "peak_pressure_Pa", "normal_force_N"} <= history.keys():
        return None
    top = int(history["normal_force_N"].argmax())
    force, area = (float(history[k][top]) for k in ("normal_force_N", "contact_area_m2"))
    tables = validate(tomllib.loads(run.provenance["scene_toml"]), run.scene)
    materials = solid_inputs.solid_parts(tables).materials
    hertz = hertz_contact_radius(materials[-1], tables.tip_radius, force)
    return {
        "scene": run.scene,
        "model": run.label,
        "force_N": force,
        "radius_um": 1e6 * math.sqrt(area / math.pi),
        "hertz_radius_um": 1e6 * hertz,
        "pressure_MPa": 1e-6 * float(history["peak_pressure_Pa"][top]),
        "hertz_pressure_MPa": 1e-6 * 1.5 * force / (math.pi * hertz**2) if hertz else 0.0,
    }


def contact_patches(runs: Runs, best: Sequence[RunRecord]) -> list[Row]:
    """Rows on the contact patches of the 3D presets and of rung 3's finest run, by scene."""
    rows = []
    for scene in runs.scenes:
        several = runs.find_all(scene, (FAST, PAPER_REFERENCE, DEFAULT_REFERENCE))
        several += [run for run in best if run.scene == scene]
        rows += [found for run in several if (found := contact_patch(run)) is not None]
    return rows
