"""The page: a figure of the hierarchy, and a table per piece."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from validation.harness.figures import BLACK, BLUE, GREEN, GREY, ORANGE, panels
from validation.harness.page import signed, write_page
from validation.harness.provenance import provenance
from validation.harness.tables import table_of, write_table
from validation.harness.uncertainty import two_digits
from validation.studies.evidence.rows import LEVELS, EvidenceRow, Piece

WIDTH, LINE = 3.5, 0.42  # width of the figure, height of a piece in it, inches
HEADING = 0.6  # height of a level's name over a piece's line
SMALLEST = 1e-3  # percent; below it the figure's axis is linear
SAID = {"within uncertainty": "agrees", "resolved": "differs", "cannot tell": "cannot tell"}
COLORS = {"agrees": GREEN, "differs": ORANGE, "cannot tell": GREY}
COLUMNS = (
    "level", "piece", "quantity", "unit", "model", "outside", "outside_error", "ours", "ours_error",
    "difference_percent", "uncertainty_percent", "verdict", "remark", "source",
)  # fmt: skip


@dataclass(frozen=True)
class Shown:
    """A piece with its rows, or why it has none."""

    piece: Piece
    rows: tuple[EvidenceRow, ...]
    why: str = ""


def word(row: EvidenceRow) -> str:
    """The verdict, as the page calls it."""
    return SAID["cannot tell" if row.verdict is None else row.verdict.judgement]


def difference_text(row: EvidenceRow) -> str:
    """E +- u, percent, and the verdict."""
    if row.verdict is None or row.verdict.uncertainty is None:
        return word(row)
    u = row.verdict.uncertainty
    e = signed(row.verdict.difference, min(6, max(1, 1 - math.floor(math.log10(u or 1.0)))))
    return f"{e[:-2]} \N{PLUS-MINUS SIGN} {two_digits(u)} %: {word(row)}"


def draw_hierarchy(path: Path, shown: Sequence[Shown]) -> None:
    """Draw every row's difference and uncertainty, percent, a line per piece, level by level.

    It is narrow enough to be legible on a telephone: names stand above their lines.
    """
    levels = [[one for one in shown if one.rows and one.piece.level == level] for level in LEVELS]
    lines = sum(map(len, levels)) + HEADING * sum(map(bool, levels))
    size = WIDTH, 1.1 + LINE * lines
    with panels(path, 1, figsize=size, style={"axes.grid": False}) as axes:
        axis, top = axes[0][0], 0.0
        across, left = axis.get_yaxis_transform(), {"va": "center", "in_layout": False}
        for number, (level, pieces) in enumerate(zip(LEVELS, levels, strict=True)):
            if not pieces:
                continue
            bottom = top + HEADING + len(pieces)
            shade = "#eeeeee" if number % 2 else "#ffffff"
            axis.axhspan(top, bottom, color=shade, zorder=0, linewidth=0)
            axis.text(0.01, top + 0.5 * HEADING, level, color=BLUE, weight="bold",
                      transform=across, **left)  # fmt: skip
            for place, one in enumerate(pieces):
                name = top + HEADING + place + 0.18
                axis.text(0.01, name, one.piece.title, fontsize=8, transform=across, **left)
                heights = np.linspace(name + 0.18, name + 0.78, len(one.rows) + 2)[1:-1]
                for height, row in zip(heights, one.rows, strict=True):
                    if row.verdict is None:
                        continue
                    e, u = row.verdict.difference, row.verdict.uncertainty or 0.0
                    color, mark = COLORS[word(row)], "o" if row.model == "hcm" else "s"
                    axis.plot([e - u, e + u], [height, height], color=color, linewidth=0.8)
                    axis.plot(e, height, mark, color=color, markersize=3)
            top = bottom
        axis.axvline(0.0, color=BLACK, linewidth=0.6)
        axis.set_xscale("symlog", linthresh=SMALLEST)
        ticks = (-10, -0.1, 0, 0.1, 10)
        axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axis.set_yticks([])
        axis.set_ylim(lines or 1.0, 0.0)
        axis.set_xlabel("ours less theirs, % of theirs; bars: both errors")
        for said, color in COLORS.items():
            axis.plot([], [], "s", color=color, markersize=4, label=said)
        axis.figure.legend(loc="outside upper left", ncols=3)


def tally(shown: Sequence[Shown]) -> list[dict[str, Any]]:
    """How many numbers of each piece agree, differ or cannot tell."""
    return [
        {"how many": one.piece.title} | {said: counts[said] or None for said in COLORS}
        for one in sorted(shown, key=lambda one: LEVELS.index(one.piece.level))
        if (counts := Counter(map(word, one.rows)))
    ]


def write_evidence(folder: Path, shown: Sequence[Shown]) -> None:
    """Write ``index.html``, ``evidence.csv`` (.md, .tex) and ``hierarchy.png``."""
    rows = [(one.piece, row) for one in shown for row in one.rows]
    lines = [
        {
            "level": piece.level, "piece": piece.name, "source": piece.source, **vars(row),
            "verdict": word(row),
            "difference_percent": row.verdict and row.verdict.difference,
            "uncertainty_percent": row.verdict and row.verdict.uncertainty,
        }
        for piece, row in rows
    ]  # fmt: skip
    write_table(folder, "evidence", table_of(lines, COLUMNS), "Evidence from outside")
    draw_hierarchy(folder / "hierarchy.png", shown)
    context = {
        "levels": {level: [s for s in shown if s.piece.level == level] for level in LEVELS},
        "words": [word(row) for _, row in rows], "left_out": [s for s in shown if not s.rows],
        "tally": tally(shown), "folder": folder, "difference_text": difference_text,
        "provenance": provenance({}),
    }  # fmt: skip
    write_page(folder / "index.html", "evidence.html.j2", context)
