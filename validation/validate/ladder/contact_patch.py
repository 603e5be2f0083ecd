"""Contact patch and pressure of the reference at its peak force, beside Hertz's."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from validation.harness.record import RunRecord
from validation.scenes.load import load_scene
from validation.validate.plan import FAST, REFERENCE, Runs


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


COLUMNS = tuple(ContactPatch.__annotations__)


def contact_patch(run: RunRecord) -> ContactPatch | None:
    """Patch of a run; None for one that has no pressure.

    Hertz at the same force, a sphere on a rigid plane: a³ = 3 F R/(4 E*), p_0 = 3 F/(2π a²),
    E* = E/(1 - ν²) (Johnson, Contact Mechanics, eqs. 4.22 and 4.24).
    """
    history = run.history
    if not {"contact_area_m2", "peak_pressure_Pa", "normal_force_N"} <= history.keys():
        return None
    top = int(history["normal_force_N"].argmax())
    force, area = (float(history[k][top]) for k in ("normal_force_N", "contact_area_m2"))
    tables = load_scene(run.scene).tables
    modulus, ratio, diameter = (
        tables.per_phalanx(values)[-1]
        for values in (
            tables.material.youngs_modulus,
            tables.material.poisson_ratio,
            tables.finger.diameter,
        )
    )
    plane = modulus / (1 - ratio**2)
    hertz = (0.75 * force * 0.5 * diameter / plane) ** (1 / 3)
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
        several = runs.several(scene, (FAST, REFERENCE))
        several += [run for run in best if run.scene == scene]
        rows += [found for run in several if (found := contact_patch(run)) is not None]
    return rows
