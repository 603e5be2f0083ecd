"""The whole ladder: rungs 2 and 3 computed, rung 4 read from the validation's own runs."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from validation.compare.differences import spread
from validation.converge.command import PRESET
from validation.errors import RunFailedError, UserError
from validation.harness.quantities import COMPARED
from validation.harness.record import RunRecord
from validation.harness.store import NO_STORE, Store
from validation.identify.contact import MESHES, ContactIdentification
from validation.models.impact import impact_of
from validation.scenes.load import load_scene
from validation.validate.ladder.own_checks import Check, whole_event
from validation.validate.ladder.row import OWN, Row, compare
from validation.validate.ladder.rungs import Cause, blind, causes, structure
from validation.validate.ladder.stored_runs import LadderRuns
from validation.validate.plan import REDUCED, REFERENCE, Runs

ONE_MESH = (MESHES[0],)
WHOLE_EVENT = "soft"  # the scene whose fall is also run in explicit steps: the larger step


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

    rows: tuple[Row, ...]
    causes: tuple[Cause, ...]
    identified: tuple[ContactIdentification, ...]
    failures: tuple[str, ...]
    full: bool
    references: tuple[RunRecord, ...] = ()
    predictions: tuple[RunRecord, ...] = ()
    checks: tuple[Check, ...] = ()


def climb(scenes: Sequence[str], full: bool, studies: Path, store: Store = NO_STORE) -> Ladder:
    """Compute rungs 2 and 3.

    Parameters
    ----------
    full : use the preset `converged` as the reference; minutes instead of seconds.
    studies : folder of ``fingertap converge``, whose error bars are taken where they exist.
    store : where runs are kept and found again.
    """
    runs = LadderRuns(store)
    rows: list[Row] = []
    found: list[Cause] = []
    identified: list[ContactIdentification] = []
    failures: list[str] = []
    references: list[RunRecord] = []
    predictions: list[RunRecord] = []
    checks: list[Check] = []
    for source in scenes:
        try:
            scene = load_scene(source)
            impact = impact_of(scene)
            rows += structure(scene, impact, full, runs)
            tip = runs.identify(scene, MESHES if full else ONE_MESH)
            identified.append(tip)
            stored = study_uncertainties(studies / f"{source}-fem3d" / "convergence.csv")
            compared, reference, own, predicted = blind(
                source, scene, impact, tip, stored, full, runs
            )
            rows += compared
            references.append(own)
            predictions.append(predicted)
            found += causes(scene, impact, tip, reference, runs)
            if full and source == WHOLE_EVENT:
                checks.append(whole_event(source, runs))
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


def study_uncertainties(path: Path) -> dict[str, float]:
    """Relative uncertainties by key from a finished ``fingertap converge``; empty without one.

    They are those of the preset `converged` (`converge_command.preset_rows`).
    """
    if not path.is_file():
        return {}
    import pandas as pd

    table = pd.read_csv(path)
    if not {"ladder", "quantity", "uncertainty_percent"} <= set(table.columns):
        return {}
    known = {entry.key for entry in COMPARED}
    of_preset = table[table["ladder"] == PRESET].dropna(subset=["uncertainty_percent"])
    return {
        quantity: 0.01 * float(share)
        for quantity, share in of_preset[["quantity", "uncertainty_percent"]].to_numpy().tolist()
        if quantity in known
    }


def paper_rung(runs: Runs, scenes: Sequence[str]) -> list[Row]:
    """Rung 4: the paper's k against the `ls-dyna-like` reference, each from its own flight.

    The reference's uncertainty is half its range over the validation's meshes and penalties.
    """
    rows = []
    for scene in scenes:
        reduced, reference = runs.find(scene, REDUCED), runs.find(scene, REFERENCE)
        if reduced is None or reference is None:
            continue
        share = {}
        for entry in COMPARED:
            band, value = spread(runs.spread_over(scene), entry), entry.read(reference)
            if band is not None and value:
                share[entry.key] = 0.5 * (band.high - band.low) / abs(value)
        rows += compare(4, reduced, reference, share, OWN)
    return rows
