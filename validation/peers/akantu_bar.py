"""The bar in Akantu (LGPL-3): 8-node hexahedra, small strain, central differences, lumped mass.

It writes its material file to the current folder.
"""

import importlib
from pathlib import Path
from typing import Any

from validation.peers.bar import DENSITY, STEP_S, YOUNG, Bar, seconds_per_step


def run_bar(bar: Bar) -> tuple[float, float]:
    """Seconds per step (fastest part of the steps, after a warm-up) and `BarRun.end_m`."""
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
    model.setTimeStep(STEP_S)
    model.getVelocity()[:] = bar.velocity(points)
    seconds = seconds_per_step(lambda: model.solveStep("explicit_lumped"), bar.steps)
    return seconds, float(model.getDisplacement()[points[:, 0] == 0.0, 0].mean())
