"""What a campaign leaves: a table and a figure a map, and the page."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from validation.harness.line_store import LineStore
from validation.harness.page import write_page
from validation.harness.provenance import provenance
from validation.harness.tables import write_table
from validation.studies.stress.campaign import verdict_inputs
from validation.studies.stress.figures import draw_map
from validation.studies.stress.hcm.audit import ENERGY_SHARE
from validation.studies.stress.limits import limit
from validation.studies.stress.reference.judge import OTHER
from validation.studies.stress.stability_map import LARGEST_ERROR, Answer, Map


def table_rows(wanted: Map, finished: LineStore) -> list[dict[str, Any]]:
    """One row per finished cell of a map."""
    rows = []
    for cell in wanted.cells():
        verdict = finished.load(verdict_inputs(cell))
        if verdict is not None:
            where = {wanted.x_name: cell.x, wanted.y_name: cell.y}
            if wanted.panel_name:
                where[wanted.panel_name] = cell.panel
            rows.append({**where, **verdict})
    return rows


def write_map(folder: Path, wanted: Map, rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Write a map's table and figure; its row of the summary.

    A list of scenes (a map of one y) gets no figure.
    """
    import pandas as pd

    write_table(folder, wanted.name, pd.DataFrame(rows), f"Map {wanted.name}: {wanted.solver}")
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
    """Write ``index.html``: `summary` has a row a map, the peers' are the tables of ``--peers``."""
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
            "largest_error": LARGEST_ERROR,
            "other": OTHER,
            "energy_share": ENERGY_SHARE,
            "provenance": provenance({}),
        },
    )
