"""Section 4.3 with a ramp and damping: whether any choice of them agrees with figs. 13 to 16.

The article's torques jump and its finger has no damping, so that what follows rings at every
frequency of the mesh. Here the torques rise from zero over a ramp and the material has Kelvin and
Voigt's damping: three numbers (ramp, relaxation time, t_3 factor) for all three cases. At every
point of a grid each of the article's rows is judged as the ledger judges it.

Between the grid's points are boxes in which no choice can agree with the paper. A box of (ramp,
relaxation time, factor) is excluded by a number x of figs. 13 to 16 if

    min x - s > x_p + d    or    max x + s < x_p - d,    s = max x - min x,

over the box's eight corners, x_p the printed value and d the deviation that the ledger calls close.
This assumes that inside a box x leaves the range of its corners by less than that range is wide. A
box that no number excludes is cut into eight. Counts and states jump, so they exclude nothing.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod

import numpy as np

from validation.compare.claims import Claim, read_claims
from validation.harness.processes import Workers
from validation.models.adapter import Progress
from validation.studies.paper.case_runs import Case, solve_case
from validation.studies.paper.cases import DEFAULTS, PRINTED_TORQUES
from validation.studies.paper.ledger import CLOSE, REPRODUCED, Finding, close_to, judge
from validation.studies.paper.readings import READINGS, driven_values
from validation.studies.paper.torque_factor import ARRIVAL_CLAIMS, printed_arrivals

RAMPS = (0.0, 1e-4, 2e-4, 3e-4, 5e-4, 1e-3)  # s
RELAXATIONS = (0.0, 1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 3e-4)  # s
FACTORS = (6.6e-5, 6.8e-5, 7.0e-5, 7.2e-5, 7.4e-5, 7.6e-5, 7.8e-5)  # N m per printed unit
GRID = (RAMPS, RELAXATIONS, FACTORS)
DEPTH = 3  # times that a box is cut
# With 20 elements the readings of a damped finger differ by 1 % at most (stresses; others 0.1 %)
# and the counts not at all. Without damping they depend on the mesh, as the ledger shows.
NUMERICS = ("finger.elements=10", "solver.hcm.estimate=false", *DEFAULTS)
# Postures are kept around the contact: between these shares of the printed arrival; step, s.
WINDOW, POSTURE_STEP = (0.95, 1.4), 2e-5
Choice = tuple[float, float, float]  # ramp (s), relaxation time (s), factor
Values = Mapping[str, float | bool]
Solved = dict[Choice, Values]
Solve = Callable[[Sequence[Choice]], Solved]


@dataclass(frozen=True)
class JudgedChoice:
    """One choice, and the claims that agree there (reproduced or close); none without a tap.

    arrivals_percent : the largest deviation of the three arrival times; None without a tap.
    """

    ramp_s: float
    relaxation_time_s: float
    factor: float
    agreeing: tuple[str, ...]
    arrivals_percent: float | None

    @property
    def all_agree(self) -> bool:
        """Whether every row of figs. 13 to 16 agrees."""
        return len(self.agreeing) == len(READINGS)


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


def solve_choice(choice: Choice) -> Values:
    """Values of the three cases by claim; empty if one of them does not complete its tap."""
    runs = {scene: solve_case(ramped(scene, *choice)) for scene in PRINTED_TORQUES}
    return driven_values(runs) if all(run.record.ok for run in runs.values()) else {}


def solve_choices(choices: Sequence[Choice], pool: Workers, progress: Progress) -> Solved:
    """Solve all choices on the pool's processes."""
    jobs = [pool.submit(solve_choice, choice) for choice in choices]
    solved = {}
    for number, (job, choice) in enumerate(zip(jobs, choices, strict=True)):
        progress(number / len(choices), f"ramp {choice[0]:g} s, relaxation {choice[1]:g} s")
        solved[choice] = job.result()
    return solved


def judged(choice: Choice, values: Values) -> JudgedChoice:
    """Judge a choice's values row by row, as the ledger does."""
    claims = read_claims()
    rows = [judge(claims[id_], Finding(value)) for id_, value in values.items()]
    late = [abs(row.deviation or 0.0) for row in rows if row.claim.id in ARRIVAL_CLAIMS.values()]
    agreeing = tuple(row.claim.id for row in rows if row.verdict in (REPRODUCED, CLOSE))
    return JudgedChoice(*choice, agreeing, max(late, default=None))


def driven_ids() -> tuple[str, ...]:
    """Ids of the claims that are judged: those on the driven scenes."""
    return tuple(id_ for id_, claim in read_claims().items() if "driven" in claim.scene)


@dataclass(frozen=True)
class Exclusion:
    """The result of the search.

    excluded : boxes by the row that excludes them. left : those that none excludes. A box is three
        digits for its cell of the grid and one for each cut: bit 0, 1, 2 say whether it is the
        upper half in ramp, relaxation time, factor.
    points : number of choices solved. agreeing : number of those at which all rows agree.
    """

    excluded: dict[str, tuple[str, ...]]
    left: tuple[str, ...]
    points: int
    agreeing: int


def sides(box: str) -> tuple[tuple[float, float], ...]:
    """The box's lower and upper ramp (s), relaxation time (s) and factor."""
    found = [(grid[int(at)], grid[int(at) + 1]) for grid, at in zip(GRID, box, strict=False)]
    for digit in box[len(GRID) :]:
        for axis, (low, high) in enumerate(found):
            middle = 0.5 * (low + high)
            found[axis] = (middle, high) if int(digit) >> axis & 1 else (low, middle)
    return tuple(found)


def corners(box: str) -> tuple[Choice, ...]:
    """The box's eight choices."""
    ramps, relaxations, factors = sides(box)
    return tuple(product(ramps, relaxations, factors))


def share(boxes: Iterable[str]) -> float:
    """Volume of boxes over that of the whole range."""
    whole = prod(grid[-1] - grid[0] for grid in GRID)
    return sum(prod(high - low for low, high in sides(box)) for box in boxes) / whole


def excluding_row(readings: Sequence[Values], claims: Iterable[Claim]) -> str | None:
    """Id of the first number that excludes a box with these readings at its corners, or None."""
    if not all(readings):
        return None
    for claim in claims:
        values = [float(values[claim.id]) for values in readings]
        low, high = min(values), max(values)
        spread, allowed = high - low, close_to(claim.paper_value)
        if low - spread > claim.number + allowed or high + spread < claim.number - allowed:
            return claim.id
    return None


def exclude(solve: Solve, solved: Mapping[Choice, Values], depth: int = DEPTH) -> Exclusion:
    """Cut the range until every box is excluded, or was cut ``depth`` times.

    solved : choices whose readings are already known.
    """
    claims = [c for id_, c in read_claims().items() if id_ in driven_ids() and c.kind == "value"]
    cells = product(*(range(len(grid) - 1) for grid in GRID))
    boxes = ["".join(map(str, cell)) for cell in cells]
    known = dict(solved)
    excluded: dict[str, tuple[str, ...]] = {claim.id: () for claim in claims}
    for cut in range(depth + 1):
        known |= solve(sorted({c for box in boxes for c in corners(box)} - set(known)))
        left = []
        for box in boxes:
            row = excluding_row([known[corner] for corner in corners(box)], claims)
            if row is None:
                left.append(box)
            else:
                excluded[row] += (box,)
        boxes = left if cut == depth else [box + digit for box in left for digit in "01234567"]
    agreeing = sum(judged(*one).all_agree for one in known.items())
    return Exclusion({k: v for k, v in excluded.items() if v}, tuple(boxes), len(known), agreeing)
