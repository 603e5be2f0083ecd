"""Files of a run, each written whole or not at all: under a temporary name, then renamed."""

import contextlib
import fcntl
import hashlib
import json
import os
import re
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import compress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import numpy as np
from numpy.typing import NDArray

from validation.errors import UserError, file_reason, reason
from validation.harness.quantities import ESTIMATED
from validation.harness.record import FORCE_COLUMNS, RunRecord, plain

if TYPE_CHECKING:
    import xarray

    import reference_fem

LONGEST_NAME = 150  # file systems allow 255 bytes; temporary names and endings need some of them


@dataclass(frozen=True)
class Fields:
    """A solid run's mesh and its fields over time.

    points : (n_points, dim), m.
    cells : (n_cells, 8) hexahedra or (n_cells, 4) quadrilaterals, VTK order.
    steps : the reference's snapshots, in order of time.
    """

    points: NDArray[Any]
    cells: NDArray[Any]
    steps: "tuple[reference_fem.Snapshot, ...]"


@contextlib.contextmanager
def atomic(path: Path) -> Iterator[Path]:
    """A temporary path beside ``path`` that takes its place if the block succeeds."""
    temporary = path.with_name(f".{path.name}.{os.urandom(4).hex()}{path.suffix}")
    try:
        # not `tempfile`, whose files are private: the user's umask decides a result's mode
        temporary.touch(exist_ok=False)
        yield temporary
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def exclusive_folder(folder: Path) -> Iterator[Path]:
    """The `output_folder`, locked against other commands until the process ends at the latest.

    Do not nest it on one folder: a process holds a lock only once.

    Raises UserError: the folder cannot be written, or another command is at work there.
    """
    path = output_folder(folder) / ".in_use"
    with _locked(path):
        try:
            yield folder
        finally:
            with contextlib.suppress(OSError):
                path.unlink()


def _locked(path: Path) -> TextIO:
    """A lock's file, held by this process until it is closed."""
    while True:
        file = path.open("a")
        try:
            # of the process: unlike `flock`, not of workers, which may outlive it for a moment
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except (BlockingIOError, PermissionError):
            file.close()
            raise UserError(
                f"{path.parent}: another command is writing its results there; wait for it to end,"
                " or give another --out"
            ) from None
        except OSError:  # a file system without locks
            pass
        # its last owner may have removed the file, and another process may hold a new one
        with contextlib.suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(file.fileno()), path.stat()):
                return file
        file.close()


def write_text(path: Path, text: str) -> None:
    """Write text atomically."""
    with atomic(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_dataset(path: Path, dataset: "xarray.Dataset") -> None:
    """Write netCDF atomically, made in memory: HDF5 crashes the process on a disk that fills up."""
    content = dataset.to_netcdf(engine="h5netcdf")
    with atomic(path) as temporary:
        temporary.write_bytes(content)


def write_json(path: Path, value: Mapping[str, Any]) -> None:
    """Write JSON atomically; what is not finite becomes null."""
    write_text(path, json.dumps(plain(value), indent=2, allow_nan=False) + "\n")


def output_folder(path: Path) -> Path:
    """Create the folder and prove that it can be written to, before any work is done.

    Raises UserError: the folder cannot be created or written.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path):
            pass
    except (OSError, ValueError) as error:  # a path with a null byte is a ValueError
        raise UserError(
            f"--out {path}: cannot write there ({reason(error)}); "
            "choose a folder that you may write to"
        ) from error
    return path


def safe_name(name: str) -> str:
    """A file name that stays inside its folder, whatever the scene's name, and is not too long.

    Different names stay different: a name that has to be altered gets a digest of the original.
    """
    safe = re.sub(r"[^A-Za-z0-9._=-]+", "_", name).strip(".") or "run"
    if safe == name and len(safe) <= LONGEST_NAME:
        return safe
    digest = hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()[:8]
    return f"{safe[:LONGEST_NAME]}-{digest}"


def clear_run(folder: Path) -> None:
    """Remove the files that mark a run as complete, then the fields of its steps: a kill must not
    leave two runs mixed in a folder.
    """
    names = ("error.txt", "summary.json", "history.nc", "curves.csv", "curves.csv.toml")
    steps = (folder / "fields").glob("tap_*.vtu")
    for path in (*(folder / name for name in (*names, "fields/tap.pvd")), *steps):
        path.unlink(missing_ok=True)


def write_run(folder: Path, record: RunRecord, fields: Fields | None = None) -> None:
    """Write a run's fields, if it has any, its history and curves, and last ``summary.json``.

    The summary marks the run as complete.

    Raises OSError: not all could be written. The summary, which needs least room, is tried
        nevertheless, and its message says what is missing.
    """
    folder.mkdir(parents=True, exist_ok=True)
    try:
        if fields is not None and fields.steps:
            write_fields(folder / "fields", fields)
        write_history(folder, record)
    except OSError as error:
        lacking = f"history and fields could not all be written: {file_reason(error)}"
        message = "; ".join(filter(None, (record.message, lacking)))
        with contextlib.suppress(OSError):
            _write_summary(folder, replace(record, message=message))
        raise
    _write_summary(folder, record)


def write_history(folder: Path, record: RunRecord) -> None:
    """Write ``history.nc`` of a run that has a history, ``curves.csv`` of one that completed."""
    if record.history:
        write_dataset(folder / "history.nc", record.to_dataset())
    if record.ok:
        _write_curves(folder / "curves.csv", record)


def _write_curves(path: Path, record: RunRecord) -> None:
    """The contact force at every step, and in TOML what is not sampled: see ``curve_files``.

    Together, as ``--reference curves.csv``, they return the run's numbers and curves bit for bit.
    """
    import tomli_w

    known = [name for name in FORCE_COLUMNS if name in record.contact_forces]
    curves = {name: record.contact_forces[name] for name in known}
    columns = {name: array.tolist() for name, array in curves.items() if np.isfinite(array).all()}
    if not {"time_s", "normal_force_N"} <= columns.keys():
        return
    # of two samples at one time, where another set of beams takes over, keep the later
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


def _three(vectors: NDArray[Any]) -> NDArray[Any]:
    """Vectors padded to three components, which VTK needs."""
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))


def write_fields(folder: Path, fields: Fields) -> Path:
    """Write ``tap.pvd`` and one VTU per step; returns the PVD's path.

    ParaView, PyVista and meshio open them.

    Raises OSError: not all could be written; the others are removed, as no index names them.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "tap.pvd"
    files = [folder / f"tap_{number:03d}.vtu" for number in range(len(fields.steps))]
    entries = [
        f'    <DataSet timestep="{step.time_s!r}" part="0" file="{file.name}"/>\n'
        for step, file in zip(fields.steps, files, strict=True)
    ]
    try:
        for step, file in zip(fields.steps, files, strict=True):
            _write_step(file, fields, step)
        write_text(
            path,
            '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n'
            + "".join(entries)
            + "  </Collection>\n</VTKFile>\n",
        )
    except OSError:
        for file in files:
            file.unlink(missing_ok=True)
        raise
    return path


def _write_step(path: Path, fields: Fields, step: "reference_fem.Snapshot") -> None:
    import meshio

    kind = "hexahedron" if fields.cells.shape[1] == 8 else "quad"
    mesh = meshio.Mesh(
        _three(fields.points),
        [(kind, fields.cells)],
        point_data={
            "displacement": _three(step.displacement),
            "velocity": _three(step.velocity),
            "contact_pressure_Pa": step.contact_pressure_Pa,
        },
        cell_data={"von_mises_Pa": [step.von_mises_Pa]},
    )
    with atomic(path) as temporary:
        mesh.write(temporary, file_format="vtu")
