"""Shortcuts that no scene's key switches: the contact search, stored results."""

import tempfile
import time
from functools import partial
from pathlib import Path

import numpy as np

from validation.harness.interrupts import unless_interrupted
from validation.harness.store import Store
from validation.harness.stored_run import keep_run, load_run
from validation.harness.timing import shortest, shortest_in_turns
from validation.models import ModelName, adapter
from validation.models.inputs import run_inputs
from validation.models.solid import Dimension, build_mesh, inputs
from validation.scenes.load import load_scene
from validation.studies.bench.ledger import Entry

SEARCH_STEPS = 200


def contact_search(dimension: Dimension, budget_s: float) -> Entry:
    """Steps in flight, far from the surface, with and without the search for contact."""
    from reference_fem.dynamics.step import advance, start_state
    from reference_fem.model import build_model

    tables = load_scene("soft").tables
    mesh = build_mesh(tables, dimension)
    model = build_model(mesh, *inputs(tables))
    rest = np.zeros_like(model.points)
    state = start_state(model, rest, rest, 0.0)
    timed = shortest_in_turns(
        [partial(advance, model, state, SEARCH_STEPS, search) for search in (False, True)], budget_s
    )
    same = np.array_equal(timed[0].result[0].displacement, timed[1].result[0].displacement)
    change = 0.0 if same else float("nan")
    return Entry(
        "no contact search in flight", f"fem{dimension}d", "search = True",
        timed[0].wall_time_s, timed[1].wall_time_s, change, change, change,
        f"{SEARCH_STEPS} steps in flight; displacements agree to the bit" if same
        else "displacements differ",
    )  # fmt: skip


def stored(model: ModelName, budget_s: float) -> Entry:
    """A run of the soft scene against finding it in a store: its name, its files, their digests."""
    scene = load_scene("soft")
    module = adapter(model)
    module.warm_up()
    start = time.perf_counter()
    outcome = module.run(scene)
    unless_interrupted(outcome.record)
    without = time.perf_counter() - start
    with tempfile.TemporaryDirectory() as folder:
        store = Store(Path(folder))
        keep_run(store, run_inputs(scene.tables, model), outcome.record, outcome.fields)
        timed = shortest(lambda: load_run(store, run_inputs(scene.tables, model)), budget_s)
    found = timed.result
    same = found is not None and all(
        np.array_equal(found.history[name], array, equal_nan=array.dtype.kind == "f")
        for name, array in outcome.record.history.items()
    )
    change = 0.0 if same else None
    return Entry(
        "stored results", model, "another scene, setting, source or version", timed.wall_time_s,
        without, change, change, change,
        "read back with its inputs' digest; the history agrees to the bit" if same
        else "the stored history differs",
    )  # fmt: skip
