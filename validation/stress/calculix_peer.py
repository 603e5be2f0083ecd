"""The reference's hardest cells in CalculiX: the same block, law and contact, its own steps.

CalculiX (GPL-2 or later) solves the same equations implicitly: St. Venant-Kirchhoff (``*ELASTIC``
with NLGEOM), C3D8 elements on our mesh, surface-to-surface contact with a linear pressure on a
fixed floor, ``*DYNAMIC`` with automatic increments from the step that it is given.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reference_fem.model import Model
from reference_fem.surface_contact import SurfaceContact
from validation.stress.reference_bodies import SIDE
from validation.stress.reference_scene import DENSITY, ReferenceScene

PROGRAM = "ccx"
# Increments that its first step would make of the tap; it refines and coarsens from there.
INCREMENTS = 200
MOST_INCREMENTS = 20_000
TOTAL = re.compile(r"total force.*\n\s*\n\s*(\S+)\s+(\S+)\s+(\S+)", re.MULTILINE)
TIME = re.compile(r"total force .* time\s+(\S+)")


@dataclass(frozen=True)
class PeerRun:
    """What CalculiX answered: how it ended, and the tap's scalars for the full body."""

    answer: str
    peak_normal_force_N: float | None = None
    normal_impulse_N_s: float | None = None
    increments: int = 0
    wall_time_s: float = 0.0


def available() -> bool:
    """Whether CalculiX is installed (apt-get install calculix-ccx)."""
    return shutil.which(PROGRAM) is not None


def deck(
    scene: ReferenceScene, model: Model, displacement: NDArray[np.float64], end_s: float
) -> str:
    """Its input file: the block where it starts, a floor under it, `end_s` of motion."""
    if not isinstance(model.contact, SurfaceContact):
        raise ValueError(f"contact = {scene.contact!r}: only 'surface' is a law of CalculiX too")
    points = model.points + displacement
    n = len(points)
    lines = ["*NODE,NSET=BODY", *_nodes(points, 1)]
    floor = _floor(model.surface.height)
    lines += ["*NODE,NSET=FLOOR", *_nodes(floor, n + 1)]
    cells = (model.cells + 1).tolist()
    lines.append("*ELEMENT,TYPE=C3D8,ELSET=BLOCK")
    lines += [f"{e},{','.join(map(str, nodes))}" for e, nodes in enumerate(cells, 1)]
    plate = ",".join(str(n + i) for i in range(1, 9))
    lines += ["*ELEMENT,TYPE=C3D8,ELSET=PLATE", f"{len(cells) + 1},{plate}"]
    lines += ["*NSET,NSET=MIDDLE", *(f"{i + 1}," for i in model.symmetry)]
    lines += ["*SURFACE,NAME=OUTSIDE", *_faces(model)]
    lines += ["*SURFACE,NAME=TOP", f"{len(cells) + 1},S2"]
    lines += ["*MATERIAL,NAME=M", "*ELASTIC", f"{scene.modulus},{scene.poisson}", "*DENSITY",
              f"{DENSITY}", "*SOLID SECTION,ELSET=BLOCK,MATERIAL=M",
              "*SOLID SECTION,ELSET=PLATE,MATERIAL=M",
              "*SURFACE INTERACTION,NAME=I", "*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=LINEAR",
              f"{model.contact.modulus:.9g}"]  # fmt: skip
    if scene.friction:
        lines += ["*FRICTION", f"{scene.friction},{model.contact.modulus:.9g}"]
    lines += ["*CONTACT PAIR,INTERACTION=I,TYPE=SURFACE TO SURFACE", "OUTSIDE,TOP",
              "*BOUNDARY", "FLOOR,1,3", "MIDDLE,3,3",
              "*INITIAL CONDITIONS,TYPE=VELOCITY", f"BODY,1,{scene.slide * scene.speed:.9g}",
              f"BODY,2,{-scene.speed:.9g}",
              f"*STEP,NLGEOM,INC={MOST_INCREMENTS}", "*DYNAMIC",
              f"{end_s / INCREMENTS:.6g},{end_s:.6g}",
              "*DLOAD", f"BLOCK,GRAV,{model.gravity},0,-1,0",
              "*NODE PRINT,NSET=FLOOR,TOTALS=ONLY", "RF", "*END STEP"]  # fmt: skip
    return "\n".join(lines) + "\n"


def _nodes(points: NDArray[np.float64], first: int) -> list[str]:
    return [f"{n},{x:.12g},{y:.12g},{z:.12g}" for n, (x, y, z) in enumerate(points.tolist(), first)]


# Corners of CalculiX' faces S1 to S6.
_FACES = ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))


def _faces(model: Model) -> list[str]:
    """The block's outside, face by face."""
    assert isinstance(model.contact, SurfaceContact)
    wanted = {frozenset(facet) for facet in model.contact.quadrature.facets.tolist()}
    return [
        f"{e},S{side}"
        for e, cell in enumerate(model.cells.tolist(), 1)
        for side, corners in enumerate(_FACES, 1)
        if frozenset(cell[c] for c in corners) in wanted
    ]


def _floor(height: float) -> NDArray[np.float64]:
    """Corners of a plate below the surface, wide enough for the block to slide on, in VTK order."""
    wide, low = 4.0 * SIDE, -height - 0.5 * SIDE
    square = [(-wide, -wide), (wide, -wide), (wide, wide), (-wide, wide)]
    # Local Z of the element is up: its second face, S2, is the top.
    return np.array([(x, y, -z) for y in (low, -height) for x, z in square])


def run_calculix(
    scene: ReferenceScene, model: Model, displacement: NDArray[np.float64], end_s: float,
    timeout_s: float,
) -> PeerRun:  # fmt: skip
    """Run in a folder and a process of its own, for a bounded time."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "tap"
        path.with_suffix(".inp").write_text(
            deck(scene, model, displacement, end_s), encoding="ascii"
        )
        start = time.perf_counter()
        try:
            done = subprocess.run(
                [PROGRAM, "tap"], cwd=folder, capture_output=True, text=True, timeout=timeout_s,
                check=False, env={**os.environ, "OMP_NUM_THREADS": "1"},
            )  # fmt: skip
            ended = done.stdout
            complete = done.returncode == 0 and "Job finished" in ended
        except subprocess.TimeoutExpired as error:
            raw = error.stdout or b""
            ended = raw.decode(errors="replace") if isinstance(raw, bytes) else raw
            complete = False
        seconds = time.perf_counter() - start
        data = path.with_suffix(".dat")
        text = data.read_text(encoding="ascii", errors="replace") if data.exists() else ""
    forces = np.array([float(found[1]) for found in TOTAL.findall(text)])
    times = np.array([float(found) for found in TIME.findall(text)])
    answer = "finished" if complete else _reason(ended, seconds, timeout_s)
    if not forces.size:
        return PeerRun(answer, wall_time_s=seconds)
    normal = model.copies * forces
    impulse = float(np.trapezoid(np.append(0.0, normal), np.append(0.0, times)))
    return PeerRun(answer, float(normal.max()), impulse, len(times), seconds)


def _reason(said: str, seconds: float, timeout_s: float) -> str:
    if seconds >= timeout_s:
        return f"stopped after {timeout_s:g} s"
    errors = [
        line.strip() for line in said.splitlines() if "*ERROR" in line or "best solution" in line
    ]
    return errors[-1] if errors else "failed without a reason"
