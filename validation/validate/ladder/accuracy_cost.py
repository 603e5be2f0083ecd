"""Accuracy against cost: every model of a scene against the best run of the reference there is."""

from collections.abc import Sequence
from dataclasses import dataclass

from validation.compare.differences import error_percent
from validation.harness.quantities import OF_A_TAP
from validation.harness.record import RunRecord
from validation.validate.plan import FAST, PLANE, REDUCED, REFERENCE, Runs

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


COLUMNS = tuple(AccuracyCost.__annotations__)


def _cost(name: str, run: RunRecord, best: RunRecord) -> AccuracyCost:
    shares = [error_percent(entry.read(run), entry.read(best)) for entry in OF_A_TAP]
    time, peak = run.value("wall_time_s"), run.value("peak_normal_force_N")
    return AccuracyCost(run.scene, name, time, peak, *shares)


def accuracy_against_cost(
    runs: Runs, predictions: Sequence[RunRecord], best: Sequence[RunRecord]
) -> list[AccuracyCost]:
    """All models of every scene that has a best run, cheapest first.

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
            for which in (REDUCED, PLANE, FAST, REFERENCE)
            if (run := runs.find(scene, which)) is not None
        ]
        several += [("hcm, identified k", run) for run in predictions if run.scene == scene]
        several.append((f"fem3d {reference.variant}", reference))
        found = [_cost(name, run, reference) for name, run in several]
        rows += sorted(found, key=lambda row: row.wall_time_s or 0.0)
    return rows
