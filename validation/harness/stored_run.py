"""A run as a store's entry: ``record.json``, ``history.npz``, ``forces.npz``, ``fields/``.

Only solids have the last one.
"""

import json
import math
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from validation.harness.files import atomic
from validation.harness.record import FORCE_COLUMNS, Event, RunRecord, plain
from validation.harness.record_schema import check_arrays, record_values
from validation.harness.run_files import Fields, clear_run, write_fields
from validation.harness.store import Inputs, Store

CORNERS = {2: 4, 3: 8}  # corners of a cell, by the dimension of its points
RECORD, HISTORY, FORCES, FIELDS = "record.json", "history.npz", "forces.npz", "fields"


def _json(record: RunRecord) -> str:
    elsewhere = ("history", "forces", "read_back")
    values = {name: value for name, value in vars(record).items() if name not in elsewhere}
    # in JSON infinity is null: what was not estimated is left out instead
    values["accuracy"] = {k: v for k, v in record.accuracy.items() if v is not None}
    return json.dumps(plain(values), allow_nan=False)


def check_run(record: RunRecord) -> None:
    """Check the record that a model returned, before it is used.

    Raises TypeError: it is not a `RunRecord`. Raises ValueError: a scalar or a force of a completed
        run is not finite, or the record is invalid; names what is wrong.
    """
    if not isinstance(record, RunRecord):
        raise TypeError(f"its run gave {type(record).__name__} as record, not RunRecord")
    for key, value in record.summary.items():
        if record.ok and isinstance(value, float) and not math.isfinite(value):
            raise ValueError(f"{key} = {value} is not finite")
    record_values(_json(record).encode())
    check_arrays(record.history, ("time_s",))
    check_arrays(record.forces, FORCE_COLUMNS)
    if record.ok and not np.isfinite(record.contact_forces["normal_force_N"]).all():
        raise ValueError("normal_force_N is not finite")


def check_given_fields(fields: object) -> None:
    """Check the fields that a model returned, before they are written.

    Raises TypeError: they are not `Fields`. Raises ValueError: the cells do not fit the points, or
        the arrays of a step do not fit both.
    """
    if fields is None:
        return
    if not isinstance(fields, Fields):
        raise TypeError(f"its run gave {type(fields).__name__} as fields, not Fields")
    points, cells = np.asarray(fields.points), np.asarray(fields.cells)
    flat = points.ndim != 2 or cells.ndim != 2
    if flat or cells.shape[1] != CORNERS.get(points.shape[1]):
        raise ValueError(
            f"fields.points are {points.shape}, fields.cells {cells.shape}: must be (n, 2) and"
            " (m, 4), or (n, 3) and (m, 8)"
        )
    if points.dtype.kind not in "iuf" or not np.isfinite(points).all():
        raise ValueError("fields.points are not all finite real numbers")
    if cells.dtype.kind not in "iu" or not cells.size:
        raise ValueError(f"fields.cells are {len(cells)} of {cells.dtype}: must be whole numbers")
    if cells.min(initial=0) < 0 or cells.max(initial=0) >= len(points):
        ends = f"{cells.min()} to {cells.max()}"
        raise ValueError(f"fields.cells name points {ends}, but there are {len(points)}")
    needed = {"displacement": points.shape, "velocity": points.shape,
              "von_mises_Pa": (len(cells),), "contact_pressure_Pa": (len(points),)}  # fmt: skip
    for step in fields.steps:
        for name, must_be in needed.items():
            if (shape := np.shape(getattr(step, name))) != must_be:
                raise ValueError(f"fields.steps: {name} is {shape}: must be {must_be}")


def write_record(folder: Path, record: RunRecord) -> None:
    """Write a record; its floats and arrays come back bit for bit."""
    (folder / RECORD).write_text(_json(record), encoding="utf-8")
    for name, arrays in ((HISTORY, record.history), (FORCES, record.forces)):
        with (folder / name).open("wb") as file:
            np.savez(file, allow_pickle=False, **arrays)


def read_record(folder: Path) -> RunRecord:
    """Read the record that `write_record` wrote, marked as read back."""
    values = record_values((folder / RECORD).read_bytes())
    history, forces = (_read_arrays(folder / name) for name in (HISTORY, FORCES))
    check_arrays(history, ("time_s",))
    check_arrays(forces, FORCE_COLUMNS)
    values["events"] = tuple(Event(*event) for event in values["events"])
    return RunRecord(**values, history=history, forces=forces, read_back=True)


def _read_arrays(path: Path) -> dict[str, np.ndarray]:
    with np.load(path, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


def relabelled(
    record: RunRecord, scene: str, variant: str | None, document: dict[str, Any]
) -> RunRecord:
    """The record under the names of this run: one result may serve several runs.

    variant : None keeps the record's own.
    document : the scene's tables as they were read.
    """
    return replace(
        record,
        scene=scene,
        variant=record.variant if variant is None else variant,
        provenance={**record.provenance, "scene_toml": tomli_w.dumps(document)},
    )


def keep_run(store: Store, inputs: Inputs, record: RunRecord, fields: Fields | None = None) -> bool:
    """Store a run if it completed, as others must run again; return whether it is stored."""
    if not record.ok:
        return False

    def write(folder: Path) -> None:
        write_record(folder, record)
        if fields is not None and fields.steps:
            write_fields(folder / FIELDS, fields)

    return store.keep(inputs, write)


def load_run(store: Store, inputs: Inputs) -> RunRecord | None:
    """The stored run's record, None if there is none."""
    return store.load(inputs, lambda entry: _record_of(entry, inputs))


def _record_of(entry: Path, inputs: Inputs) -> RunRecord:
    """The record of an entry; raises ValueError unless it is of a completed run of this model."""
    record = read_record(entry)
    if not record.ok or record.model != inputs.get("model", record.model):
        raise ValueError(f"holds a run of {record.model} that ended {record.status}")
    return record


def _fields_of(entry: Path) -> Path:
    """The folder of an entry's fields, which may not exist; raises ValueError if it is damaged."""
    folder = entry / FIELDS
    paths = list(folder.iterdir()) if folder.exists() else []
    wanted = {"tap.pvd", *(f"tap_{number:03d}.vtu" for number in range(len(paths) - 1))}
    if paths and not ({p.name for p in paths} == wanted and all(p.is_file() for p in paths)):
        raise ValueError(f"{FIELDS} holds {len(paths)} files, not an index and its steps")
    return folder


def restore_run(store: Store, inputs: Inputs, folder: Path, fields: bool) -> RunRecord | None:
    """The stored run's record, with its fields copied to `folder`; None if there is none.

    What a run's folder held before is removed; the caller writes the record's files.
    """
    found = store.load(inputs, lambda entry: (_record_of(entry, inputs), _fields_of(entry)))
    if found is None:
        return None
    record, source = found
    clear_run(folder)
    try:
        if fields:
            copy_fields(source, folder / FIELDS)
    except FileNotFoundError:
        return None  # another process is replacing the entry
    return record


def copy_fields(source: Path, folder: Path) -> None:
    """Copy a run's fields, the index of their steps last."""
    if not source.is_dir():
        return
    folder.mkdir(parents=True, exist_ok=True)
    for path in sorted(source.iterdir(), key=lambda path: path.suffix == ".pvd"):
        with atomic(folder / path.name) as temporary:
            shutil.copyfile(path, temporary)
