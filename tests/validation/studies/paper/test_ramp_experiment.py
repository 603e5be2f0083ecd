"""The driven cases with a ramp and damping: what is kept is what is computed, and is told."""

from itertools import product

import pytest

from tests.validation.commands import Run
from validation.scenes.load import load_scene
from validation.studies.paper import ramp_command
from validation.studies.paper.ramp_experiment import (
    FACTORS,
    RAMPS,
    RELAXATIONS,
    closest,
    driven_ids,
    kept_points,
    ramped,
    sentence,
    solve_point,
)


def test_a_point_is_judged_as_it_was_kept() -> None:
    kept = {(p.ramp_s, p.relaxation_time_s, p.factor): p for p in kept_points()}
    assert set(kept) == set(product(RAMPS, RELAXATIONS, FACTORS))
    place = (5e-4, 1e-4, 7e-5)
    found = solve_point(*place)
    assert found.agreeing == kept[place].agreeing
    assert found.arrivals_percent == pytest.approx(kept[place].arrivals_percent, rel=1e-6)


def test_each_driven_row_is_told_that_none_agree_together() -> None:
    points = kept_points()
    assert len(driven_ids()) == 20
    assert all(set(point.agreeing) < set(driven_ids()) for point in points)
    text = sentence("F13.2", points)
    assert f"of {len(points)} choices" in text
    assert "together at none" in text
    assert f"most, {len(closest(points).agreeing)} of 20" in text


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
    monkeypatch.setattr(ramp_command, "solve_grid", lambda pool, progress: kept_points())
    text = fingertap("identify", "ramp").out
    assert "all 20 rows: 0; most," in text
    assert "F16.4:" in text
    assert '"agreeing"' in fingertap("identify", "ramp", "--json").out
