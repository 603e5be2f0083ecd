"""What a choice of the reference's changes in the reference itself: shaft holes, rigid flight."""

from collections.abc import Sequence
from dataclasses import dataclass

from validation.compare.differences import error_percent
from validation.harness.quantities import OF_A_TAP, quantity
from validation.harness.record import RunRecord
from validation.scenes.load import load_scene
from validation.validate.ladder.runs import full_contact
from validation.validate.ladder.stored_runs import LadderRuns
from validation.validate.plan import HOLES, REFERENCE, Runs

CHECKED = (*OF_A_TAP, quantity("contact_time_s"))


@dataclass(frozen=True)
class ReferenceCheck:
    """Two runs of the reference that differ in one thing.

    mesh : preset of both.
    peak_N, changed_peak_N : as it is, and with the change.
    peak_percent, impulse_percent, duration_percent, contact_time_percent : the change's effect.
    """

    scene: str
    change: str
    mesh: str
    peak_N: float | None
    changed_peak_N: float | None
    peak_percent: float | None
    impulse_percent: float | None
    duration_percent: float | None
    contact_time_percent: float | None


def _check(change: str, mesh: str, as_it_is: RunRecord, changed: RunRecord) -> ReferenceCheck:
    """Differences of the changed run from the run as it is."""
    pairs = [(entry.read(as_it_is), entry.read(changed)) for entry in CHECKED]
    shares = [error_percent(after, before) for before, after in pairs]
    return ReferenceCheck(as_it_is.scene, change, mesh, *pairs[0], *shares)


def shaft_holes(runs: Runs, scenes: Sequence[str]) -> list[ReferenceCheck]:
    """Joints of nodes on shaft holes' surfaces, as in the paper, against the plain hinge."""
    rows = []
    for scene in scenes:
        plain, holed = runs.find(scene, REFERENCE), runs.find(scene, HOLES)
        if plain is not None and holed is not None:
            rows.append(_check("shaft holes instead of plain hinges", REFERENCE[1], plain, holed))
    return rows


def explicit_flight(source: str, runs: LadderRuns) -> ReferenceCheck:
    """All of the fall by explicit steps, against the start from the reference's rigid flight.

    Raises
    ------
    RunFailedError
        A run did not complete.
    """
    fast = "solver.fem.preset=fast"
    rigid = runs.obtain(full_contact, load_scene(source, (fast,)), None, "fast")
    scene = load_scene(source, (fast, "solver.fem.flight=explicit"))
    whole = runs.obtain(full_contact, scene, None, "fast, explicit flight")
    change = f"whole event by {whole.value('steps') or 0:,.0f} explicit steps"
    return _check(f"{change} instead of a rigid flight", "fast", rigid, whole)
