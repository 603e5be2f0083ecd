"""The driven cases with a ramp and damping: what is kept is what is computed, and is told."""

from collections.abc import Sequence
from itertools import pairwise, product

import numpy as np
import pytest

from tests.validation.commands import Run
from validation.compare.claims import read_claims
from validation.scenes.load import load_scene
from validation.studies.paper import ramp_outcome
from validation.studies.paper.ramp_experiment import (
    GRID,
    Choice,
    Exclusion,
    Solved,
    corners,
    driven_ids,
    exclude,
    excluding_row,
    judged,
    ramped,
    share,
    sides,
    solve_choice,
)
from validation.studies.paper.ramp_outcome import between, closest, kept_outcome, sentence

STRESS, AT = "F14.5", 7.1e-5  # the row that made-up readings deviate in, where they do not


def test_a_point_is_judged_as_it_was_kept() -> None:
    kept = {(p.ramp_s, p.relaxation_time_s, p.factor): p for p in kept_outcome().points}
    assert set(kept) == set(product(*GRID))
    place = (5e-4, 1e-4, 7e-5)
    found = judged(place, solve_choice(place))
    assert found.agreeing == kept[place].agreeing
    assert found.arrivals_percent == pytest.approx(kept[place].arrivals_percent, rel=1e-6)


def made_up(choices: Sequence[Choice]) -> Solved:
    """All rows as printed, but for a stress that is off by five times what the factor is off AT."""
    claims = read_claims()
    printed = {id_: claims[id_].number if claims[id_].kind != "state" else True
               for id_ in driven_ids()}  # fmt: skip
    return {c: {**printed, STRESS: printed[STRESS] * (1 + 5 * (c[2] / AT - 1))} for c in choices}


def test_what_agrees_is_never_excluded_and_what_is_far_off_is() -> None:
    """Of a linear reading a box stays exactly if it lies within its own height of what agrees."""
    found = exclude(made_up, {}, depth=2)
    ends = np.linspace(GRID[2][0], GRID[2][-1], 4 * (len(GRID[2]) - 1) + 1)
    height = ends[1] - ends[0]
    expected = [
        (low, high)
        for low, high in pairwise(ends)
        if low - height <= AT * 1.01 and high + height >= AT * 0.99
    ]
    left = sorted({sides(box)[2] for box in found.left})
    np.testing.assert_allclose(left, expected, rtol=1e-12)
    assert set(found.excluded) == {STRESS}
    assert share((*found.left, *found.excluded[STRESS])) == pytest.approx(1.0, abs=1e-12)
    assert 0 < found.agreeing < found.points


def test_a_box_with_a_corner_without_a_tap_stays() -> None:
    claims = [read_claims()[STRESS]]
    far = {STRESS: 10 * claims[0].number}
    assert excluding_row([far] * 8, claims) == STRESS
    assert excluding_row([far] * 7 + [{}], claims) is None


def test_the_boxes_that_are_kept_fill_the_range_and_are_excluded() -> None:
    """All of them by volume; the first, the middle and the last of them are solved again."""
    kept = kept_outcome().exclusion
    assert len({sides(f"000{octant}") for octant in range(8)}) == 8
    boxes = sorted((box, row) for row, mine in kept.excluded.items() for box in mine)
    whole = share([*(box for box, _ in boxes), *kept.left])
    assert whole == pytest.approx(1.0, abs=1e-12)
    boxes.sort(key=lambda found: len(found[0]))
    for box, row in (boxes[0], boxes[len(boxes) // 2], boxes[-1]):
        readings = [solve_choice(corner) for corner in corners(box)]
        assert excluding_row(readings, [read_claims()[row]]) == row
    assert kept.agreeing == 0


def test_each_driven_row_is_told_that_none_agree_together() -> None:
    outcome = kept_outcome()
    points = outcome.points
    assert len(driven_ids()) == 20
    assert all(set(point.agreeing) < set(driven_ids()) for point in points)
    text = sentence("F13.2", outcome)
    assert f"of {len(points)} choices" in text
    assert "together at none" in text
    assert f"most, {len(closest(points).agreeing)} of 20" in text
    assert f"at none of {outcome.exclusion.points} choices solved" in text


def test_torques_rise_over_the_ramp_or_jump() -> None:
    case = ramped("driven-2", 1e-3, 1e-5, 7e-5)
    tables = load_scene(case.scene, case.overrides).tables
    assert tables.drive.torques.time == (0.0, 1e-3)
    assert tables.torque_rows == ((0.0, 0.0, 0.0), pytest.approx((1.0, 0.8, 0.21)))
    assert tables.material.relaxation_time == 1e-5
    jump = ramped("driven-2", 0.0, 0.0, 7e-5)
    assert len(load_scene(jump.scene, jump.overrides).tables.torque_rows) == 1


def test_the_command_prints_rows_and_the_closest(
    monkeypatch: pytest.MonkeyPatch, fingertap: Run
) -> None:
    monkeypatch.setattr(ramp_outcome, "compute", lambda pool, progress: kept_outcome())
    text = fingertap("identify", "ramp").out
    assert "all 20 rows: 0; most," in text
    assert "F16.4:" in text
    assert '"agreeing"' in fingertap("identify", "ramp", "--json").out


def test_what_is_excluded_is_the_rest_of_what_is_left() -> None:
    """An eighth of a cell of the grid is left; the other cells and its other eighths are not."""
    cells = ["".join(map(str, at)) for at in product(*(range(len(grid) - 1) for grid in GRID))]
    excluded = (*cells[1:], *(f"{cells[0]}{octant}" for octant in range(1, 8)))
    left = f"{cells[0]}0"
    text = between(Exclusion({STRESS: excluded}, (left,), 9, 0))
    first = np.prod([grid[1] - grid[0] for grid in GRID])
    whole = np.prod([grid[-1] - grid[0] for grid in GRID])
    assert f"{100 * (1 - first / 8 / whole):.6g} % of the range, are excluded" in text
    ramp, relaxation = (0.5 * (grid[0] + grid[1]) for grid in GRID[:2])
    assert f"relaxation below {1e6 * relaxation:.3g} us and ramp below {1e3 * ramp:.3g} ms" in text
