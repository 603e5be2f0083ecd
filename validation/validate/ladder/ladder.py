"""Rungs 2 and 3 of all scenes, and what the ladder says; rung 4 compares the validation's own runs
(`rungs.paper_rung`).
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from validation.converge.verdicts import preset_uncertainties, study_name
from validation.errors import RunFailedError, UserError
from validation.harness.identity import program
from validation.harness.page import above_or_below, opening
from validation.harness.quantities import COMPARED, quantity
from validation.harness.record import RunRecord, plain
from validation.harness.store import NO_STORE, Store
from validation.harness.uncertainty import two_digits
from validation.identify.contact import MESHES, ContactIdentification, identify_contact
from validation.models.impact import impact_of
from validation.models.inputs import scene_inputs
from validation.scenes.load import NamedScene, load_scene, scene_name
from validation.validate.headline import MATTERS
from validation.validate.ladder import rungs
from validation.validate.ladder.runs import LadderRuns, full_contact
from validation.validate.plan import NO_FEM_ACCURACY
from validation.validate.tables import Row, check_row

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
    rows: list[rungs.Comparison] = field(default_factory=list)
    causes: list[Row] = field(default_factory=list)
    identified: list[ContactIdentification] = field(default_factory=list)
    references: list[RunRecord] = field(default_factory=list)
    predictions: list[RunRecord] = field(default_factory=list)
    checks: list[Row] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)

    @property
    def doubts(self) -> list[str]:
        """What rung 3's references say of themselves."""
        return [f"{r.scene}, rung 3's {r.label}: {r.doubt}" for r in self.references if r.doubt]


def identify(
    scene: NamedScene, refinements: tuple[tuple[float, float], ...], store: Store
) -> ContactIdentification:
    """The result of `identify_contact`, computed unless the store has it."""
    # it depends on the reduced model's peak and the solid's statics: both models' tables
    tables = [scene_inputs(scene.tables, model) for model in ("hcm", "fem3d")]
    inputs = {"program": program(identify_contact.__module__), "scene": tables,
              "refinements": plain(refinements)}  # fmt: skip
    found = store.obtain(
        inputs, ContactIdentification, lambda: identify_contact(scene, refinements)
    )
    return replace(found, scene=scene.name)


def explicit_flight(source: str, runs: LadderRuns) -> Row:
    """A row that compares a fall in explicit steps with the start from a rigid flight."""
    fast = "solver.fem.preset=fast", NO_FEM_ACCURACY
    rigid = runs.obtain(full_contact, load_scene(source, fast), None, "fast")
    scene = load_scene(source, (*fast, "solver.fem.flight=explicit"))
    whole = runs.obtain(full_contact, scene, None, "fast, explicit flight")
    change = f"whole event by {whole.value('steps') or 0:,.0f} explicit steps"
    return check_row(f"{change} instead of a rigid flight", "fast", rigid, whole)


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
            ladder.rows.extend(rungs.structure_rung(scene, impact, full, runs))
            tip = identify(scene, MESHES if full else MESHES[:1], store)
            ladder.identified.append(tip)
            study = studies / study_name(scene.name, "fem3d")
            stored = preset_uncertainties(study, scene.tables) if full else {}
            compared, reference, own, predicted = rungs.contact_rung(
                source, scene, impact, tip, stored, full, runs
            )
            ladder.rows.extend(compared)
            ladder.references.append(own)
            ladder.predictions.append(predicted)
            ladder.causes.extend(rungs.causes(scene, impact, tip, reference, runs))
            if full and source == EXPLICIT_FLIGHT:
                ladder.checks.append(explicit_flight(source, runs))
        except (UserError, RunFailedError) as error:
            what = "the ladder, whose models start from the impact of thin rods, ends early"
            ladder.failures.append(f"{scene_name(source)}: {what}: {error}")
    return ladder


def check_sentences(checks: Sequence[Row]) -> list[str]:
    """A sentence per check of the reference against itself: what a choice changes."""
    return [
        f"{opening(row['scene'])} finger, reference ({row['mesh']}) with {row['change']}: "
        f"peak force {row['peak_percent']:+.2f} %, impulse {row['impulse_percent']:+.2f} %."
        for row in checks
        if row["peak_percent"] is not None and row["impulse_percent"] is not None
    ]


def peak_sentences(comparisons: Sequence[rungs.Comparison]) -> list[str]:
    """Sentences on the peak force on rungs 2 and 3, worded to match the numbers."""
    entry = quantity("peak_normal_force_N")
    same, alone = (rungs.name_of(entry, start) for start in (rungs.SAME, rungs.OWN))
    what = {
        2: "with the same lumped law the reduced model's peak force lies",
        3: "with k and eta^2 from statics it lies",
    }
    whose = {2: "the solid's", 3: "the full contact's"}
    own = {(row.rung, row.scene): row.error_percent for row in comparisons if row.quantity == alone}
    result = []
    for row in comparisons:
        error = row.error_percent
        if row.quantity != same or error is None or row.reference is None:
            continue
        band = ""
        if row.reference_uncertainty is not None and math.isfinite(row.reference_uncertainty):
            known = two_digits(100 * row.reference_uncertainty / row.reference)
            band = f" (known to {known} %)"
        own_flight = own.get((row.rung, row.scene))
        end = "." if own_flight is None else f"; {own_flight:+.1f} % where each falls by itself."
        result.append(
            f"{opening(row.scene)} finger, rung {row.rung}: {what[row.rung]} "
            f"{above_or_below(error)} {whose[row.rung]}{band}{end}{_further(row, comparisons)}"
        )
    return result


def _further(peak: rungs.Comparison, comparisons: Sequence[rungs.Comparison]) -> str:
    """A sentence on the numbers of the same runs that are further apart than the peak, if any."""
    titles = {rungs.name_of(entry, rungs.SAME): entry.title for entry in COMPARED}
    least = abs(peak.error_percent or 0.0) + MATTERS
    apart = [
        f"{titles[row.quantity]} {above_or_below(row.error_percent)}"
        for row in comparisons
        if (row.rung, row.scene) == (peak.rung, peak.scene)
        and row.quantity in titles
        and row.error_percent is not None
        and abs(row.error_percent) > least
        and row.reduced is not None
        and row.reference is not None
        and row.reference_uncertainty is not None
        and abs(row.reduced - row.reference) > row.reference_uncertainty
    ]
    return f" Further apart than the reference is uncertain: {', '.join(apart)}." * bool(apart)


def cause_sentences(causes: Sequence[Row]) -> list[str]:
    """A sentence per scene: what each step adds to the peak force, the largest first."""
    result = []
    for scene in dict.fromkeys(cause["scene"] for cause in causes):
        steps = [(row["step"], row["peak_N"]) for row in causes if row["scene"] == scene]
        (_, first), *_, (_, last) = steps
        changes = {step: after - before for (_, before), (step, after) in itertools.pairwise(steps)}
        largest = sorted(changes.items(), key=lambda item: -abs(item[1]))
        parts = [f"{change:+.1f} N with {step}" for step, change in largest]
        result.append(
            f"{opening(scene)} finger: from the blind prediction's {first:.1f} N to the"
            f" {last:.1f} N of rung 3's reference, from the same impact, it is"
            f" {last - first:+.1f} N: {', '.join(parts)}."
        )
    return result
