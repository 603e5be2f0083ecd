"""Reading a run's folder for drawing; its files may be damaged or written by others."""

import json
import math
import tomllib
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from validation.errors import UserError, in_one_line

FIELDS = Path("fields")
DAMAGED = (  # what parsing may raise: not JSON, not a number, a missing key, nested too deeply
    ValueError, TypeError, OverflowError, LookupError, AttributeError, OSError, RecursionError,
    ElementTree.ParseError,
)  # fmt: skip


@dataclass(frozen=True)
class DrawnRun:
    """A run's fields over time, and what is written on its pictures.

    steps : times (s) and files of the fields, at least one.
    contact_s, peak_s : absolute times of the first touch and of the peak force; None without.
    height_m : H.
    doubt : how the run ended if it did not complete, and its own message; empty without either.
    """

    steps: list[tuple[float, Path]]
    contact_s: float | None
    peak_s: float | None
    height_m: float
    title: str
    doubt: str

    def since_touch(self) -> list[str]:
        """Times of the steps, us, from the first touch (from the start without one), told apart."""
        times = [1e6 * (time - (self.contact_s or 0.0)) for time, _ in self.steps]
        apart = min((b - a for a, b in pairwise(times) if b > a), default=1.0)
        digits = max(0, math.ceil(-math.log10(apart)))
        return [f"{round(time, digits) + 0.0:.{digits}f}" for time in times]  # -0.0 + 0.0 is 0.0


def read_run(folder: Path) -> DrawnRun:
    """Read a run's summary and the index of its fields.

    Raises UserError: a file is missing or not what a run writes; names it and says what to do.
    """
    for part in ("summary.json", "fields/tap.pvd"):
        if not (folder / part).is_file():
            raise UserError(
                f"render {folder}: {part} is missing; give the folder of a fem3d or fem2d run "
                "made by fingertap run, or a scene"
            )
    part = "summary.json"
    try:
        summary = json.loads((folder / part).read_text(encoding="utf-8"))
        contact, after = (
            None if summary[key] is None else _finite(summary[key])
            for key in ("contact_time_s", "peak_normal_force_time_s")
        )
        peak = None if contact is None or after is None else contact + after
        document = tomllib.loads(summary["provenance"]["scene_toml"])
        height = _finite(document["surface"]["height"])
        title = f"{summary['scene']} finger, {summary['model']} {summary['variant']}"
        ended = "" if summary["status"] == "COMPLETED" else str(summary["status"])
        doubt = ": ".join(filter(None, (ended, str(summary["message"]))))
        part = "fields/tap.pvd"
        steps = read_steps(folder / FIELDS)
    except DAMAGED as error:
        raise _damaged(folder, part, error) from error
    return DrawnRun(steps, contact, peak, height, title, doubt)


def read_curves(folder: Path) -> tuple[str, Any]:
    """A run's name, and its time since the first touch (s), F_n and F_t (N) of every step.

    Raises UserError: the run did not complete, or one of the files is damaged or not a run's.
    """
    if not (folder / "curves.csv").is_file():
        raise UserError(
            f"render {folder}: curves.csv is missing, which only a completed run has: leave"
            " --interactive out"
        )
    try:
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        name = " ".join(filter(None, (str(summary["model"]), str(summary["variant"]))))
        table = np.loadtxt(folder / "curves.csv", delimiter=",", skiprows=1, ndmin=2)
        time, normal, *tangential = table.T
        known = tangential[0] if tangential else np.full_like(time, np.nan)
        return name, np.array([time - _finite(summary["contact_time_s"]), normal, known])
    except DAMAGED as error:
        raise _damaged(folder, "curves.csv", error) from error


def _damaged(folder: Path, part: str, error: Exception) -> UserError:
    why = in_one_line(error, 100)
    return UserError(
        f"render {folder}: {part} is damaged or not a run's ({type(error).__name__}: {why}); "
        "make the run again with fingertap run, or give its scene"
    )


def read_steps(folder: Path) -> list[tuple[float, Path]]:
    """Times and files of a PVD collection.

    Raises ValueError: there are none, a file is missing, or a name leads out of the folder, which
        a collection made by others must not do.
    """
    steps = []
    for entry in ElementTree.parse(folder / "tap.pvd").getroot().iter("DataSet"):
        name = entry.attrib["file"]
        if Path(name).name != name or name == "..":
            raise ValueError(f"tap.pvd: file {name!r} is not in the collection's own folder")
        if not (folder / name).is_file():
            raise ValueError(f"tap.pvd: file {name!r} is not there")
        steps.append((_finite(float(entry.attrib["timestep"])), folder / name))
    if not steps:
        raise ValueError("tap.pvd: lists no files")
    return steps


def _finite(number: Any) -> float:
    """A number that must be finite."""
    if isinstance(number, bool) or not isinstance(number, int | float):
        raise TypeError(f"{str(number)[:40]!r} is not a number")
    if not math.isfinite(number):
        raise ValueError(f"{number} is not finite")
    return float(number)


def check_fields(path: Path, mesh: Any) -> None:
    """Check that a mesh read from a VTU file holds a step's fields.

    Raises UserError: one line that names the file and what it lacks.
    """
    points, cells = getattr(mesh, "n_points", 0), getattr(mesh, "n_cells", 0)
    wanted = {
        "displacement": (mesh.point_data, (points, 3)),
        "velocity": (mesh.point_data, (points, 3)),
        "von_mises_Pa": (mesh.cell_data, (cells,)),
    }
    if "contact_pressure_Pa" in mesh.point_data:
        wanted["contact_pressure_Pa"] = (mesh.point_data, (points,))
    lacking = [
        name
        for name, (data, shape) in wanted.items()
        if not cells
        or name not in data
        or np.shape(data[name]) != shape
        or not np.isfinite(data[name]).all()
    ]
    if lacking or not np.isfinite(mesh.points).all():
        raise UserError(
            f"{path}: is damaged or not a step of a run: {', '.join(lacking) or 'points'} are "
            "missing, of another shape, or not finite; make the run again with fingertap run"
        )
