"""The ladder's tables, and its sentences and tables on validate's page."""

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from validation.harness.page import opening
from validation.harness.quantities import quantity
from validation.harness.tables import table_of, write_table
from validation.harness.uncertainty import two_digits
from validation.validate.found_runs import Runs
from validation.validate.ladder.comparison import OWN, SAME, Comparison, name_of
from validation.validate.ladder.ladder import Ladder
from validation.validate.ladder.run_tables import (
    CHECK_COLUMNS,
    COST_COLUMNS,
    PATCH_COLUMNS,
    Row,
    accuracy_against_cost,
    contact_patches,
    shaft_holes,
)
from validation.validate.ladder.rungs import CAUSE_COLUMNS, paper_rung
from validation.validate.tables import COLUMNS_2, COLUMNS_3, TABLE_2, TABLE_3, paper_rows

RUNGS = {
    2: "Rung 2, structure: the same lumped law on both bodies",
    3: "Rung 3, contact: blind prediction with identified k and eta^2 against the full contact",
    4: "Rung 4, the paper: its own k against the ls-dyna-like reference",
}
TABLES: dict[str, tuple[Sequence[str], str]] = {  # columns and caption, by the file's name
    "ladder": (tuple(Comparison.__annotations__), "The ladder of comparisons, rungs 2 to 4"),
    "ladder_causes": (CAUSE_COLUMNS, "From the blind prediction to the reference"),
    "table_2": (COLUMNS_2, "The paper's Table 2"),
    "table_3": (COLUMNS_3, "The paper's Table 3"),
    "reference_checks": (
        CHECK_COLUMNS,
        "What each choice in the reference changes in its own result",
    ),
    "accuracy_cost": (COST_COLUMNS, "Every model against the best reference run, and its time"),
    "contact_patch": (PATCH_COLUMNS, "Contact patch and pressure at peak force, beside Hertz"),
}
Rows = Mapping[str, Sequence[Any]]  # by the names of TABLES


def ladder_rows(ladder: Ladder, runs: Runs) -> Rows:
    """Rows of all tables, from the validation's own runs and the ladder's."""
    return {
        "ladder": [*ladder.rows, *paper_rung(runs, runs.scenes)],
        "ladder_causes": ladder.causes,
        "table_2": paper_rows(runs, TABLE_2),
        "table_3": paper_rows(runs, TABLE_3),
        "reference_checks": [*shaft_holes(runs, runs.scenes), *ladder.checks],
        "accuracy_cost": accuracy_against_cost(runs, ladder.predictions, ladder.references),
        "contact_patch": contact_patches(runs, ladder.references, runs.scenes),
    }


def write_ladder(folder: Path, rows: Rows) -> None:
    """Write every table as CSV, Markdown and LaTeX."""
    for name, (columns, caption) in TABLES.items():
        write_table(folder, name, table_of(rows[name], columns), caption)


def ladder_context(ladder: Ladder, rows: Rows) -> dict[str, Any]:
    """The variables of the ladder's block in the page's template."""
    return {
        "ladder": ladder,
        "ladder_tables": rows,
        "ladder_columns": {name: columns for name, (columns, _) in TABLES.items()},
        "ladder_rungs": [
            (title, [row for row in rows["ladder"] if row.rung == rung])
            for rung, title in RUNGS.items()
        ],
        "ladder_sentences": [
            *peak_sentences(rows["ladder"]),
            *cause_sentences(rows["ladder_causes"]),
            *check_sentences(rows["reference_checks"]),
        ],
    }


def check_sentences(checks: Sequence[Row]) -> list[str]:
    """A sentence per check of the reference against itself: what a choice changes."""
    return [
        f"{opening(row['scene'])} finger, reference ({row['mesh']}) with {row['change']}: "
        f"peak force {row['peak_percent']:+.2f} %, impulse {row['impulse_percent']:+.2f} %."
        for row in checks
        if row["peak_percent"] is not None and row["impulse_percent"] is not None
    ]


def peak_sentences(comparisons: Sequence[Comparison]) -> list[str]:
    """Sentences on the peak force on rungs 2 and 3, worded to match the numbers."""
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
            known = two_digits(100 * row.reference_uncertainty / row.reference)
            band = f" (known to {known} %)"
        own_flight = own.get((row.rung, row.scene))
        end = "." if own_flight is None else f"; {own_flight:+.1f} % where each falls by itself."
        result.append(
            f"{opening(row.scene)} finger, rung {row.rung}: {what[row.rung]} {abs(error):.1f} "
            f"% {'above' if error > 0 else 'below'} {whose[row.rung]}{band}{end}"
        )
    return result


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
            f"{opening(scene)} finger: from the blind prediction's {first:.1f} N to "
            f"the reference's {last:.1f} N it is {last - first:+.1f} N: {', '.join(parts)}."
        )
    return result
