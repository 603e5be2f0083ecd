"""The shortcuts of the skip ledger: each on and off, its time and its error.

A shortcut's error is the relative change of peak, impulse and duration between two runs that differ
in nothing else. Most are switched by a scene's keys; the contact search and stored results are not.
"""

import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from reference_fem.dynamics.step import advance, start_state
from reference_fem.model import build_model
from validation.compare.tap_errors import TapErrors, tap_errors
from validation.harness.interrupts import unless_interrupted
from validation.harness.store import Store
from validation.harness.stored_run import keep_run, load_run
from validation.harness.timing import shortest, shortest_in_turns
from validation.models import adapter
from validation.models.adapter import Progress
from validation.models.inputs import run_inputs
from validation.models.solid_inputs import DIMENSIONS, solid_parts
from validation.models.solid_mesh import build_mesh
from validation.scenes.load import load_scene
from validation.studies.bench.hcm_settings import BASE, HCM_SOLVER, hcm_setting
from validation.studies.bench.hcm_speed import FIXED
from validation.studies.bench.reference_settings import REFERENCE_SOLVER
from validation.studies.bench.work_precision import simulation

BUDGET_S = 1.5
SEARCH_STEPS = 200
UNCHANGED = TapErrors(0.0, 0.0, 0.0, 0.0)  # to the bit
STORED: tuple[str, ...] = ("hcm", "fem3d")


@dataclass(frozen=True)
class Shortcut:
    """A shortcut of hcm or a solid: the scene's overrides with it and without it."""

    name: str
    model: str
    with_it: tuple[str, ...]
    without_it: tuple[str, ...]
    note: str = ""

    @property
    def switched_off_by(self) -> list[str]:
        """The keys that are stated only without it; or, after "no", only with it."""
        own = [key for key in self.without_it if key not in self.with_it]
        return own or [f"no {key}" for key in self.with_it if key not in self.without_it]


# hcm's settings that the ledger is measured with: error control, the cheapest mesh and a fine one.
CHEAP, FINE = (hcm_setting("tap", "", elements, BASE).overrides() for elements in (5, 20))
COLLOCATED = (
    "finger.elements=5",
    "solver.hcm.flight='rigid'", "solver.hcm.contact_tolerance=0",
    "solver.hcm.flight_integrator='gauss'", "solver.hcm.contact_integrator='gauss'",
)  # fmt: skip

HCM = (
    Shortcut(
        "error-controlled steps instead of fixed ones of 0.01 ms and 0.1 us", "hcm", CHEAP,
        ("finger.elements=5", *FIXED, "solver.hcm.flight_step=1e-5",
         "solver.hcm.contact_step=1e-7"),
    ),
    Shortcut(
        "5 elements a phalanx instead of 20", "hcm", CHEAP, FINE,
        "the change includes both meshes' errors of time integration",
    ),
    Shortcut(
        "rigid flight", "hcm", ("solver.hcm.flight='rigid'", *CHEAP),
        ("solver.hcm.flight='elastic'", *CHEAP), "error: the finger's sag and vibration in flight",
    ),
    Shortcut(
        "collocation in contact", "hcm", (*COLLOCATED, "solver.hcm.contact_step=1.5e-5"),
        (*COLLOCATED[:-1], "solver.hcm.contact_integrator='generalized-alpha'",
         "solver.hcm.contact_step=2e-7"),
        "both after a rigid flight",
    ),
    Shortcut(
        "no friction at mu = 0", "hcm", ("surface.friction=0", *CHEAP),
        ("surface.friction=1e-12", *CHEAP), "off: mu = 1e-12",
    ),
    Shortcut(
        "no torque at zero drive", "hcm", CHEAP,
        ("drive.torques=[1e-300,1e-300,1e-300]", *CHEAP), "off: 1e-300 N m",
    ),
    Shortcut(
        "factorization reuse", "hcm", CHEAP, ("solver.hcm.reuse_factors=false", *CHEAP),
        "off: a factorization in every iteration",
    ),
)  # fmt: skip
FAST = "solver.fem.preset=fast"
SMOOTH = ((FAST, "surface.friction=0"), (FAST, "surface.friction=1e-12"), "off: mu = 1e-12")
COARSE, EXPLICIT = (f"solver.fem.flight='{flight}'" for flight in ("coarse", "explicit"))
EXPLICIT_FLIGHT = ((FAST,), (FAST, EXPLICIT))
# Fingers that bend differently in flight from the soft one.
FLIERS: dict[str, tuple[str, ...]] = {
    "hard": ("material.youngs_modulus=20e9", "material.density=1048.7"),
    "driven-1": ("material.youngs_modulus=0.1e9", "drive.torques=[0.01,0.008,0.002112]"),
    "slender": ("material.youngs_modulus=0.1e9", "finger.diameter=0.005"),
}
AT_ACCURACY = ("solver.accuracy=0.01",)
SOLID = (
    Shortcut("no friction at mu = 0", "fem2d", *SMOOTH),
    Shortcut(
        "cells halved where it touches", "fem3d", AT_ACCURACY,
        (*AT_ACCURACY, "solver.fem.halvings=0"), "off: blocks as fine throughout",
    ),
    Shortcut(
        "one point an element", "fem3d", (*AT_ACCURACY, "solver.fem.element='hex8-one-point'"),
        AT_ACCURACY, "taken from 2e-2 on; off: eight points",
    ),
    Shortcut(
        "half model by symmetry", "fem3d", (FAST,), (FAST, "solver.fem.symmetry=false"),
        "off: both halves meshed",
    ),
    Shortcut(
        "rigid flight", "fem2d", *EXPLICIT_FLIGHT,
        "error: the finger's own vibration in flight",
    ),
)  # fmt: skip
SOLID_FULL = (
    Shortcut("rigid flight", "fem3d", *EXPLICIT_FLIGHT),
    *(
        Shortcut(f"rigid flight, {name}", "fem3d", keys, (COARSE, *keys), "off: on fewer elements")
        for name, keys in FLIERS.items()
    ),
    Shortcut(
        "coarse flight",
        "fem3d",
        (FAST, COARSE),
        (EXPLICIT, FAST),
        "four elements over the diameter; off: flight on the run's own mesh",
    ),
    Shortcut("no friction at mu = 0", "fem3d", *SMOOTH),
)


@dataclass(frozen=True)
class Entry:
    """One line of the ledger; `changes` are relative, None where a result is not complete."""

    shortcut: str
    model: str
    switched_off_by: str
    time_with_s: float
    time_without_s: float
    changes: TapErrors | None
    note: str

    @property
    def speedup(self) -> float:
        """Time without the shortcut over the time with it."""
        return self.time_without_s / self.time_with_s


def table(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """One row per shortcut."""
    first = ("shortcut", "model", "switched_off_by", "time_with_s", "time_without_s", "speedup")
    return [
        {
            **{name: getattr(entry, name) for name in first},
            **{f"{name}_change": getattr(entry.changes, name, None)
               for name in ("peak", "impulse", "duration")},
            "note": entry.note,
        }
        for entry in entries
    ]  # fmt: skip


def measure_shortcut(shortcut: Shortcut, budget_s: float) -> Entry:
    """Time a model with and without a shortcut, and compare the results."""
    runs = [simulation(shortcut.model, keys) for keys in (shortcut.with_it, shortcut.without_it)]
    if {COARSE, EXPLICIT}.intersection(shortcut.without_it):
        # thousands of times the steps: once is enough, and compiled code is warm by then
        with_it, without = shortest(runs[0], budget_s), shortest(runs[1], 0.0, 1, warm_up=False)
    else:
        with_it, without = shortest_in_turns(runs, budget_s)
    read = (HCM_SOLVER if shortcut.model == "hcm" else REFERENCE_SOLVER).read
    found, exact = read(with_it.result).tap, read(without.result).tap
    switch = ", ".join(shortcut.switched_off_by)
    return Entry(
        shortcut.name, shortcut.model, switch, with_it.wall_time_s, without.wall_time_s,
        tap_errors(found, exact) if found and exact else None, shortcut.note,
    )  # fmt: skip


def measure_contact_search(model: str, budget_s: float) -> Entry:
    """Time steps in flight, far from the surface, with and without the search for contact."""
    tables = load_scene("soft").tables
    solid = build_model(build_mesh(tables, DIMENSIONS[model]), *solid_parts(tables))
    rest = np.zeros_like(solid.points)
    state = start_state(solid, rest, rest, 0.0)
    without, with_it = shortest_in_turns(
        [partial(advance, solid, state, SEARCH_STEPS, search) for search in (False, True)], budget_s
    )
    same = np.array_equal(without.result[0].displacement, with_it.result[0].displacement)
    return Entry(
        "no contact search in flight", model, "search = True",
        without.wall_time_s, with_it.wall_time_s, UNCHANGED if same else None,
        f"{SEARCH_STEPS} steps in flight; displacements agree to the bit" if same
        else "displacements differ",
    )  # fmt: skip


def measure_stored_run(model: str, budget_s: float) -> Entry:
    """Time a run of the soft scene against reading it from a store, with its files' digests."""
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
    return Entry(
        "stored results", model, "another scene, setting, source or version", timed.wall_time_s,
        without, UNCHANGED if same else None,
        "read back with its inputs' digest; the history agrees to the bit" if same
        else "the stored history differs",
    )  # fmt: skip


def measure_shortcuts(quick: bool, progress: Progress) -> Iterator[Entry]:
    """The whole ledger, line by line; expensive lines come last."""
    cases = (*HCM, *SOLID, *(() if quick else SOLID_FULL))
    for model in STORED:
        progress(0.0, f"{model}: stored results")
        yield measure_stored_run(model, BUDGET_S)
    for solid in ("fem2d", "fem3d"):
        progress(0.05, f"{solid}: contact search")
        yield measure_contact_search(solid, BUDGET_S)
    for number, shortcut in enumerate(cases):
        progress(0.1 + 0.9 * number / len(cases), f"{shortcut.model}: {shortcut.name}")
        yield measure_shortcut(shortcut, BUDGET_S)
