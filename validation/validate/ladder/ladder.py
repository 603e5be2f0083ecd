"""Rungs 2 and 3 of all scenes; rung 4 compares the validation's own runs (`rungs.paper_rung`)."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from validation.converge.verdicts import preset_uncertainties
from validation.errors import RunFailedError, UserError
from validation.harness.record import RunRecord
from validation.harness.store import NO_STORE, Store
from validation.identify.contact import MESHES, ContactIdentification
from validation.models.impact import impact_of
from validation.scenes.load import load_scene
from validation.validate.ladder.causes import Cause, causes
from validation.validate.ladder.comparison import Comparison
from validation.validate.ladder.reference_checks import ReferenceCheck, explicit_flight
from validation.validate.ladder.rungs import contact_rung, structure_rung
from validation.validate.ladder.stored_runs import LadderRuns

ONE_MESH = (MESHES[0],)
EXPLICIT_FLIGHT = "soft"  # the scene whose fall is also run in explicit steps: the larger step


@dataclass(frozen=True)
class Ladder:
    """Rungs 2 and 3.

    Attributes
    ----------
    rows, causes, identified : in the order of the scenes.
    failures : one sentence for each scene that a rung failed on.
    full : whether the converged reference and three meshes of the statics were run.
    references, predictions : rung 3's finest runs from their own flight, of both models.
    checks : what skipping the flight changes, in the full ladder.
    """

    rows: tuple[Comparison, ...]
    causes: tuple[Cause, ...]
    identified: tuple[ContactIdentification, ...]
    failures: tuple[str, ...]
    full: bool
    references: tuple[RunRecord, ...] = ()
    predictions: tuple[RunRecord, ...] = ()
    checks: tuple[ReferenceCheck, ...] = ()


def compute_ladder(
    scenes: Sequence[str], full: bool, studies: Path, store: Store = NO_STORE
) -> Ladder:
    """Compute rungs 2 and 3.

    Parameters
    ----------
    full : use the preset `converged` as the reference; minutes instead of seconds.
    studies : folder of ``fingertap converge``, whose error bars are taken where they exist.
    store : where runs are kept and found again.
    """
    runs = LadderRuns(store)
    rows: list[Comparison] = []
    found: list[Cause] = []
    identified: list[ContactIdentification] = []
    failures: list[str] = []
    references: list[RunRecord] = []
    predictions: list[RunRecord] = []
    checks: list[ReferenceCheck] = []
    for source in scenes:
        try:
            scene = load_scene(source)
            impact = impact_of(scene)
            rows += structure_rung(scene, impact, full, runs)
            tip = runs.identify(scene, MESHES if full else ONE_MESH)
            identified.append(tip)
            stored = preset_uncertainties(studies / f"{source}-fem3d" / "convergence.csv")
            compared, reference, own, predicted = contact_rung(
                source, scene, impact, tip, stored, full, runs
            )
            rows += compared
            references.append(own)
            predictions.append(predicted)
            found += causes(scene, impact, tip, reference, runs)
            if full and source == EXPLICIT_FLIGHT:
                checks.append(explicit_flight(source, runs))
        except (UserError, RunFailedError) as error:
            failures.append(f"{source}: {error}")
    return Ladder(
        tuple(rows),
        tuple(found),
        tuple(identified),
        tuple(failures),
        full,
        tuple(references),
        tuple(predictions),
        tuple(checks),
    )
