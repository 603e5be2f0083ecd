"""A benchmark's output: tables with their machine, and one page of all that is in the folder."""

import json
import os
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pandas as pd

from validation import DATA
from validation.harness.console import output
from validation.harness.files import remove, write_json
from validation.harness.page import write_page
from validation.harness.provenance import now, provenance
from validation.harness.tables import for_people, table_of, write_table
from validation.studies.bench.work_precision import Point


def save(folder: Path, name: str, rows: Sequence[Any], caption: str, show: bool = True) -> None:
    """Write a table, with the machine in every row of its CSV; print it if `show`."""
    table = table_of(rows)
    where = provenance({})
    labelled = table.assign(
        processor=where["processor"], versions=json.dumps(where["versions"], sort_keys=True)
    )
    written = write_table(folder, name, labelled, f"{caption}. {where['processor']}.", table)
    if show:
        output(f"\n{written}")


@contextmanager
def measured_part(folder: Path, quick: bool, *names: str, **extra: object) -> Iterator[list[Point]]:
    """Measure a part, whose files have these names, anew: older ones are removed.

    ``machine-*.json`` keeps its machine, versions, load and dates: a time means nothing without
    them. A part that is killed in here stays marked as stopped.

    Yields
    ------
    A list that takes the part's points, if it has any: those read back have dates of their own.
    """
    remove(folder, *(f"{name}.*" for name in names))
    where = provenance({})
    where.pop("scene_toml")
    load = os.getloadavg() if hasattr(os, "getloadavg") else None
    path, points = folder / f"machine-{names[0]}.json", list[Point]()
    record = {**where, "part": names[0], "files": names, "quick": quick, "stopped": True,
              "load_average_at_start": load, **extra}  # fmt: skip
    write_json(path, record)
    yield points
    dates = sorted(point.measured for point in points) or [where["created"], now()]
    back = sum(point.read_back for point in points)
    ended = {"created": dates[0], "until": dates[-1], "stopped": False,
             "read_back": f"{back} of {len(points)}" if back else "",
             "load_average_at_start": None if back and back == len(points) else load}  # fmt: skip
    write_json(path, record | ended)


def _when(record: Mapping[str, Any]) -> str:
    """When a part was measured, and how."""
    last = record.get("until", record["created"])
    said = record["created"] + (f" to {last}" if last != record["created"] else "")
    said += ", quick" if record["quick"] else ""
    if record.get("read_back"):
        said += f"; settings read back from an earlier benchmark: {record['read_back']}"
    return said + ("; it was stopped, and this is what it had" if record["stopped"] else "")


def _table(folder: Path, name: str) -> dict[str, Any] | None:
    path = folder / f"{name}.csv"
    if not path.is_file():
        return None
    table = for_people(pd.read_csv(path).drop(columns=["processor", "versions"]))
    return {"columns": list(table.columns), "rows": table.to_dict("records"), "name": name}


def page(folder: Path) -> Path:
    """Write ``index.html`` from all in the folder that ``data/bench_page.toml`` describes.

    Each section says when its parts were measured; what no `measured_part` wrote is not shown.
    """
    described = (DATA / "bench_page.toml").read_text("utf-8")
    records = [json.loads(path.read_text("utf-8")) for path in folder.glob("machine-*.json")]
    part_of = {name: record for record in records for name in record.get("files", ())}
    sections, machines = [], dict[str, dict[str, Any]]()
    for section in tomllib.loads(described)["section"]:
        figures, names = (
            [name for name in section.get(kind, ()) if name in part_of]
            for kind in ("figures", "tables")
        )
        shown = [path for name in figures if (path := folder / f"{name}.png").is_file()]
        tables = [found for name in names if (found := _table(folder, name))]
        parts = [part_of[name] for name in (*(p.stem for p in shown), *(t["name"] for t in tables))]
        if parts:
            mine = {one["part"]: {**one, "when": _when(one)} for one in parts}
            machines |= mine
            dates = [f"{part}: measured {one['when']}." for part, one in mine.items()]
            notes = [*section.get("notes", ()), *dates]
            sections.append({**section, "notes": notes, "figures": shown, "tables": tables})
    path = folder / "index.html"
    context = {"sections": sections, "machines": machines.values()}
    write_page(path, "sections.html.j2", context)
    return path
