"""``fingertap identify ramp``: the ramp experiment's outcome, stored in the package, and its text.

The stored outcome is the output of ``fingertap identify ramp --json``.
"""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from functools import cache, partial
from itertools import product

from pydantic import TypeAdapter

from validation import DATA
from validation.harness.command_line import AsJson
from validation.harness.console import output, progress_bar
from validation.harness.files import json_text
from validation.harness.processes import Workers, workers
from validation.harness.provenance import cores, provenance
from validation.harness.uncertainty import two_digits
from validation.models.adapter import Progress
from validation.studies.paper.ramp_experiment import (
    GRID,
    RAMPS,
    RELAXATIONS,
    Exclusion,
    JudgedChoice,
    driven_ids,
    exclude,
    judged,
    share,
    sides,
    solve_choices,
)
from validation.studies.paper.readings import READINGS

FILE = "ramp_experiment.json"


@dataclass(frozen=True)
class RampStudy:
    """The judged choices of the grid, and the search between them."""

    points: tuple[JudgedChoice, ...]
    exclusion: Exclusion


def compute(pool: Workers, progress: Progress) -> RampStudy:
    """Solve the grid, then search the boxes between its points."""
    solve = partial(solve_choices, pool=pool, progress=progress)
    grid = solve(list(product(*GRID)))
    return RampStudy(tuple(judged(*one) for one in grid.items()), exclude(solve, grid))


@cache
def kept_outcome() -> RampStudy:
    """The outcome stored in the package."""
    return TypeAdapter(RampStudy).validate_json((DATA / FILE).read_bytes())


def places(id_: str, points: Sequence[JudgedChoice]) -> str:
    """Number of choices at which a row agrees, in words."""
    return f"{sum(id_ in point.agreeing for point in points)} of {len(points)}"


def closest(points: Iterable[JudgedChoice]) -> JudgedChoice:
    """The choice at which most rows agree."""
    return max(points, key=lambda point: len(point.agreeing))


def sentence(id_: str, outcome: RampStudy) -> str:
    """The experiment's result for one row, in words."""
    points = outcome.points
    best, together = closest(points), sum(point.all_agree for point in points)
    return (
        f"with a ramp or a jump, and damping, it agrees at {places(id_, points)}"
        f" choices of (ramp up to {1e3 * RAMPS[-1]:g} ms, relaxation time up to"
        f" {1e3 * RELAXATIONS[-1]:g} ms, factor), all rows of figs. 13 to 16 together at"
        f" {together or 'none'}; most, {len(best.agreeing)} of {len(READINGS)}, at {place(best)};"
        f" {between(outcome.exclusion)} (fingertap identify ramp)"
    )


def between(exclusion: Exclusion) -> str:
    """The result of the search between the choices, in words."""
    count = sum(len(boxes) for boxes in exclusion.excluded.values())
    text = f"between them {count} boxes, {100 * (1 - share(exclusion.left)):.6g} % of the range,"
    text += " are excluded by a number"
    if exclusion.left:
        ramp, relaxation, _ = (
            max(high for _, high in side) for side in zip(*map(sides, exclusion.left), strict=True)
        )
        text += (
            f"; what is left, relaxation below {1e6 * relaxation:.3g} us and ramp below"
            f" {1e3 * ramp:.3g} ms, rings, and agrees"
        )
    else:
        text += ", and they agree"
    return f"{text} at {exclusion.agreeing or 'none'} of {exclusion.points} choices solved"


def place(point: JudgedChoice) -> str:
    """A point in words."""
    return f"({1e3 * point.ramp_s:g} ms, {1e3 * point.relaxation_time_s:g} ms, {point.factor:.3g})"


def run_identify_ramp(*, as_json: AsJson = False) -> None:
    """Drive the paper's fingers by a ramp, damped, and count the rows of figs. 13 to 16 that agree.

    Each of a grid of (ramp, relaxation time, factor) is judged as the ledger judges, and what lies
    between them is searched for boxes in which no choice can agree.
    """
    with workers(cores()) as pool, progress_bar("ramps") as progress:
        outcome = compute(pool, progress)
    if as_json:
        output(json_text({"provenance": provenance({}), **asdict(outcome)}))
        return
    points, rows = outcome.points, driven_ids()
    output("largest deviation of the three arrival times, the best of all factors and damping:")
    for ramp in RAMPS:
        late = [p.arrivals_percent for p in points if p.ramp_s == ramp]
        known = [percent for percent in late if percent is not None]
        output(
            f"  ramp {1e3 * ramp:g} ms: " + (f"{two_digits(min(known))} %" if known else "no tap")
        )
    output("points of (ramp, relaxation time, factor) at which a row agrees to 5 %:")
    for id_ in rows:
        output(f"  {id_}: {places(id_, points)}")
    best = closest(points)
    missing = ", ".join(id_ for id_ in rows if id_ not in best.agreeing)
    output(
        f"all {len(rows)} rows: {sum(p.all_agree for p in points)}; most,"
        f" {len(best.agreeing)}, at {place(best)}, without {missing or 'exception'}"
    )
    output(between(outcome.exclusion))
