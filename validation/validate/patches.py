"""Rows of the table of contact patches, beside Hertz's."""

import math
import tomllib
from collections.abc import Sequence

from validation.harness.record import RunRecord
from validation.models import solid_inputs
from validation.scenes.load import validate
from validation.validate import plan
from validation.validate.plan import Runs
from validation.validate.tables import Row

# At the largest sampled force: radius of the circle of that area, largest nodal pressure.
PATCH_COLUMNS = ("scene", "model", "force_N", "radius_um", "hertz_radius_um", "pressure_MPa",
                 "hertz_pressure_MPa")  # fmt: skip


def contact_patch(run: RunRecord) -> Row | None:
    """A row on a run's contact patch at its peak force; None if the run has no pressure.

    Beside it Hertz's sphere on a rigid plane at the same force: p_0 = 3 F/(2π a²) (Johnson, Contact
    Mechanics, eq. 4.24).
    """
    from reference_fem.contact.hertz import hertz_contact_radius

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
        several = runs.find_all(scene, (plan.FAST, plan.PAPER_REFERENCE, plan.DEFAULT_REFERENCE))
        several += [run for run in best if run.scene == scene]
        rows += [found for run in several if (found := contact_patch(run)) is not None]
    return rows
