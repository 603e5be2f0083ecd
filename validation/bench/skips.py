"""The skip ledger (design.md section 10): each shortcut on and off, its time and its error.

A shortcut's error is the relative change of peak, impulse and duration between the two runs, which
differ in nothing else. What has no switch is named, with the reason.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from validation.bench.timing import shortest, shortest_in_turns
from validation.models.hcm import translate
from validation.models.solid import build_mesh, inputs
from validation.scenes.load import load_scene

if TYPE_CHECKING:
    import pandas as pd

BUDGET_S = 1.5
SEARCH_STEPS = 200
NAMES = ("peak_normal_force_N", "normal_impulse_N_s", "contact_duration_s")
Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class Entry:
    """One line of the ledger; times in s, errors relative, None where there is no switch."""

    shortcut: str
    model: str
    switched_off_by: str
    time_with_s: float | None = None
    time_without_s: float | None = None
    peak_change: float | None = None
    impulse_change: float | None = None
    duration_change: float | None = None
    note: str = ""

    @property
    def speedup(self) -> float | None:
        """Time without the shortcut over the time with it."""
        if self.time_with_s is None or self.time_without_s is None:
            return None
        return self.time_without_s / self.time_with_s


@dataclass(frozen=True)
class Shortcut:
    """A shortcut of hcm or a solid: the scene's overrides with it and without it."""

    name: str
    model: str
    with_it: tuple[str, ...]
    without_it: tuple[str, ...]
    note: str = ""


CONTROLLED = (
    "solver.hcm.flight_step=1e-3",
    "solver.hcm.flight_tolerance=1e-7",
    "solver.hcm.contact_step=1e-5",
    "solver.hcm.contact_tolerance=1e-9",
)
NO_CONTROL = ("solver.hcm.flight_tolerance=0", "solver.hcm.contact_tolerance=0")
FIVE = ("finger.elements=5",)

HCM = (
    Shortcut(
        "error-controlled steps instead of fixed ones of 0.01 ms and 0.1 us", "hcm",
        (*FIVE, *CONTROLLED),
        (*FIVE, *NO_CONTROL, "solver.hcm.flight_step=1e-5", "solver.hcm.contact_step=1e-7"),
    ),
    Shortcut(
        "5 elements a phalanx instead of 20", "hcm", (*FIVE, *CONTROLLED),
        ("finger.elements=20", *CONTROLLED),
        "the change holds both meshes' errors of time integration",
    ),
    Shortcut(
        "no friction at mu = 0", "hcm", ("surface.friction=0", *FIVE, *CONTROLLED),
        ("surface.friction=1e-12", *FIVE, *CONTROLLED), "off: mu = 1e-12",
    ),
    Shortcut(
        "no torque at zero drive", "hcm", (*FIVE, *CONTROLLED),
        ("drive.torques=[1e-300,1e-300,1e-300]", *FIVE, *CONTROLLED), "off: 1e-300 N m",
    ),
)  # fmt: skip
SOLID = (
    Shortcut(
        "rigid flight", "fem2d", (), ("solver.fem.flight='explicit'",),
        "error: the finger's own vibration in flight",
    ),
    Shortcut(
        "no friction at mu = 0", "fem2d", ("surface.friction=0",), ("surface.friction=1e-12",),
        "off: mu = 1e-12",
    ),
)  # fmt: skip
SOLID_FULL = (
    Shortcut("rigid flight", "fem3d", (), ("solver.fem.flight='explicit'",)),
    Shortcut("no friction at mu = 0", "fem3d", ("surface.friction=0",),
             ("surface.friction=1e-12",), "off: mu = 1e-12"),
)  # fmt: skip
STRUCTURAL = (
    Entry("half model by symmetry", "fem3d", "no switch",
          note="structural: the mesh is half of the body; its mirror image would double the time"),
)  # fmt: skip


def _run(shortcut: Shortcut, overrides: tuple[str, ...]) -> Callable[[], Any]:
    scene = load_scene("soft", overrides)
    if shortcut.model == "hcm":
        import hcm

        given = translate(scene)
        return lambda: hcm.simulate(**given)
    import reference_fem

    mesh = build_mesh(scene.tables, 3 if shortcut.model == "fem3d" else 2)
    solid = inputs(scene.tables)
    return lambda: reference_fem.simulate(mesh, *solid)


def measure(shortcut: Shortcut, budget_s: float) -> Entry:
    """Time both, and compare what they find."""
    runs = [_run(shortcut, overrides) for overrides in (shortcut.with_it, shortcut.without_it)]
    if any("explicit" in key for key in shortcut.without_it):
        # thousands of times the steps: once is enough, and compiled code is warm by then
        with_it, without = shortest(runs[0], budget_s), shortest(runs[1], 0.0, 1, warm_up=False)
    else:
        with_it, without = shortest_in_turns(runs, budget_s)
    peak, impulse, duration = (
        abs(getattr(with_it.result.summary, name) / getattr(without.result.summary, name) - 1.0)
        for name in NAMES
    )
    switch = ", ".join(shortcut.without_it[:1] if shortcut.note else shortcut.without_it)
    return Entry(
        shortcut.name, shortcut.model, switch, with_it.wall_time_s, without.wall_time_s,
        peak, impulse, duration, shortcut.note,
    )  # fmt: skip


def contact_search(dimension: int, budget_s: float) -> Entry:
    """Steps in flight, far from the surface, with and without the search for contact."""
    from reference_fem.explicit_step import advance, start_state
    from reference_fem.model import build_model

    tables = load_scene("soft").tables
    mesh = build_mesh(tables, 3 if dimension == 3 else 2)
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


def reuse() -> Entry:
    """How often hcm's factors serve again; there is no switch for it."""
    import hcm

    cost = hcm.simulate(**translate(load_scene("soft", (*FIVE, *CONTROLLED)))).statistics
    return Entry(
        "factorization reuse", "hcm", "no switch",
        note=f"{cost.factorizations} factorizations for {cost.newton_iterations} iterations",
    )  # fmt: skip


def measure_all(quick: bool, progress: Progress) -> list[Entry]:
    """The whole ledger."""
    cases = (*HCM, *SOLID, *(() if quick else SOLID_FULL))
    entries = []
    for number, shortcut in enumerate(cases):
        progress(number / len(cases), f"{shortcut.model}: {shortcut.name}")
        entries.append(measure(shortcut, BUDGET_S))
    entries += [contact_search(dimension, BUDGET_S) for dimension in (2, 3)]
    return [*entries, reuse(), *STRUCTURAL]


def table(entries: list[Entry]) -> "pd.DataFrame":
    """One row a shortcut."""
    import pandas as pd

    return pd.DataFrame(
        {
            "shortcut": e.shortcut,
            "model": e.model,
            "switched_off_by": e.switched_off_by,
            "time_with_s": e.time_with_s,
            "time_without_s": e.time_without_s,
            "speedup": e.speedup,
            "peak_change": e.peak_change,
            "impulse_change": e.impulse_change,
            "duration_change": e.duration_change,
            "note": e.note,
        }
        for e in entries
    )
