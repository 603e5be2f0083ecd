"""Section 4.3 with a ramp and damping: whether one choice of them agrees with figs. 13 to 16.

The article's torques jump and its finger has no damping, so that what follows rings at every
frequency of the mesh. Here the torques rise from zero over a ramp and the material has Kelvin and
Voigt's damping: three numbers (ramp, relaxation time, t_3 factor) for all three cases. At every
point of a grid each of the article's rows is judged as the ledger judges it.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from itertools import product
from typing import Any

import numpy as np

from validation.compare.claims import read_claims
from validation.harness.processes import Workers
from validation.models.adapter import Progress
from validation.studies.paper.case_runs import CaseRun, solve_case
from validation.studies.paper.cases import DEFAULTS, Case
from validation.studies.paper.driven_cases import PRINTED_TORQUES
from validation.studies.paper.driven_values import driven_values
from validation.studies.paper.ledger import CLOSE, REPRODUCED, Finding, judge
from validation.studies.paper.torque_factor import ARRIVAL_CLAIMS, printed_arrivals

RAMPS = (0.0, 1e-4, 2e-4, 3e-4, 5e-4, 1e-3)  # s
RELAXATIONS = (0.0, 1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 3e-4)  # s
FACTORS = (6.6e-5, 6.8e-5, 7.0e-5, 7.2e-5, 7.4e-5, 7.6e-5, 7.8e-5)  # N m a printed unit
# Of a damped finger at 20 elements the readings differ by 1 % at most (stresses; others by 0.1 %),
# and the counts do not. Undamped ones depend on the mesh, as `driven_cases` shows.
NUMERICS = ("finger.elements=10", "solver.hcm.estimate=false", *DEFAULTS)
# Postures are kept about the contact, over these shares of the printed arrival, s apart.
WINDOW, POSTURE_STEP = (0.95, 1.4), 2e-5
FILE = "ramp_experiment.json"


@dataclass(frozen=True)
class Point:
    """One choice, and the claims that agree there (reproduced or close), none without a tap.

    arrivals_percent : the largest deviation of the three arrival times; None without one.
    """

    ramp_s: float
    relaxation_time_s: float
    factor: float
    agreeing: tuple[str, ...]
    arrivals_percent: float | None


def ramped(scene: str, ramp_s: float, relaxation_time_s: float, factor: float) -> Case:
    """A driven case whose torques rise linearly over the ramp."""
    t1, t2, t3 = PRINTED_TORQUES[scene]
    full = [t1, t2, t3 * factor]
    table = ([0.0, ramp_s], [[0.0] * 3, full]) if ramp_s > 0.0 else ([0.0], [full])
    overrides = [f"drive.torques={{time={table[0]}, values={table[1]}}}", *NUMERICS]
    if relaxation_time_s > 0.0:
        overrides.append(f"material.relaxation_time={relaxation_time_s}")
    begin, end = (share * printed_arrivals()[scene] for share in WINDOW)
    times = tuple(np.arange(begin, end, POSTURE_STEP).tolist())
    return Case(scene, scene, tuple(overrides), times)


def solve_point(ramp_s: float, relaxation_time_s: float, factor: float) -> Point:
    """Solve the three cases and judge every row."""
    runs: dict[str, CaseRun] = {
        scene: solve_case(ramped(scene, ramp_s, relaxation_time_s, factor))
        for scene in PRINTED_TORQUES
    }
    found: tuple[str, ...] = ()
    late = None
    if all(run.record.ok for run in runs.values()):
        claims, values = read_claims(), driven_values(runs)
        judged = [judge(claims[id_], Finding(value)) for id_, value in values.items()]
        found = tuple(row.claim.id for row in judged if row.verdict in (REPRODUCED, CLOSE))
        late = max(
            abs(row.deviation or 0.0) for row in judged if row.claim.id in ARRIVAL_CLAIMS.values()
        )
    return Point(ramp_s, relaxation_time_s, factor, found, late)


def solve_grid(pool: Workers, progress: Progress) -> tuple[Point, ...]:
    """All points."""
    grid = list(product(RAMPS, RELAXATIONS, FACTORS))
    jobs = [pool.submit(solve_point, *point) for point in grid]
    points = []
    for number, (job, point) in enumerate(zip(jobs, grid, strict=True)):
        progress(number / len(grid), f"ramp {point[0]:g} s, relaxation {point[1]:g} s")
        points.append(job.result())
    return tuple(points)


def to_json(points: Iterable[Point], provenance: Mapping[str, Any]) -> dict[str, Any]:
    """The object that ``--json`` prints and the package keeps."""
    return {"provenance": dict(provenance), "points": [vars(point) for point in points]}


@cache
def kept_points() -> tuple[Point, ...]:
    """The points that the package keeps, made by `fingertap identify ramp --json`."""
    text = resources.files("validation").joinpath("data", FILE).read_text(encoding="utf-8")
    return tuple(
        Point(**{**point, "agreeing": tuple(point["agreeing"])})
        for point in json.loads(text)["points"]
    )


def closest(points: Iterable[Point]) -> Point:
    """Where most rows agree."""
    return max(points, key=lambda point: len(point.agreeing))


def sentence(id_: str, points: tuple[Point, ...]) -> str:
    """What the experiment says of one row."""
    own = sum(id_ in point.agreeing for point in points)
    best, rows = closest(points), len(driven_ids())
    together = sum(len(point.agreeing) == rows for point in points)
    return (
        f"with a ramp and damping in the jump's place it agrees to 5 % at {own} of {len(points)}"
        f" choices of (ramp up to {1e3 * RAMPS[-1]:g} ms, relaxation time up to"
        f" {1e3 * RELAXATIONS[-1]:g} ms, factor), all rows of figs. 13 to 16 together at"
        f" {together or 'none'}; most, {len(best.agreeing)} of {rows}, at {place(best)}"
        " (fingertap identify ramp)"
    )


def driven_ids() -> tuple[str, ...]:
    """The rows that are judged."""
    return tuple(id_ for id_, claim in read_claims().items() if "driven" in claim.scene)


def place(point: Point) -> str:
    """A point in words."""
    return f"({1e3 * point.ramp_s:g} ms, {1e3 * point.relaxation_time_s:g} ms, {point.factor:.3g})"
