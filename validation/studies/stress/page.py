"""The page of a campaign: counts, definition of right, maps with a sentence each, peers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from validation.harness.page import write_page
from validation.harness.provenance import provenance
from validation.studies.stress.hcm.audit import ENERGY_SHARE
from validation.studies.stress.reference.judge import OTHER
from validation.studies.stress.stability_map import ANSWERS, LARGEST_ERROR, WRONG


def write_stress_page(
    folder: Path,
    summary: Sequence[Mapping[str, Any]],
    peers: Sequence[Mapping[str, Any]],
    reference_peers: Sequence[Mapping[str, Any]],
) -> None:
    """Write ``index.html``: `summary` has a row a map, the peers' are the tables of ``--peers``."""
    counts: Counter[str] = Counter()
    for row in summary:
        counts.update({answer: int(row[answer]) for answer in ANSWERS})
    figures = [
        (folder / f"{row['map']}.png", f"{row['solver']}, {row['map']}: {row['what limits it']}.")
        for row in summary
        if (folder / f"{row['map']}.png").exists()
    ]
    lists = [row for row in summary if not (folder / f"{row['map']}.png").exists()]
    write_page(
        folder / "index.html",
        "stress.html.j2",
        {
            "summary": summary,
            "columns": ["map", "solver", "cells", *(a for a in ANSWERS if counts[a] or a == WRONG)],
            "total": sum(counts.values()),
            "counts": counts,
            "wrong": counts[WRONG],
            "figures": figures,
            "lists": lists,
            "peers": peers,
            "reference_peers": reference_peers,
            "largest_error": LARGEST_ERROR,
            "other": OTHER,
            "energy_share": ENERGY_SHARE,
            "provenance": provenance({}),
        },
    )
