"""The page: figures of the hierarchy and of the taps, and a table per piece.

Figures are narrow, one column of panels, so that a telephone shows them as large as they are drawn.
"""

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from validation.harness.figures import BLACK, BLUE, GREEN, GREY, ORANGE, panels
from validation.harness.page import signed, write_page
from validation.harness.store import Store
from validation.harness.tables import table_of, write_table
from validation.harness.uncertainty import two_digits
from validation.studies.evidence.rows import LEVELS, EvidenceRow, Piece
from validation.studies.evidence.taps import SpringTap, calculix_tap, reference_tap, title

WIDTH, LINE = 3.5, 0.42  # width of the figures, height of a piece in the hierarchy's, inches
HEADING = 0.6  # height of a level's name over a piece's line
SMALLEST = 1e-3  # percent; below it the figure's axis is linear
SAID = {"within uncertainty": "agrees", "resolved": "differs", "cannot tell": "cannot tell"}
COLORS = {"agrees": GREEN, "differs": ORANGE, "cannot tell": GREY}
BY_ELEMENT = {"C3D8": ORANGE, "C3D8I": GREEN}
FIELDS_OF = {"tap-soft", "tap-hard"}
REACH_MM = 7.0  # of the field that is shown, from the lowest point
LIMIT = 99.0  # percentile of the stresses at which colours end
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
    if row.verdict is None or row.verdict.check == "cannot tell":
        return SAID["cannot tell"]
    return SAID[row.verdict.judgement]


def difference_text(row: EvidenceRow) -> str:
    """E +- u, percent, and the verdict; with more digits where the rounded ones contradict it."""
    if row.verdict is None or row.verdict.uncertainty is None:
        return word(row)
    e, u = row.verdict.difference, row.verdict.uncertainty
    places, known = min(6, max(1, 1 - math.floor(math.log10(u or 1.0)))), two_digits(u)
    while places < 6 and (round(abs(e), places) > float(known)) != (abs(e) > u):
        places += 1
        known = f"{u:.{places}f}"
    shown = signed(e, places)[:-2]
    return f"{shown} \N{PLUS-MINUS SIGN} {known} %: {word(row)}"


def draw_hierarchy(path: Path, shown: Sequence[Shown]) -> None:
    """Draw every row's difference and uncertainty, percent, a line per piece, level by level.

    Names stand above their lines: beside them they would take a telephone's width.
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


def draw_forces(path: Path, taps: Iterable[SpringTap], store: Store) -> None:
    """Draw the forces of the taps, a panel for each of ours, with both of CalculiX's elements."""
    groups = [list(alike) for _, alike in groupby(taps, lambda tap: tap.ours)]
    if not groups:
        return
    with panels(path, 1, len(groups), width=WIDTH, height=2.3) as axes:
        for (axis,), alike in zip(axes, groups, strict=True):
            own = reference_tap(alike[0], store)
            axis.plot(1e6 * np.array(own.time_s), own.normal_force_N, color=BLUE, label="fem3d")
            for tap in alike:
                theirs = calculix_tap(tap, store)
                time, name = 1e6 * np.array(theirs.time_s), f"CalculiX {tap.element}"
                color = BY_ELEMENT[tap.element]
                axis.plot(time, theirs.normal_force_N, "--", color=color, label=name)
            axis.set_title(title(alike[0]).removeprefix("The "), fontsize=8)
            axis.set_ylabel("normal force (N)")
            axis.legend()
        axes[-1][0].set_xlabel("time (us)")


def draw_field(path: Path, tap: SpringTap, store: Store) -> None:
    """Draw von Mises' stress at the tip in the plane of symmetry: theirs, ours, the difference."""
    from matplotlib.collections import PolyCollection

    theirs, own = calculix_tap(tap, store), reference_tap(tap, store)
    corners, cut = np.array(own.corners_mm), np.array(own.cut)
    other, mine = (1e-3 * np.array(of.von_mises_kPa)[cut] for of in (theirs, own))
    lowest = corners.reshape(-1, 2)[corners[..., 1].argmin()]
    near = np.linalg.norm(corners.mean(axis=1) - lowest, axis=1) < REACH_MM
    top = float(np.percentile(np.concatenate([other[near], mine[near]]), LIMIT))
    apart = float(np.abs(mine - other)[near].max())
    shown = (
        (f"{theirs.program}, {tap.element}", other, "viridis", (0.0, top)),
        ("fem3d, the same mesh and time", mine, "viridis", (0.0, top)),
        ("fem3d less CalculiX", mine - other, "RdBu_r", (-apart, apart)),
    )
    with panels(path, 1, 3, width=WIDTH, height=1.8, style={"axes.grid": False}) as axes:
        for (axis,), (name, values, colors, limits) in zip(axes, shown, strict=True):
            drawn = PolyCollection(corners[near], array=values[near], cmap=colors,
                                   edgecolors="#00000040", linewidths=0.2)  # fmt: skip
            drawn.set_clim(*limits)
            axis.add_collection(drawn)
            axis.autoscale_view()
            axis.set_aspect("equal")
            axis.set_title(name, fontsize=8)
            axis.figure.colorbar(drawn, ax=axis, label="von Mises (MPa)")
        axes[-1][0].set_xlabel("x, and upwards y (mm)")


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
    }  # fmt: skip
    write_page(folder / "index.html", "evidence.html.j2", context)
