"""The bar in the reference: its complete explicit step, with the contact out of reach."""

from dataclasses import replace

import numba
import numpy as np

import meshes
import reference_fem as fem
from reference_fem.dynamics.step import advance, start_state
from reference_fem.model import Model, build_model
from validation.harness.timing import shortest
from validation.peers.bar import DENSITY, PARTS, STEP_S, YOUNG, Bar, BarRun, Floats, Integers

POINTS = {"hex8-sri": 8, "hex8-one-point": 1}
# The lower faces of VTK's cells, oriented outward.
LOWER = {2: [0, 1], 3: [0, 1, 5, 4]}


def box_model(
    points: Floats, cells: Integers, material: fem.Material, surface: fem.Surface,
    drive: fem.Drive, settings: fem.Settings,
) -> Model:  # fmt: skip
    """Model of a box or sheet without hinges whose lower side may touch."""
    facets = cells[:, LOWER[points.shape[1]]]
    lowest = facets[(points[facets, 1] == points[:, 1].min()).all(axis=1)]
    whole = {"phalanx_1": np.arange(len(cells))}
    mesh = meshes.FingerMesh(points, cells, {"pole": np.array([0])}, {"surface": lowest}, whole)
    return build_model(mesh, (material,), surface, drive, settings)


def run_bar(bar: Bar, element: str) -> BarRun:
    """Take all steps in one call, as often as other programs divide them; the shortest counts."""
    points, cells = bar.mesh()
    material, surface = fem.Material(YOUNG, 0.0, DENSITY), fem.Surface(height=1.0, friction=0.0)
    settings = fem.Settings(element=element, threads=bar.threads)
    model = box_model(points, cells, material, surface, fem.Drive(gravity=0.0), settings)
    model = replace(model, step_s=STEP_S)
    before = numba.get_num_threads()
    numba.set_num_threads(min(bar.threads, numba.config.NUMBA_NUM_THREADS))
    try:
        start = start_state(model, np.zeros_like(points), bar.velocity(points), 0.0)
        timed = shortest(lambda: advance(model, start, bar.steps, False), 0.0, PARTS)
    finally:
        numba.set_num_threads(before)
    end = timed.result[0].displacement[points[:, 0] == 0.0, 0].mean()
    seconds = timed.wall_time_s / bar.steps
    return BarRun(POINTS[element], seconds, float(end), STEP_S, timed.runs)
