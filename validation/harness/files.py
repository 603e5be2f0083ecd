"""Files of a run, each written whole or not at all: a temporary name, then a rename."""

import contextlib
import json
import os
import re
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import compress
from pathlib import Path
from typing import Any

import numpy as np

from validation.errors import UserError
from validation.harness.quantities import ESTIMATED
from validation.harness.record import FORCE_COLUMNS, RunRecord, plain


@contextlib.contextmanager
def atomic(path: Path) -> Iterator[Path]:
    """A temporary path beside ``path`` that takes its place if the block succeeds."""
    temporary = path.with_name(f".{path.name}.{os.urandom(4).hex()}{path.suffix}")
    try:
        # not `tempfile`, whose files are private: the modes of a result are the user's to mask
        temporary.touch(exist_ok=False)
        yield temporary
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write text atomically."""
    with atomic(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_json(path: Path, value: Mapping[str, Any]) -> None:
    """Write JSON atomically; what is not finite becomes null."""
    write_text(path, json.dumps(plain(value), indent=2, allow_nan=False) + "\n")


def output_folder(path: Path) -> Path:
    """Create the folder and prove that it can be written to, before any work is done.

    Raises
    ------
    UserError
        The folder cannot be created or written.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path):
            pass
    except (OSError, ValueError) as error:  # a path with a null byte is a ValueError
        raise UserError(
            f"--out {path}: cannot write there ({getattr(error, 'strerror', None) or error}); "
            "choose a folder that you may write to"
        ) from error
    return path


def safe_name(name: str) -> str:
    """A name that stays inside its folder, whatever the scene was called."""
    return re.sub(r"[^A-Za-z0-9._-]+", "_", name).strip(".") or "run"


def clear_run(folder: Path) -> None:
    """Remove what says that a run is complete: a kill must not leave two runs mixed in a folder."""
    names = ("error.txt", "summary.json", "history.nc", "curves.csv", "curves.csv.toml")
    for name in (*names, "fields/tap.pvd"):
        (folder / name).unlink(missing_ok=True)


@contextlib.contextmanager
def summary_last(folder: Path, record: RunRecord) -> Iterator[None]:
    """Write ``summary.json`` after what the block writes: it says that a run is there as a whole.

    Raises
    ------
    OSError
        As the block raised it. The summary, which needs least room, is tried nevertheless, and its
        message says what is not there.
    """
    folder.mkdir(parents=True, exist_ok=True)
    try:
        yield
    except OSError as error:
        lacking = f"history and fields could not all be written: {error.strerror or error}"
        message = "; ".join(filter(None, (record.message, lacking)))
        with contextlib.suppress(OSError):
            _write_summary(folder, replace(record, message=message))
        raise
    _write_summary(folder, record)


def write_run(folder: Path, record: RunRecord) -> None:
    """Write a run's history, its curves, and at last ``summary.json``; see `summary_last`."""
    with summary_last(folder, record):
        write_history(folder, record)


def write_history(folder: Path, record: RunRecord) -> None:
    """Write ``history.nc`` of a run that has a history, ``curves.csv`` of one that completed."""
    if record.history:
        # made in memory: HDF5 crashes the process where a disk fills up under it
        content = record.to_dataset().to_netcdf(engine="h5netcdf")
        with atomic(folder / "history.nc") as temporary:
            temporary.write_bytes(content)
    if record.ok:
        _write_curves(folder / "curves.csv", record)


def _write_curves(path: Path, record: RunRecord) -> None:
    """The contact force of every step, and beside it what no sample has: see ``curve_files``.

    Both give back the run's numbers and curves bit for bit, as ``--reference curves.csv``.
    """
    import tomli_w

    known = [name for name in FORCE_COLUMNS if name in record.contact_forces]
    curves = {name: record.contact_forces[name] for name in known}
    columns = {name: array.tolist() for name, array in curves.items() if np.isfinite(array).all()}
    if not {"time_s", "normal_force_N"} <= columns.keys():
        return
    # of two at one time, where another set of beams takes over, the later
    rises = np.append(np.diff(columns["time_s"]) > 0.0, True)
    kept = compress(zip(*columns.values(), strict=True), rises)
    rows = (",".join(map(repr, row)) for row in kept)
    stated = {
        "scene": record.scene,
        "source": f"fingertap {record.label}, {record.provenance.get('created', '')}",
        "half_model": False,
        "time_offset_s": 0.0,
        "scalars": {key: record.summary[key] for key in ESTIMATED if record.summary.get(key)},
        "uncertainty": {key: e for key, e in record.errors.items() if np.isfinite(e).all()},
    }
    write_text(path.with_name(f"{path.name}.toml"), tomli_w.dumps(plain(stated)))
    write_text(path, "\n".join([",".join(columns), *rows]) + "\n")


def _write_summary(folder: Path, record: RunRecord) -> None:
    write_json(
        folder / "summary.json",
        {
            **record.to_json(),
            "variant": record.variant,
            "status": record.status,
            "message": record.message,
            "events": [[event.time_s, event.kind] for event in record.events],
            "statistics": record.statistics,
            "provenance": record.provenance,
        },
    )
