"""The ladder on validate's page and in its tables."""

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from validation.ladder.climb import Ladder
from validation.ladder.row import COLUMNS, SAME, Row
from validation.metrics import quantity
from validation.tables import write_table

TITLES = {
    2: "Rung 2, structure: the same lumped law on both bodies",
    3: "Rung 3, contact: blind prediction with identified k and eta^2 against the full contact",
    4: "Rung 4, the paper: its own k against the ls-dyna-like reference",
}
CAUSE_COLUMNS = ("scene", "step", "peak_N", "duration_us", "impulse_mN_s")


def write_ladder(folder: Path, ladder: Ladder, rows: Sequence[Row]) -> None:
    """Write ``ladder`` and ``ladder_causes`` as CSV, Markdown and LaTeX."""
    table = pd.DataFrame([vars(row) for row in rows], columns=list(COLUMNS))
    write_table(folder, "ladder", table, "The ladder of comparisons, rungs 2 to 4")
    causes = pd.DataFrame([vars(cause) for cause in ladder.causes], columns=list(CAUSE_COLUMNS))
    write_table(folder, "ladder_causes", causes, "From the blind prediction to the reference")


def ladder_context(ladder: Ladder, rows: Sequence[Row]) -> dict[str, Any]:
    """What the page's block names."""
    return {
        "ladder_titles": TITLES,
        "ladder_rungs": {rung: [r for r in rows if r.rung == rung] for rung in TITLES},
        "ladder_causes": ladder.causes,
        "ladder_identified": ladder.identified,
        "ladder_failures": ladder.failures,
        "ladder_full": ladder.full,
        "ladder_sentences": sentences(ladder, rows),
    }


def sentences(ladder: Ladder, rows: Sequence[Row]) -> list[str]:
    """The peak force on rungs 2 and 3, in words that the numbers bear out."""
    entry = quantity("peak_normal_force_N")
    wanted = f"{entry.title} ({entry.unit}), {SAME}"
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
            f"{abs(row.error_percent):.1f} % {side} {whose}{band}."
        )
    for scene in dict.fromkeys(cause.scene for cause in ladder.causes):
        steps = [cause for cause in ladder.causes if cause.scene == scene]
        gap = steps[-1].peak_N - steps[0].peak_N
        changes = {
            after.step: after.peak_N - before.peak_N for before, after in itertools.pairwise(steps)
        }
        step, change = max(changes.items(), key=lambda item: abs(item[1]))
        result.append(
            f"{scene.capitalize()} finger: of the {gap:+.1f} N between blind prediction and "
            f"reference, {change:+.1f} N come with the step to '{step}'."
        )
    return result
