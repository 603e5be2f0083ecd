"""The ladder on validate's page and in its tables."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from validation.harness.quantities import quantity
from validation.harness.tables import write_table
from validation.validate.ladder import beside_paper, cost, own_checks, patch
from validation.validate.ladder.climb import Ladder
from validation.validate.ladder.cost import Cost, accuracy_against_cost
from validation.validate.ladder.own_checks import Check, hinges
from validation.validate.ladder.patch import Patch, patches
from validation.validate.ladder.row import COLUMNS, OWN, SAME, Row
from validation.validate.plan import SCENES, Runs

TITLES = {
    2: "Rung 2, structure: the same lumped law on both bodies",
    3: "Rung 3, contact: blind prediction with identified k and eta^2 against the full contact",
    4: "Rung 4, the paper: its own k against the ls-dyna-like reference",
}
CAUSE_COLUMNS = ("scene", "step", "peak_N", "duration_us", "impulse_mN_s")


@dataclass(frozen=True)
class Tables:
    """What stands beside the rungs.

    Attributes
    ----------
    table_2, table_3 : the paper's, our numbers beside its own.
    checks : the reference against itself.
    costs : accuracy against cost.
    patches : how large the contact is, and its pressure.
    """

    table_2: list[dict[str, Any]]
    table_3: list[dict[str, Any]]
    checks: list[Check]
    costs: list[Cost]
    patches: list[Patch]


def tables(ladder: Ladder, runs: Runs) -> Tables:
    """Read from the validation's own runs and the ladder's."""
    return Tables(
        beside_paper.table_2(runs),
        beside_paper.table_3(runs),
        [*hinges(runs, SCENES), *ladder.checks],
        accuracy_against_cost(runs, ladder.predictions, ladder.references),
        patches(runs, ladder.references, SCENES),
    )


def write_ladder(folder: Path, ladder: Ladder, rows: Sequence[Row], beside: Tables) -> None:
    """Write the rungs, the causes and what stands beside them as CSV, Markdown and LaTeX."""
    table = pd.DataFrame([vars(row) for row in rows], columns=list(COLUMNS))
    write_table(folder, "ladder", table, "The ladder of comparisons, rungs 2 to 4")
    causes = pd.DataFrame([vars(cause) for cause in ladder.causes], columns=list(CAUSE_COLUMNS))
    write_table(folder, "ladder_causes", causes, "From the blind prediction to the reference")
    for name, columns, found, title in (
        ("table_2", beside_paper.COLUMNS_2, beside.table_2, "The paper's Table 2"),
        ("table_3", beside_paper.COLUMNS_3, beside.table_3, "The paper's Table 3"),
        (
            "reference_checks",
            own_checks.COLUMNS,
            [vars(row) for row in beside.checks],
            "What a choice of the reference's changes in the reference itself",
        ),
        (
            "accuracy_cost",
            cost.COLUMNS,
            [vars(row) for row in beside.costs],
            "Every model against the best reference run, and its time",
        ),
        (
            "contact_patch",
            patch.COLUMNS,
            [vars(row) for row in beside.patches],
            "Contact patch and pressure at peak force, beside Hertz",
        ),
    ):
        write_table(folder, name, pd.DataFrame(found, columns=list(columns)), title)


def ladder_context(ladder: Ladder, rows: Sequence[Row], beside: Tables) -> dict[str, Any]:
    """What the page's block names."""
    return {
        "ladder_titles": TITLES,
        "ladder_rungs": {rung: [r for r in rows if r.rung == rung] for rung in TITLES},
        "ladder_causes": ladder.causes,
        "ladder_identified": ladder.identified,
        "ladder_failures": ladder.failures,
        "ladder_full": ladder.full,
        "ladder_sentences": [*sentences(ladder, rows), *check_sentences(beside.checks)],
        "table_2": beside.table_2,
        "table_2_columns": beside_paper.COLUMNS_2,
        "table_3": beside.table_3,
        "table_3_columns": beside_paper.COLUMNS_3,
        "reference_checks": beside.checks,
        "accuracy_cost": beside.costs,
        "contact_patches": beside.patches,
    }


def check_sentences(checks: Sequence[Check]) -> list[str]:
    """What each check of the reference against itself changes."""
    return [
        f"{row.scene.capitalize()} finger, reference ({row.mesh}) with {row.change}: "
        f"peak force {row.peak_percent:+.2f} %, impulse {row.impulse_percent:+.2f} %."
        for row in checks
        if row.peak_percent is not None and row.impulse_percent is not None
    ]


def sentences(ladder: Ladder, rows: Sequence[Row]) -> list[str]:
    """The peak force on rungs 2 and 3, in words that the numbers bear out."""
    entry = quantity("peak_normal_force_N")
    wanted = f"{entry.title} ({entry.unit}), {SAME}"
    own = {
        (row.rung, row.scene): row.error_percent
        for row in rows
        if row.quantity == f"{entry.title} ({entry.unit}), {OWN}"
    }
    result = []
    for row in rows:
        if row.quantity != wanted or row.error_percent is None or row.reference is None:
            continue
        side = "above" if row.error_percent > 0 else "below"
        band = ""
        if row.reference_uncertainty is not None:
            band = f" (known to {100 * row.reference_uncertainty / row.reference:.1f} %)"
        what = {
            2: "with the same lumped law the reduced model's peak force lies",
            3: "with k and eta^2 from statics it lies",
        }[row.rung]
        whose = {2: "the solid's", 3: "the full contact's"}[row.rung]
        result.append(
            f"{row.scene.capitalize()} finger, rung {row.rung}: {what} "
            f"{abs(row.error_percent):.1f} % {side} {whose}{band}"
            + (
                "."
                if (end := own.get((row.rung, row.scene))) is None
                else f"; {end:+.1f} % where each falls by itself."
            )
        )
    for scene in dict.fromkeys(cause.scene for cause in ladder.causes):
        steps = [cause for cause in ladder.causes if cause.scene == scene]
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
