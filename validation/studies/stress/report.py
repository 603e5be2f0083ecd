"""The output of a campaign: a table and a figure per map, what limits it, and the page."""

import re
import textwrap
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hcm.stepping import LARGEST_RESIDUAL
from validation.harness.figures import BLUE, GREEN, GREY, ORANGE, panels
from validation.harness.page import write_page
from validation.harness.tables import table_of, write_table
from validation.harness.uncertainty import without_numbers
from validation.studies.stated_errors import UNDERSTATED_FACTOR, WRONG_SHARE
from validation.studies.stress.reference.judge import OTHER_SCHEME_WITHIN
from validation.studies.stress.stability_map import RIGHT_WITHIN, Answer, Map

COLORS = {
    Answer.RIGHT: GREEN, Answer.SMALLER: "#7fcfb5", Answer.REFUSED: GREY, Answer.STOPPED: BLUE,
    Answer.UNDERSTATED: "#e69f00", Answer.FLAGGED: "#f0e442", Answer.WRONG: ORANGE,
}  # fmt: skip
# The middle share of a group's values that "mostly" stands for.
MOSTLY = 0.8


def table_rows(wanted: Map, verdicts: Iterator[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """A row for each cell of a map, with the next verdicts of the iterator."""
    found = zip(wanted.cells(), verdicts, strict=False)
    return [{**place, **verdict} for (place, _), verdict in found]


def _cause(row: Mapping[str, Any]) -> str:
    """The cause of a cell's answer: the solver's reason to stop, a refused parameter, a caution."""
    reason = str(row["reason"])
    if row["answer"] == Answer.STOPPED:
        return f"stopped: {reason.partition(' at t =')[0]}"
    if row["answer"] == Answer.REFUSED:
        return f"refused: {_kind(reason.partition(' =')[0])}"
    if row["answer"] == Answer.FLAGGED and reason:
        return f"flagged: {_kind(reason.removeprefix('cautioned, '))}"
    return str(row["answer"])


def _kind(reason: str) -> str:
    """The first clause of a reason, with n for numbers: the same for reasons of one kind."""
    clause = re.split(r"[,:;] | at t =", re.sub(r" \([^)]*\)", "", reason))[0]
    return without_numbers(clause)


def _where(name: str, axis: Sequence[float], values: Sequence[float]) -> str | None:
    """The range in which most of the values lie, None if it is the whole axis."""
    ordered = sorted(values)
    cut = int(0.5 * (1 - MOSTLY) * len(ordered))
    low, high = ordered[cut], ordered[-1 - cut]
    if len(axis) < 2 or (low == min(axis) and high == max(axis)):
        return None
    label = name.partition(" (")[0].replace("_", " ")
    if low == high:
        return f"{label} {low:.3g}"
    if low == min(axis):
        return f"{label} up to {high:.3g}"
    return f"{label} from {low:.3g}" if high == max(axis) else f"{label} {low:.3g} to {high:.3g}"


def limit(wanted: Map, rows: Sequence[Mapping[str, Any]]) -> str:
    """A sentence on why cells have no right answer: causes, how many cells, and mostly where."""
    groups: dict[str, list[Mapping[str, Any]]] = defaultdict(list)
    for row in rows:
        if row["answer"] not in (Answer.RIGHT, Answer.SMALLER):
            groups[_cause(row)].append(row)
    if not groups:
        return "every cell is right"
    sentences = []
    for cause, cells in sorted(groups.items(), key=lambda group: -len(group[1])):
        places = [
            place
            for name, axis in wanted.axes.items()
            if "seed" not in wanted.axes
            and (place := _where(name, axis, [float(cell[name]) for cell in cells]))
        ]  # fmt: skip
        at = f", mostly at {', '.join(places)}" if places else ""
        sentences.append(f"{cause} ({len(cells)} of {len(rows)}{at})")
    return "; ".join(sentences)


def _ticks(values: Sequence[float], most: int) -> tuple[list[int], list[str]]:
    every = max(1, -(-len(values) // most))
    places = list(range(0, len(values), every))
    return places, [f"{values[i]:.2g}" for i in places]


def draw_map(path: Path, wanted: Map, rows: Sequence[Mapping[str, Any]], limits: str) -> None:
    """Draw one map under a title that says what limits it.

    rows : from `table_rows`, of the first cells; those without one stay white.
    """
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    colors = ListedColormap([COLORS[answer] for answer in Answer])
    (x_name, x), (y_name, y), *others = wanted.axes.items()
    panel_name, values = others[0] if others else ("", (0.0,))
    count = len(values)
    size = 1.2 + 2.9 * count, 3.6
    codes = np.full((count, len(y), len(x)), np.nan)  # as `Map.cells` are ordered
    codes.flat[: len(rows)] = [list(Answer).index(row["answer"]) for row in rows]
    with panels(path, count, style={"axes.grid": False}, figsize=size, sharey=True) as axes:
        for axis, panel, code in zip(axes[0], values, codes, strict=True):
            axis.imshow(code, origin="lower", aspect="auto", cmap=colors, vmin=-0.5,
                        vmax=len(Answer) - 0.5, interpolation="nearest")  # fmt: skip
            axis.set_xticks(*_ticks(x, 4))
            axis.set_yticks(*_ticks(y, 6))
            axis.set_xlabel(x_name)
            if panel_name:
                axis.set_title(f"{panel_name} = {panel:g}", fontsize=9)
        axes[0][0].set_ylabel(y_name)
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
    _, y, *_ = wanted.axes.values()
    if len(y) > 1:
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
        },
    )
