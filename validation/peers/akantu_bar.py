"""The bar in Akantu (LGPL-3): 8-node hexahedra, small strain, central differences, lumped mass.

Run as a program: the bar's arguments as JSON on the command line, the result as JSON on the last
line of standard output. It writes its material file to the current folder.
"""

import importlib
import json
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from validation.peers.bar import DENSITY, YOUNG, Bar, Ran

PARTS = 3


def run(bar: Bar) -> Ran:
    """Steps in parts, of which the fastest counts; the first steps warm up."""
    akantu: Any = importlib.import_module("akantu")
    points, cells = bar.mesh()
    text = f"material elastic [\n name = bar\n rho = {DENSITY}\n E = {YOUNG}\n nu = 0.\n]\n"
    Path("material.dat").write_text(text, encoding="ascii")
    akantu.parseInput("material.dat")
    mesh = akantu.Mesh(3)
    access = akantu.MeshAccessor(mesh)
    access.resizeNodes(len(points))
    mesh.getNodes()[:] = points
    mesh.addConnectivityType(akantu._hexahedron_8)
    access.resizeConnectivity(len(cells), akantu._hexahedron_8)
    mesh.getConnectivity(akantu._hexahedron_8)[:] = cells
    access.makeReady()
    model = akantu.SolidMechanicsModel(mesh)
    model.initFull(_analysis_method=akantu._explicit_lumped_mass)
    model.setTimeStep(bar.step_s)
    model.getVelocity()[:] = bar.velocity(points)
    return Ran(
        "Akantu", "hexahedron_8, small strain", 8,
        stepping(lambda: model.solveStep("explicit_lumped"), bar.steps),
        float(model.getDisplacement()[points[:, 0] == 0.0, 0].mean()), bar.step_s, PARTS,
    )  # fmt: skip


def stepping(step: Any, steps: int) -> float:
    """Take all steps; seconds per step in the fastest part of them, the first two left out."""
    warm = min(2, steps - 1)
    for _ in range(warm):
        step()
    left, best = steps - warm, float("inf")
    for part in range(PARTS):
        count = left * (part + 1) // PARTS - left * part // PARTS
        start = time.perf_counter()
        for _ in range(count):
            step()
        best = min(best, (time.perf_counter() - start) / count) if count else best
    return best


if __name__ == "__main__":
    print(json.dumps(asdict(run(Bar(**json.loads(sys.argv[1]))))))
