"""The bar in the reference: its own explicit step, whole, with the contact out of reach."""

from dataclasses import replace

import numpy as np

from validation.harness.timing import shortest
from validation.peers.bar import DENSITY, YOUNG, Bar, BarRun

POINTS = {"hex8-sri": 8, "hex8-one-point": 1}
BUDGET_S = 2.0


def run_bar(bar: Bar, element: str) -> BarRun:
    """Take all steps at once, several times."""
    import numba

    import meshes
    import reference_fem as fem
    from reference_fem.dynamics.step import advance, start_state
    from reference_fem.model import build_model

    points, cells = bar.mesh()
    bottom = cells[np.isclose(points[cells, 1].min(axis=1), 0.0)][:, [0, 1, 5, 4]]
    mesh = meshes.FingerMesh(
        points,
        cells,
        {"pole": np.array([0]), "proximal_face_1": np.flatnonzero(points[:, 0] == 0.0)},
        {"surface": bottom},
        {"phalanx_1": np.arange(len(cells))},
    )
    material = fem.Material(youngs_modulus=YOUNG, poisson_ratio=0.0, density=DENSITY)
    model = build_model(
        mesh,
        (material,),
        fem.Surface(height=1.0, friction=0.0),
        fem.Drive(gravity=0.0),
        fem.Settings(element=element, threads=bar.threads),
    )
    model = replace(model, step_s=bar.step_s)
    before = numba.get_num_threads()
    numba.set_num_threads(min(bar.threads, numba.config.NUMBA_NUM_THREADS))
    try:
        start = start_state(model, np.zeros_like(points), bar.velocity(points), 0.0)
        timed = shortest(lambda: advance(model, start, bar.steps, False), BUDGET_S)
    finally:
        numba.set_num_threads(before)
    end = timed.result[0].displacement[points[:, 0] == 0.0, 0].mean()
    return BarRun(
        POINTS[element], timed.wall_time_s / bar.steps, float(end),
        bar.step_s, timed.runs,
    )  # fmt: skip
