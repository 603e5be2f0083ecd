"""Tables of single runs: accuracy against cost, and the contact patch beside Hertz's."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from validation.compare.differences import error_percent
from validation.harness.quantities import OF_A_TAP
from validation.harness.record import RunRecord
from validation.models import solid_inputs
from validation.scenes.load import read_scene
from validation.validate.plan import DEFAULT, FAST, PLANE, REDUCED, REFERENCE, Runs

NAMES = {REDUCED: "hcm, the paper's k"}


@dataclass(frozen=True)
class AccuracyCost:
    """One model: what it takes, and how far its peak, impulse and duration are off."""

    scene: str
    model: str
    wall_time_s: float | None
    peak_N: float | None
    peak_percent: float | None
    impulse_percent: float | None
    duration_percent: float | None


@dataclass(frozen=True)
class ContactPatch:
    """At the largest sampled force: radius of the circle of that area, largest nodal pressure."""

    scene: str
    model: str
    force_N: float
    radius_um: float
    hertz_radius_um: float
    pressure_MPa: float
    hertz_pressure_MPa: float


def _cost(name: str, run: RunRecord, best: RunRecord) -> AccuracyCost:
    shares = [error_percent(entry.read(run), entry.read(best)) for entry in OF_A_TAP]
    time, peak = run.value("wall_time_s"), run.value("peak_normal_force_N")
    return AccuracyCost(run.scene, name, time, peak, *shares)


def accuracy_against_cost(
    runs: Runs, predictions: Sequence[RunRecord], best: Sequence[RunRecord]
) -> list[AccuracyCost]:
    """All models of every scene that has a best run of the reference, cheapest first.

    Parameters
    ----------
    predictions : the reduced model's runs with identified k and eta^2.
    best : rung 3's finest reference runs, from their own flight.
    """
    rows = []
    for reference in best:
        scene = reference.scene
        several = [
            (NAMES.get(which, " ".join(which)), run)
            for which in (REDUCED, PLANE, FAST, REFERENCE, DEFAULT)
            if (run := runs.find(scene, which)) is not None
        ]
        several += [("hcm, identified k", run) for run in predictions if run.scene == scene]
        several.append((f"fem3d {reference.variant}", reference))
        found = [_cost(name, run, reference) for name, run in several]
        rows += sorted(found, key=lambda row: row.wall_time_s or 0.0)
    return rows


def contact_patch(run: RunRecord) -> ContactPatch | None:
    """Patch of a run at its peak force; None for one that has no pressure.

    Hertz at the same force, a sphere on a rigid plane: p_0 = 3 F/(2π a²) (Johnson, Contact
    Mechanics, eq. 4.24).
    """
    from reference_fem.hertz import hertz_contact_radius

    history = run.history
    if not {"contact_area_m2", "peak_pressure_Pa", "normal_force_N"} <= history.keys():
        return None
    top = int(history["normal_force_N"].argmax())
    force, area = (float(history[k][top]) for k in ("normal_force_N", "contact_area_m2"))
    tables = read_scene(run.provenance["scene_toml"], run.scene)
    materials, *_ = solid_inputs.inputs(tables)
    radius = 0.5 * tables.per_phalanx(tables.finger.diameter)[-1]
    hertz = hertz_contact_radius(materials[-1], radius, force)
    return ContactPatch(
        run.scene,
        run.label,
        force,
        1e6 * math.sqrt(area / math.pi),
        1e6 * hertz,
        1e-6 * float(history["peak_pressure_Pa"][top]),
        1e-6 * 1.5 * force / (math.pi * hertz**2) if hertz else 0.0,
    )


def contact_patches(
    runs: Runs, best: Sequence[RunRecord], scenes: Sequence[str]
) -> list[ContactPatch]:
    """Of the three-dimensional presets and of rung 3's finest run, by scene."""
    rows = []
    for scene in scenes:
        several = runs.several(scene, (FAST, REFERENCE, DEFAULT))
        several += [run for run in best if run.scene == scene]
        rows += [found for run in several if (found := contact_patch(run)) is not None]
    return rows
