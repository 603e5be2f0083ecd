"""Stability maps as pictures: one colour an answer, panels side by side."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from validation.harness.figures import BLUE, GREEN, GREY, ORANGE, panels
from validation.studies.stress.stability_map import Answer, Map

COLORS = {
    Answer.RIGHT: GREEN, Answer.SMALLER: "#7fcfb5", Answer.REFUSED: GREY, Answer.STOPPED: BLUE,
    Answer.FLAGGED: "#f0e442", Answer.WRONG: ORANGE,
}  # fmt: skip
ANSWERS = list(Answer)


def _ticks(values: Sequence[float], most: int) -> tuple[list[int], list[str]]:
    every = max(1, -(-len(values) // most))
    places = list(range(0, len(values), every))
    return places, [f"{values[i]:.2g}" for i in places]


def draw_map(path: Path, wanted: Map, rows: Sequence[Mapping[str, Any]], limits: str) -> None:
    """Draw one map under what limits it.

    rows : of the finished cells, as `report.table_rows` has them; other cells stay white.
    """
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    colors = ListedColormap([COLORS[answer] for answer in Answer])
    count = len(wanted.panels)
    size = 1.2 + 2.9 * count, 3.6
    codes = np.full((count, len(wanted.y), len(wanted.x)), np.nan)
    for row in rows:
        panel = row[wanted.panel_name] if wanted.panel_name else wanted.panels[0]
        place = (wanted.panels.index(panel), wanted.y.index(row[wanted.y_name]),
                 wanted.x.index(row[wanted.x_name]))  # fmt: skip
        codes[place] = ANSWERS.index(row["answer"])
    with panels(path, count, style={"axes.grid": False}, figsize=size, sharey=True) as axes:
        for axis, panel, code in zip(axes[0], wanted.panels, codes, strict=True):
            axis.imshow(code, origin="lower", aspect="auto", cmap=colors, vmin=-0.5,
                        vmax=len(Answer) - 0.5, interpolation="nearest")  # fmt: skip
            axis.set_xticks(*_ticks(wanted.x, 4))
            axis.set_yticks(*_ticks(wanted.y, 6))
            axis.set_xlabel(wanted.x_name)
            if wanted.panel_name:
                axis.set_title(f"{wanted.panel_name} = {panel:g}", fontsize=9, loc="left")
        axes[0][0].set_ylabel(wanted.y_name)
        seen = [answer for answer in Answer if answer in {row["answer"] for row in rows}]
        patches = [Patch(color=COLORS[answer], label=answer) for answer in seen]
        figure = axes[0][0].figure
        figure.legend(handles=patches, loc="outside lower center", ncols=len(patches) or 1)
        title = textwrap.fill(f"{wanted.name}: {limits}", int(16 * size[0]))
        figure.suptitle(title, fontsize=8, x=0.01, ha="left")
