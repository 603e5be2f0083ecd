"""The ladder's tables, and its sentences and tables on validate's page."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from validation.harness.quantities import quantity
from validation.harness.tables import table_of, write_table
from validation.validate import paper_tables
from validation.validate.ladder import (
    accuracy_cost,
    causes,
    comparison,
    contact_patch,
    reference_checks,
)
from validation.validate.ladder.accuracy_cost import AccuracyCost, accuracy_against_cost
from validation.validate.ladder.causes import Cause
from validation.validate.ladder.comparison import OWN, SAME, Comparison, name_of
from validation.validate.ladder.contact_patch import ContactPatch, contact_patches
from validation.validate.ladder.ladder import Ladder
from validation.validate.ladder.reference_checks import ReferenceCheck, shaft_holes
from validation.validate.ladder.rungs import paper_rung
from validation.validate.plan import SCENES, Runs

TITLES = {
    2: "Rung 2, structure: the same lumped law on both bodies",
    3: "Rung 3, contact: blind prediction with identified k and eta^2 against the full contact",
    4: "Rung 4, the paper: its own k against the ls-dyna-like reference",
}
CAPTIONS = {
    "ladder": "The ladder of comparisons, rungs 2 to 4",
    "ladder_causes": "From the blind prediction to the reference",
    "table_2": "The paper's Table 2",
    "table_3": "The paper's Table 3",
    "reference_checks": "What a choice of the reference's changes in the reference itself",
    "accuracy_cost": "Every model against the best reference run, and its time",
    "contact_patch": "Contact patch and pressure at peak force, beside Hertz",
}


@dataclass(frozen=True)
class LadderTables:
    """The rows of each table.

    Attributes
    ----------
    comparisons : of rungs 2 to 4.
    table_2, table_3 : the paper's, our numbers beside its own.
    checks : the reference against itself.
    costs : accuracy against cost.
    patches : how large the contact is, and its pressure.
    """

    comparisons: list[Comparison]
    causes: Sequence[Cause]
    table_2: list[dict[str, Any]]
    table_3: list[dict[str, Any]]
    checks: list[ReferenceCheck]
    costs: list[AccuracyCost]
    patches: list[ContactPatch]


def ladder_tables(ladder: Ladder, runs: Runs) -> LadderTables:
    """Read from the validation's own runs and the ladder's."""
    return LadderTables(
        [*ladder.rows, *paper_rung(runs, SCENES)],
        ladder.causes,
        paper_tables.table_2(runs),
        paper_tables.table_3(runs),
        [*shaft_holes(runs, SCENES), *ladder.checks],
        accuracy_against_cost(runs, ladder.predictions, ladder.references),
        contact_patches(runs, ladder.references, SCENES),
    )


def write_ladder(folder: Path, tables: LadderTables) -> None:
    """Write every table as CSV, Markdown and LaTeX."""
    for name, columns, rows in (
        ("ladder", comparison.COLUMNS, tables.comparisons),
        ("ladder_causes", causes.COLUMNS, tables.causes),
        ("table_2", paper_tables.COLUMNS_2, tables.table_2),
        ("table_3", paper_tables.COLUMNS_3, tables.table_3),
        ("reference_checks", reference_checks.COLUMNS, tables.checks),
        ("accuracy_cost", accuracy_cost.COLUMNS, tables.costs),
        ("contact_patch", contact_patch.COLUMNS, tables.patches),
    ):
        write_table(folder, name, table_of(rows, columns), CAPTIONS[name])


def ladder_context(ladder: Ladder, tables: LadderTables) -> dict[str, Any]:
    """What the page's block names."""
    rungs = {rung: [c for c in tables.comparisons if c.rung == rung] for rung in TITLES}
    return {
        "ladder": ladder,
        "ladder_tables": tables,
        "ladder_titles": TITLES,
        "ladder_rungs": rungs,
        "ladder_sentences": [
            *peak_sentences(tables.comparisons),
            *cause_sentences(tables.causes),
            *check_sentences(tables.checks),
        ],
        "table_2_columns": paper_tables.COLUMNS_2,
        "table_3_columns": paper_tables.COLUMNS_3,
    }


def check_sentences(checks: Sequence[ReferenceCheck]) -> list[str]:
    """What each check of the reference against itself changes."""
    return [
        f"{row.scene.capitalize()} finger, reference ({row.mesh}) with {row.change}: "
        f"peak force {row.peak_percent:+.2f} %, impulse {row.impulse_percent:+.2f} %."
        for row in checks
        if row.peak_percent is not None and row.impulse_percent is not None
    ]


def peak_sentences(comparisons: Sequence[Comparison]) -> list[str]:
    """The peak force on rungs 2 and 3, in words that the numbers bear out."""
    entry = quantity("peak_normal_force_N")
    what = {
        2: "with the same lumped law the reduced model's peak force lies",
        3: "with k and eta^2 from statics it lies",
    }
    whose = {2: "the solid's", 3: "the full contact's"}
    own = {
        (row.rung, row.scene): row.error_percent
        for row in comparisons
        if row.quantity == name_of(entry, OWN)
    }
    result = []
    for row in comparisons:
        error = row.error_percent
        if row.quantity != name_of(entry, SAME) or error is None or row.reference is None:
            continue
        band = ""
        if row.reference_uncertainty is not None:
            band = f" (known to {100 * row.reference_uncertainty / row.reference:.1f} %)"
        own_flight = own.get((row.rung, row.scene))
        end = "." if own_flight is None else f"; {own_flight:+.1f} % where each falls by itself."
        result.append(
            f"{row.scene.capitalize()} finger, rung {row.rung}: {what[row.rung]} {abs(error):.1f} "
            f"% {'above' if error > 0 else 'below'} {whose[row.rung]}{band}{end}"
        )
    return result


def cause_sentences(causes: Sequence[Cause]) -> list[str]:
    """What each step of a scene's experiment adds to the peak force, the largest first."""
    result = []
    for scene in dict.fromkeys(cause.scene for cause in causes):
        steps = [cause for cause in causes if cause.scene == scene]
        gap = steps[-1].peak_N - steps[0].peak_N
        changes = {
            after.step: after.peak_N - before.peak_N for before, after in itertools.pairwise(steps)
        }
        largest = sorted(changes.items(), key=lambda item: -abs(item[1]))
        parts = [f"{change:+.1f} N with {step}" for step, change in largest]
        result.append(
            f"{scene.capitalize()} finger: from the blind prediction's {steps[0].peak_N:.1f} N to "
            f"the reference's {steps[-1].peak_N:.1f} N it is {gap:+.1f} N: {', '.join(parts)}."
        )
    return result
