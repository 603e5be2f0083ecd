"""Section 4.3 with a ramp and damping: whether any choice of them agrees with figs. 13 to 16.

The article's torques jump and its finger has no damping, so that what follows rings at every
frequency of the mesh. Here the torques rise from zero over a ramp and the material has Kelvin and
Voigt's damping: three numbers (ramp, relaxation time, t_3 factor) for all three cases. At every
point of a grid each of the article's rows is judged as the ledger judges it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

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
FACTORS = (6.6e-5, 6.8e-5, 7.0e-5, 7.2e-5, 7.4e-5, 7.6e-5, 7.8e-5)  # N m per printed unit
# With 20 elements the readings of a damped finger differ by 1 % at most (stresses; others 0.1 %)
# and the counts not at all. Without damping they depend on the mesh, as `driven_cases` shows.
NUMERICS = ("finger.elements=10", "solver.hcm.estimate=false", *DEFAULTS)
# Postures are kept around the contact: between these shares of the printed arrival; step, s.
WINDOW, POSTURE_STEP = (0.95, 1.4), 2e-5
Choice = tuple[float, float, float]  # ramp (s), relaxation time (s), factor
Values = Mapping[str, float | bool]
Solved = dict[Choice, Values]


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
    runs: dict[str, CaseRun] = {
        scene: solve_case(ramped(scene, *choice)) for scene in PRINTED_TORQUES
    }
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
