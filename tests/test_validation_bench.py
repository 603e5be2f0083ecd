"""The benchmark: its arithmetic against closed forms, its truths against each other, its rows."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from validation.bench import figures, kernels, scaling, truths, work_precision
from validation.bench.measured import Point, Quantities, errors, table
from validation.bench.timing import shortest

EXACT = Quantities(0.1, 1e-4, 2e-4, 64.0, 0.01)


def test_errors_are_relative_and_events_in_seconds() -> None:
    found = Quantities(0.1 + 3e-6, 1e-4, 2e-4 * 1.01, 64.0 * 0.98, 0.01 * 1.03)
    measured = errors(found, EXACT)
    assert measured.peak == pytest.approx(0.02)
    assert measured.impulse == pytest.approx(0.03)
    assert measured.duration == pytest.approx(0.01)
    assert measured.event_s == pytest.approx(3e-6)
    assert measured.largest == measured.impulse


@pytest.mark.parametrize("power", [0.5, 1.0, 2.0])
def test_exponent_of_a_power_law(power: float) -> None:
    sizes = [5, 10, 20, 40]
    assert scaling.exponent(sizes, [3e-6 * n**power for n in sizes]) == pytest.approx(power)


def test_shortest_counts_its_runs_and_leaves_out_the_warm_up() -> None:
    calls: list[int] = []
    timed = shortest(lambda: calls.append(0) or len(calls), budget_s=0.0, least=4)
    assert len(calls) == 5
    assert timed.runs == 4
    assert timed.result == 5


@pytest.mark.parametrize("counts", [(4, 3), (4, 3, 2)])
def test_box_is_made_of_right_handed_unit_cells(counts: tuple[int, ...]) -> None:
    """Every cell has the volume of a cube, with VTK's node order (a negative one would be not)."""
    points, cells = kernels.box(counts)
    assert len(points) == np.prod([n + 1 for n in counts])
    assert len(np.unique(cells)) == len(points)
    corner = points[cells]
    neighbours = (1, 3) if len(counts) == 2 else (1, 3, 4)
    edges = np.stack([corner[:, a] - corner[:, 0] for a in neighbours], axis=1)
    volume = np.linalg.det(edges)
    assert volume == pytest.approx(np.full(np.prod(counts), kernels.SIZE_M ** len(counts)))
    # the face opposite to the first corner closes the cell
    assert corner[:, 2] - corner[:, 1] == pytest.approx(corner[:, 3] - corner[:, 0])


def test_kernels_are_timed_for_every_element_of_a_dimension() -> None:
    speeds = kernels.measure((6, 4, 4), (1,), budget_s=0.0)
    assert {s.element for s in speeds} >= {"hex8-sri"}
    assert all(s.updates_per_s > 0 and s.elements == 96 for s in speeds)
    assert (kernels.table(speeds)["over_one_thread"] == 1).all()


def test_stored_truth_of_the_tap_is_the_one_that_the_tests_of_hcm_know() -> None:
    """tests/test_hcm_truth.py solves the same scene at another tolerance: digits as printed."""
    tap = truths.TAP.values
    assert tap.contact_time_s == pytest.approx(0.1361070906587, abs=2e-12)
    assert tap.contact_time_s + tap.duration_s == pytest.approx(0.1363394657064, abs=2e-10)
    assert tap.peak_normal_force_N == pytest.approx(64.4778123, rel=2e-8)


def test_solved_impact_converges_to_the_stored_truth() -> None:
    """Two elements a phalanx are further off than five; five are within the measured 1.2e-4."""
    known = truths.CONTACT.values
    far, near = (truths.largest_difference(truths.solve_impact(n, 1e-8), known) for n in (2, 5))
    assert near < 2e-4 < far


def test_ladder_of_tolerances_costs_steps_and_buys_accuracy() -> None:
    rungs = [r for r in work_precision.ladders(quick=True) if r.series == "tolerances"][1:4]
    points = [work_precision.measure(r, truths.TAP.values, budget_s=0.0) for r in rungs]
    assert all(p.ok and p.status == "COMPLETED" for p in points)
    for cheap, dear in pairwise(points):
        assert cheap.steps is not None
        assert dear.steps is not None
        assert dear.steps > cheap.steps
        assert cheap.errors is not None
        assert dear.errors is not None
        assert dear.errors.event_s < cheap.errors.event_s
    frame = table(points)
    assert list(frame["event_error_s"]) == [p.errors.event_s for p in points if p.errors]


def test_a_run_that_fails_is_kept_without_errors(tmp_path: Path) -> None:
    failing = work_precision.Rung("tap", "tolerances", 2, {"max_flight_time": 0.01})
    point = work_precision.measure(failing, truths.TAP.values, budget_s=0.0)
    assert point.status == "NOT_REACHED"
    assert not point.ok
    good = Point("tap", "hcm", "tolerances", "", "COMPLETED", 1e-2, 3, 100, errors(EXACT, EXACT))
    figures.work_precision(tmp_path / "a.png", [good, point], {"tap": 1e-7})
    assert (tmp_path / "a.png").stat().st_size > 0
    assert table([point])["peak_error"].isna().all()
