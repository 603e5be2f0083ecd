"""The page: a figure of the hierarchy, and a table a piece."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from validation.harness.figures import BLACK, BLUE, GREEN, GREY, ORANGE, panels
from validation.harness.page import signed, write_page
from validation.harness.provenance import provenance
from validation.harness.tables import table_of, write_table
from validation.studies.evidence.rows import LEVELS, Piece, Row

WIDTH, LINE = 4.2, 0.42  # of the figure, and of a piece in it, inches
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
    rows: tuple[Row, ...]
    why: str = ""


def word(row: Row) -> str:
    """The verdict, as the page calls it."""
    return SAID["cannot tell" if row.verdict is None else row.verdict.judgement]


def told(row: Row) -> str:
    """E +- u, percent, and the verdict."""
    if row.verdict is None or row.verdict.uncertainty is None:
        return word(row)
    u = row.verdict.uncertainty
    e = signed(row.verdict.difference, min(6, max(1, 1 - math.floor(math.log10(u or 1.0)))))
    return f"{e[:-2]} \N{PLUS-MINUS SIGN} {u:.2g} %: {word(row)}"


def draw_hierarchy(path: Path, shown: Sequence[Shown]) -> None:
    """Every row's difference with its uncertainty, percent, a line a piece, level above level.

    As wide as a telephone shows legibly: names stand above their lines.
    """
    told_of = [one for one in shown if one.rows]
    size = WIDTH, 1.1 + LINE * len(told_of)
    with panels(path, 1, figsize=size, style={"axes.grid": False}) as axes:
        axis = axes[0][0]
        for place, one in enumerate(told_of):
            spread = np.linspace(-0.16, 0.3, len(one.rows) + 2)[1:-1]
            for off, row in zip(spread, one.rows, strict=True):
                if row.verdict is None:
                    continue
                e, u, color = row.verdict.difference, row.verdict.uncertainty or 0.0, word(row)
                axis.plot([e - u, e + u], [place + off] * 2, color=COLORS[color], linewidth=0.8)
                axis.plot(e, place + off, "o" if row.model == "hcm" else "s", color=COLORS[color],
                          markersize=3)  # fmt: skip
            axis.text(0.0, place - 0.28, one.piece.title, fontsize=8, va="center",
                      transform=axis.get_yaxis_transform())  # fmt: skip
        for number, level in enumerate(LEVELS):
            mine = [place for place, one in enumerate(told_of) if one.piece.level == level]
            if mine:
                shade = "#eeeeee" if number % 2 else "#ffffff"
                axis.axhspan(mine[0] - 0.5, mine[-1] + 0.5, color=shade, zorder=0, linewidth=0)
                axis.text(1.0, mine[0] - 0.28, level, color=BLUE, weight="bold", ha="right",
                          transform=axis.get_yaxis_transform(), va="center")  # fmt: skip
        axis.axvline(0.0, color=BLACK, linewidth=0.6)
        axis.set_xscale("symlog", linthresh=SMALLEST)
        ticks = (-10, -0.1, 0, 0.1, 10)
        axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axis.set_yticks([])
        axis.set_ylim(max(len(told_of), 1) - 0.5, -0.5)
        axis.set_xlabel("ours less theirs, % of theirs; bars: both errors")
        for name, color in COLORS.items():
            axis.plot([], [], "s", color=color, markersize=4, label=name)
        axis.figure.legend(loc="outside upper left", ncols=3)


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
        "folder": folder, "told": told, "provenance": provenance({}),
    }  # fmt: skip
    write_page(folder / "index.html", "evidence.html.j2", context)
