"""What a benchmark leaves: tables with their machine, and one page of all that is there."""

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from validation.harness.console import output
from validation.harness.files import write_json, write_text
from validation.harness.page import write_page
from validation.harness.provenance import provenance
from validation.harness.tables import for_people, table_of


@dataclass(frozen=True)
class Section:
    """A section of the page: what it says, and the files that it shows where they exist."""

    title: str
    notes: tuple[str, ...]
    figures: tuple[str, ...] = ()
    tables: tuple[str, ...] = ()


SECTIONS = (
    Section(
        "What an error costs: both models",
        (
            "Soft finger, from rest to separation. Each model's errors are against its own"
            " converged truth, since the truths differ; the dashed line is how far apart they are."
            " Lines join the settings that no other one beats, dotted lines are the truths' own"
            " errors, crosses runs that failed.",
            "Time is the solve alone, compiled code loaded, the shortest of several runs. The"
            " reference skips the flight by its own rigid chain; hcm integrates it.",
        ),
        ("work-precision-all",),
        ("truths",),
    ),
    Section(
        "hcm",
        (
            "Row tap: from rest, errors against hcm.reference_solution with the same five"
            " elements a phalanx, that is of time integration. Row contact: from one rigid impact"
            " state, against 20 elements a phalanx, that is of the mesh.",
            "The tap's peak and duration stay some 5e-5 off whatever the contact's step: small fast"
            " vibrations from the fall, whose phase at the touch only the flight's step improves."
            " The contact alone meets hcm.reference_solution to 1e-8.",
        ),
        ("work-precision-hcm",),
    ),
    Section(
        "The reference",
        (
            "3D and plane stress, from rest. The mesh's series refines the tip alone. The last"
            " step's point is beyond the stable step: its cross is what a run says that fails.",
        ),
        ("work-precision-reference",),
    ),
    Section("Cost of hcm's step against size", (), ("scaling",), ("scaling",)),
    Section(
        "Random scenes through hcm",
        (
            "Scenes of `fingertap stress`, far beyond any finger, of at most 3,000 steps each, on"
            " all cores; compiled code loaded.",
        ),
        (),
        ("throughput",),
    ),
    Section("The reference's kernels", (), ("kernels",), ("kernels",)),
    Section(
        "The skip ledger",
        (
            "Each shortcut on and off, the two runs taking turns: what it saves in time, what it"
            " changes in the result.",
        ),
        ("skips",),
        ("skips",),
    ),
    Section(
        "Peers of the reference on one bar",
        (
            "A free bar of cubes in axial vibration; whole explicit steps, the same number of"
            " threads, one run after the other. off_exact is the end's displacement against the"
            " standing wave, off_fingertap against ours.",
        ),
        ("peers-reference",),
        ("peers-reference",),
    ),
    Section("Peers of hcm on its scene", (), ("peers",), ("peers-cheapest",)),
    Section("Every setting", (), (), ("work-precision", "peers")),
)


def save(folder: Path, name: str, rows: Sequence[Any], caption: str, show: bool = True) -> None:
    """Write CSV, with the machine in every row, and Markdown; print the latter where `show`.

    rows : mappings or dataclass instances.
    """
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
    import pandas as pd

    path = folder / f"{name}.csv"
    if not path.is_file():
        return None
    table = for_people(pd.read_csv(path).drop(columns=["processor", "versions"]))
    return {"columns": list(table.columns), "rows": table.to_dict("records"), "name": name}


def page(folder: Path) -> Path:
    """Write ``index.html`` of all tables and figures that are in the folder.

    Returns
    -------
    The page. A part that was measured on another day is dated by its own ``machine*.json``.
    """
    sections = []
    for section in SECTIONS:
        figures = [folder / f"{name}.png" for name in section.figures]
        shown = [path for path in figures if path.is_file()]
        tables = [t for t in (_table(folder, name) for name in section.tables) if t is not None]
        if shown or tables:
            sections.append({**vars(section), "figures": shown, "tables": tables})
    machines = [
        {"part": path.stem, **json.loads(path.read_text(encoding="utf-8"))}
        for path in sorted(folder.glob("machine*.json"))
    ]
    path = folder / "index.html"
    write_page(path, "bench.html.j2", {"sections": sections, "machines": machines})
    return path
