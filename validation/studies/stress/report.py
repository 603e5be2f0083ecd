"""The output of a campaign: a table and a figure per map, and the page."""

import textwrap
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hcm.stepping import LARGEST_RESIDUAL
from validation.harness.figures import BLUE, GREEN, GREY, ORANGE, panels
from validation.harness.page import write_page
from validation.harness.provenance import provenance
from validation.harness.tables import table_of, write_table
from validation.studies.stated_errors import UNDERSTATED_FACTOR, WRONG_SHARE
from validation.studies.stress.limits import limit
from validation.studies.stress.reference.judge import OTHER_SCHEME_WITHIN
from validation.studies.stress.stability_map import RIGHT_WITHIN, Answer, Map

COLORS = {
    Answer.RIGHT: GREEN, Answer.SMALLER: "#7fcfb5", Answer.REFUSED: GREY, Answer.STOPPED: BLUE,
    Answer.UNDERSTATED: "#e69f00", Answer.FLAGGED: "#f0e442", Answer.WRONG: ORANGE,
}  # fmt: skip


def table_rows(wanted: Map, verdicts: Iterator[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """A row for each cell of a map, with the next verdicts of the iterator."""
    places = ((cell.x, cell.y, cell.panel) for cell in wanted.cells())
    return [
        {**dict(zip(wanted.axes, place, strict=False)), **verdict}
        for place, verdict in zip(places, verdicts, strict=False)
    ]


def _ticks(values: Sequence[float], most: int) -> tuple[list[int], list[str]]:
    every = max(1, -(-len(values) // most))
    places = list(range(0, len(values), every))
    return places, [f"{values[i]:.2g}" for i in places]


def draw_map(path: Path, wanted: Map, rows: Sequence[Mapping[str, Any]], limits: str) -> None:
    """Draw one map under a title that says what limits it.

    rows : from `table_rows`; cells without one stay white.
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
        codes[place] = list(Answer).index(row["answer"])
    with panels(path, count, style={"axes.grid": False}, figsize=size, sharey=True) as axes:
        for axis, panel, code in zip(axes[0], wanted.panels, codes, strict=True):
            axis.imshow(code, origin="lower", aspect="auto", cmap=colors, vmin=-0.5,
                        vmax=len(Answer) - 0.5, interpolation="nearest")  # fmt: skip
            axis.set_xticks(*_ticks(wanted.x, 4))
            axis.set_yticks(*_ticks(wanted.y, 6))
            axis.set_xlabel(wanted.x_name)
            if wanted.panel_name:
                axis.set_title(f"{wanted.panel_name} = {panel:g}", fontsize=9)
        axes[0][0].set_ylabel(wanted.y_name)
        seen = [answer for answer in Answer if answer in {row["answer"] for row in rows}]
        patches = [Patch(color=COLORS[answer], label=answer) for answer in seen]
        figure = axes[0][0].figure
        figure.legend(handles=patches, loc="outside lower center", ncols=len(patches) or 1)
        title = textwrap.fill(f"{wanted.name}: {limits}", int(16 * size[0]))
        figure.suptitle(title, fontsize=8, x=0.01, ha="left")


def write_map(folder: Path, wanted: Map, rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Write a map's table and figure; returns its row of the summary.

    A list of scenes (a map of one y) gets no figure.
    """
    write_table(folder, wanted.name, table_of(rows), f"Map {wanted.name}: {wanted.solver}")
    limits = limit(wanted, rows)
    if len(wanted.y) > 1:
        draw_map(folder / f"{wanted.name}.png", wanted, rows, limits)
    counts = Counter(row["answer"] for row in rows)
    head = {"map": wanted.name, "solver": wanted.solver, "cells": len(rows)}
    return head | {str(a): counts[a] for a in Answer} | {"what limits it": limits}


def write_stress_page(
    folder: Path,
    summary: Sequence[Mapping[str, Any]],
    peers: Sequence[Mapping[str, Any]],
    reference_peers: Sequence[Mapping[str, Any]],
) -> None:
    """Write ``index.html``; `summary` has a row per map, the peers' are tables of ``--peers``."""
    counts = {answer: sum(int(row[answer]) for row in summary) for answer in map(str, Answer)}
    shown = [answer for answer in counts if counts[answer] or answer == Answer.WRONG]
    drawn = {row["map"]: folder / f"{row['map']}.png" for row in summary}
    write_page(
        folder / "index.html",
        "stress.html.j2",
        {
            "summary": summary,
            "columns": ["map", "solver", "cells", *shown],
            "total": sum(counts.values()),
            "counts": counts,
            "wrong": counts[Answer.WRONG],
            "figures": [
                (path, f"{row['solver']}, {row['map']}: {row['what limits it']}.")
                for row in summary
                if (path := drawn[row["map"]]).exists()
            ],
            "lists": [row for row in summary if not drawn[row["map"]].exists()],
            "peers": peers,
            "reference_peers": reference_peers,
            "largest_error": RIGHT_WITHIN,
            "times": UNDERSTATED_FACTOR,
            "wrong_share": WRONG_SHARE,
            "other": OTHER_SCHEME_WITHIN,
            "energy_share": LARGEST_RESIDUAL,
            "provenance": provenance({}),
        },
    )
