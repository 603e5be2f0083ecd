"""A benchmark's output: tables with their machine, and one page of all that is in the folder."""

import json
import os
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from validation import DATA
from validation.harness.console import output
from validation.harness.files import write_json, write_text
from validation.harness.page import write_page
from validation.harness.provenance import provenance
from validation.harness.tables import for_people, table_of


def save(folder: Path, name: str, rows: Sequence[Any], caption: str, show: bool = True) -> None:
    """Write CSV, with the machine in every row, and Markdown; print the latter if `show`."""
    table = table_of(rows)
    where = provenance({})
    labelled = table.assign(
        processor=where["processor"], versions=json.dumps(where["versions"], sort_keys=True)
    )
    write_text(folder / f"{name}.csv", labelled.to_csv(index=False, float_format="%.10g"))
    people = for_people(table).to_markdown(index=False, disable_numparse=True)
    write_text(folder / f"{name}.md", f"{caption}. {where['processor']}.\n\n{people}\n")
    if show:
        output(f"\n{caption}\n{people}")


def save_machine(folder: Path, name: str, extra: Mapping[str, object]) -> None:
    """Write machine, versions, date and load: a time means nothing without them."""
    where = provenance({})
    where.pop("scene_toml")
    load = os.getloadavg() if hasattr(os, "getloadavg") else None
    write_json(folder / f"{name}.json", {**where, "load_average_at_start": load, **extra})


def _table(folder: Path, name: str) -> dict[str, Any] | None:
    path = folder / f"{name}.csv"
    if not path.is_file():
        return None
    table = for_people(pd.read_csv(path).drop(columns=["processor", "versions"]))
    return {"columns": list(table.columns), "rows": table.to_dict("records"), "name": name}


def page(folder: Path) -> Path:
    """Write ``index.html`` from all in the folder that ``data/bench_page.toml`` describes.

    Returns
    -------
    The page. A part that was measured on another day is dated by its own ``machine*.json``.
    """
    described = (DATA / "bench_page.toml").read_text("utf-8")
    sections = []
    for section in tomllib.loads(described)["section"]:
        figures = [folder / f"{name}.png" for name in section.get("figures", ())]
        shown = [path for path in figures if path.is_file()]
        tables = [found for name in section.get("tables", ()) if (found := _table(folder, name))]
        if shown or tables:
            sections.append({**section, "figures": shown, "tables": tables})
    machines = [
        {"part": path.stem, **json.loads(path.read_text(encoding="utf-8"))}
        for path in sorted(folder.glob("machine*.json"))
    ]
    path = folder / "index.html"
    write_page(path, "bench.html.j2", {"sections": sections, "machines": machines})
    return path
