"""Between the choices of the ramp experiment: boxes in which no choice can agree with the paper.

A box of (ramp, relaxation time, factor) is excluded by a number x of figs. 13 to 16 if

    min x - s > x_p + d    or    max x + s < x_p - d,    s = max x - min x,

over the box's eight corners, x_p the printed value and d the deviation that the ledger calls close.
This assumes that inside a box x leaves the range of its corners by less than that range is wide. A
box that no number excludes is cut into eight. Counts and states jump, so they exclude nothing.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod

from validation.compare.claims import Claim, read_claims
from validation.studies.paper.ledger import close_to
from validation.studies.paper.ramp_experiment import (
    FACTORS,
    RAMPS,
    RELAXATIONS,
    Choice,
    Values,
    driven_ids,
    judged,
)

GRID = (RAMPS, RELAXATIONS, FACTORS)
DEPTH = 3  # times that a box is cut
Solve = Callable[[Sequence[Choice]], Mapping[Choice, Values]]
Sides = tuple[tuple[float, float], ...]


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


def sides(box: str) -> Sides:
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
    rows = len(driven_ids())
    agreeing = sum(len(judged(*one).agreeing) == rows for one in known.items())
    return Exclusion({k: v for k, v in excluded.items() if v}, tuple(boxes), len(known), agreeing)
