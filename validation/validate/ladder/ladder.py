"""Rungs 2 and 3 of all scenes; rung 4 compares the validation's own runs (`rungs.paper_rung`)."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from validation.converge.verdicts import preset_uncertainties
from validation.errors import RunFailedError, UserError
from validation.harness.record import RunRecord
from validation.harness.store import NO_STORE, Store
from validation.identify.contact import MESHES, ContactIdentification
from validation.models.impact import impact_of
from validation.scenes.load import load_scene, scene_name
from validation.validate.ladder.comparison import Comparison
from validation.validate.ladder.run_tables import Row, explicit_flight
from validation.validate.ladder.rungs import causes, contact_rung, structure_rung
from validation.validate.ladder.stored_runs import LadderRuns

EXPLICIT_FLIGHT = "soft"  # scene whose fall is also run in explicit steps, larger than hard's


@dataclass(frozen=True)
class Ladder:
    """Rungs 2 and 3.

    full : whether the converged reference and three meshes of the statics were run.
    rows, causes, identified : in the order of the scenes.
    references, predictions : rung 3's finest runs of both models, each from its own flight.
    checks : the effect of skipping the flight, in the full ladder only.
    failures : one sentence for each scene on which a rung failed.
    """

    full: bool
    rows: list[Comparison] = field(default_factory=list)
    causes: list[Row] = field(default_factory=list)
    identified: list[ContactIdentification] = field(default_factory=list)
    references: list[RunRecord] = field(default_factory=list)
    predictions: list[RunRecord] = field(default_factory=list)
    checks: list[Row] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)


def compute_ladder(
    scenes: Sequence[str], full: bool, studies: Path, store: Store = NO_STORE
) -> Ladder:
    """Compute rungs 2 and 3; a scene that fails keeps the rungs before its failure.

    full : use the preset `converged` as the reference; minutes instead of seconds.
    studies : folder of ``fingertap converge``, whose error bars are taken where they exist.
    """
    runs = LadderRuns(store)
    ladder = Ladder(full)
    for source in scenes:
        try:
            scene = load_scene(source)
            impact = impact_of(scene)
            ladder.rows.extend(structure_rung(scene, impact, full, runs))
            tip = runs.identify(scene, MESHES if full else MESHES[:1])
            ladder.identified.append(tip)
            stored = preset_uncertainties(studies / f"{scene.name}-fem3d", scene.tables)
            compared, reference, own, predicted = contact_rung(
                source, scene, impact, tip, stored, full, runs
            )
            ladder.rows.extend(compared)
            ladder.references.append(own)
            ladder.predictions.append(predicted)
            ladder.causes.extend(causes(scene, impact, tip, reference, runs))
            if full and source == EXPLICIT_FLIGHT:
                ladder.checks.append(explicit_flight(source, runs))
        except (UserError, RunFailedError) as error:
            ladder.failures.append(f"{scene_name(source)}: {error}")
    return ladder
