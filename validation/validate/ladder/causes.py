"""The experiment that names what separates the blind prediction from the reference."""

import math
from typing import Any

from validation.harness.quantities import OF_A_TAP
from validation.harness.record import RunRecord
from validation.identify.contact import ContactIdentification
from validation.models.impact import Impact
from validation.scenes.load import NamedScene
from validation.validate.ladder.runs import Contact, lumped_solid, reduced
from validation.validate.ladder.stored_runs import LadderRuns

EXPERIMENT = (0.1, 0.133)  # the solid's edges of section and axis over the diameter
CAUSE_COLUMNS = ("scene", "step", "peak_N", "duration_us", "impulse_mN_s")


def causes(
    scene: NamedScene,
    impact: Impact,
    found: ContactIdentification,
    reference: RunRecord,
    runs: LadderRuns,
) -> list[dict[str, Any]]:
    """From the blind prediction to the reference, one change at a time, from one impact state.

    The solid takes the reduced model's steps back: same spring at the flat end's middle (the beam
    against the solid), on the hemisphere's lowest point (where and how the tip touches), with
    Hertz's law of the same energy (the force law), and at last the contact itself.
    """
    ratio = 1 / found.eta_squared
    linear = Contact(found.stiffness_N_per_m, ratio)
    hertz = Contact(found.stiffness_N_per_m, ratio, found.force_N)
    changes = {
        "reduced model, identified k at the tip node": runs.obtain(reduced, scene, linear, impact),
        "the solid in the beams' place, same spring at its flat end": runs.obtain(
            lumped_solid, scene, linear, impact, EXPERIMENT
        ),
        "that spring at the sphere's lowest point, not at the tip node": runs.obtain(
            lumped_solid, scene, linear, impact, EXPERIMENT, "hemisphere"
        ),
        "Hertz's law of the same energy in the linear spring's place": runs.obtain(
            lumped_solid, scene, hertz, impact, EXPERIMENT, "hemisphere"
        ),
        f"the solid's own contact ({reference.variant})": reference,
    }
    forces = ("peak_N", "impulse_mN_s", "duration_us")
    return [
        {"scene": scene.name, "step": step}
        | {n: of.read(run) or math.nan for n, of in zip(forces, OF_A_TAP, strict=True)}
        for step, run in changes.items()
    ]
