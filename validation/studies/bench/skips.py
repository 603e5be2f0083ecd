"""The skip ledger (design.md section 10): each shortcut on and off, its time and its error.

A shortcut's error is the relative change of peak, impulse and duration between the two runs, which
differ in nothing else. Here are the shortcuts that a scene's keys switch; `skips_apart` has those
that are no key of a scene.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from validation.harness.timing import shortest, shortest_in_turns
from validation.models import ModelName
from validation.models.hcm import translate
from validation.models.solid import Dimension, build_mesh, inputs
from validation.scenes.load import load_scene
from validation.studies.bench import skips_apart
from validation.studies.bench.ledger import CONTROLLED, FIVE, Entry, changes

BUDGET_S = 1.5
MODELS: tuple[ModelName, ...] = ("hcm", "fem3d")
DIMENSIONS: tuple[Dimension, ...] = (2, 3)
Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class Shortcut:
    """A shortcut of hcm or a solid: the scene's overrides with it and without it."""

    name: str
    model: str
    with_it: tuple[str, ...]
    without_it: tuple[str, ...]
    note: str = ""


NO_CONTROL = ("solver.hcm.flight_tolerance=0", "solver.hcm.contact_tolerance=0")

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
        "rigid flight", "hcm", ("solver.hcm.flight='rigid'", *FIVE, *CONTROLLED),
        (*FIVE, *CONTROLLED), "off: flight = elastic, the default; error: the finger's sag and"
        " vibration in flight",
    ),
    Shortcut(
        "no friction at mu = 0", "hcm", ("surface.friction=0", *FIVE, *CONTROLLED),
        ("surface.friction=1e-12", *FIVE, *CONTROLLED), "off: mu = 1e-12",
    ),
    Shortcut(
        "no torque at zero drive", "hcm", (*FIVE, *CONTROLLED),
        ("drive.torques=[1e-300,1e-300,1e-300]", *FIVE, *CONTROLLED), "off: 1e-300 N m",
    ),
    Shortcut(
        "factorization reuse", "hcm", (*FIVE, *CONTROLLED),
        ("solver.hcm.reuse_factors=false", *FIVE, *CONTROLLED),
        "off: a factorization in every iteration",
    ),
)  # fmt: skip
SOLID = (
    Shortcut(
        "no friction at mu = 0", "fem2d", ("surface.friction=0",), ("surface.friction=1e-12",),
        "off: mu = 1e-12",
    ),
    Shortcut(
        "half model by symmetry", "fem3d", (), ("solver.fem.symmetry=false",),
        "off: both halves meshed",
    ),
    Shortcut(
        "rigid flight", "fem2d", (), ("solver.fem.flight='explicit'",),
        "error: the finger's own vibration in flight",
    ),
)  # fmt: skip
SOLID_FULL = (
    Shortcut("rigid flight", "fem3d", (), ("solver.fem.flight='explicit'",)),
    Shortcut("no friction at mu = 0", "fem3d", ("surface.friction=0",),
             ("surface.friction=1e-12",), "off: mu = 1e-12"),
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
    switch = ", ".join(shortcut.without_it[:1] if shortcut.note else shortcut.without_it)
    return Entry(
        shortcut.name, shortcut.model, switch, with_it.wall_time_s, without.wall_time_s,
        *changes(with_it.result.summary, without.result.summary), shortcut.note,
    )  # fmt: skip


def measure_all(quick: bool, progress: Progress) -> Iterator[Entry]:
    """The whole ledger, line by line: what is dear comes last."""
    cases = (*HCM, *SOLID, *(() if quick else SOLID_FULL))
    for model in MODELS:
        progress(0.0, f"{model}: stored results")
        yield skips_apart.stored(model, BUDGET_S)
    for dimension in DIMENSIONS:
        progress(0.05, f"fem{dimension}d: contact search")
        yield skips_apart.contact_search(dimension, BUDGET_S)
    for number, shortcut in enumerate(cases):
        progress(0.1 + 0.9 * number / len(cases), f"{shortcut.model}: {shortcut.name}")
        yield measure(shortcut, BUDGET_S)
