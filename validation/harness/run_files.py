"""A run's folder: summary, history, curves and fields."""

import contextlib
from dataclasses import dataclass, replace
from itertools import compress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from validation.errors import file_reason
from validation.harness.files import atomic, write_dataset, write_json, write_text
from validation.harness.quantities import ESTIMATED
from validation.harness.record import FORCE_COLUMNS, RunRecord, plain

if TYPE_CHECKING:
    import reference_fem


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
    further = ("variant", "status", "message", "events", "statistics", "provenance")
    values = {name: getattr(record, name) for name in further}
    write_json(folder / "summary.json", record.to_json() | values)


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
