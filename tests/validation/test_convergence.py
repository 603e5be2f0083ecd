"""The grid convergence index on sequences whose limit is known, and the study's own pieces."""

import itertools
import json
import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from validation.compare.grid_convergence import Convergence, convergence, observed_order
from validation.converge.command import preset_rows, run_converge
from validation.converge.refinements import QUANTITIES, SHAFT_MESH, TIP_MESH, ladders
from validation.errors import UserError


@given(st.floats(0.6, 2.0), st.floats(1.2, 3.0), st.floats(1.2, 3.0), st.floats(0.01, 0.3))
def test_order_and_limit_of_a_power_law(p: float, r32: float, r21: float, slope: float) -> None:
    sizes = (r32 * r21, r21, 1.0)
    values = [10.0 + slope * h**p for h in sizes]
    assert observed_order(sizes, values) == pytest.approx(p, rel=1e-5)
    found = convergence(sizes, values, 2.0)
    assert found.asymptotic
    assert found.limit == pytest.approx(10.0, rel=1e-6)
    # The index is 1.25 times the true error, over the finest value.
    assert found.uncertainty == pytest.approx(1.25 * slope / values[-1], rel=1e-3)


def test_celiks_example() -> None:
    # Celik et al. 2008, table 1, first column: r_21 = 1.5, r_32 = 1.333 and 6.063, 5.972, 5.863
    # give p = 1.53, phi_ext = 6.1685 and a GCI of 2.2 %.
    found = convergence((2.0, 1.5, 1.0), (5.863, 5.972, 6.063), 2.0)
    assert found.order == pytest.approx(1.53, abs=0.01)
    assert found.limit == pytest.approx(6.1685, abs=2e-3)
    assert found.uncertainty == pytest.approx(0.022, abs=5e-4)


def test_wiggles_and_wrong_orders_are_not_asymptotic() -> None:
    wiggle = convergence((4.0, 2.0, 1.0), (1.0, 1.2, 1.1), 2.0)
    assert not wiggle.asymptotic
    assert wiggle.uncertainty == pytest.approx(0.2 / 1.1)
    assert "not asymptotic" in wiggle.verdict
    assert not convergence((4.0, 2.0, 1.0), (1.0, 1.1, 1.2), 2.0).asymptotic  # order 0
    # Four levels: the three before the finest must point to the same limit.
    values = [1.0 + h**2 for h in (0.4, 0.2, 0.1)]
    assert convergence((0.8, 0.4, 0.2, 0.1), [1.64, *values], 2.0).asymptotic
    assert not convergence((0.8, 0.4, 0.2, 0.1), [0.5, *values], 2.0).asymptotic


def test_orders_above_the_formal_one_do_not_shrink_the_error_bar() -> None:
    values = [1.0 + h**4 for h in (0.4, 0.2, 0.1)]
    found = convergence((0.4, 0.2, 0.1), values, 2.0)
    change = abs(values[1] - values[2])
    assert found.uncertainty == pytest.approx(1.25 * change / values[2] / 3.0)


def test_bad_sequences_are_refused() -> None:
    with pytest.raises(ValueError, match="three levels"):
        convergence((2.0, 1.0), (1.0, 1.0), 2.0)
    with pytest.raises(ValueError, match="do not fall"):
        convergence((1.0, 2.0, 3.0), (1.0, 1.0, 1.0), 2.0)


def test_ladders_refine_one_thing_each() -> None:
    for quick in (False, True):
        for ladder in ladders(1.0, quick):
            sizes = [level.size for level in ladder.levels]
            assert len(sizes) >= 3
            assert all(fine < coarse for coarse, fine in itertools.pairwise(sizes))
            changing = {
                key
                for level in ladder.levels
                for key, value in level.overrides.items()
                if value != ladder.levels[0].overrides[key]
            }
            assert (
                changing
                == {
                    TIP_MESH: {"solver.fem.tip_size", "solver.fem.growth"},
                    SHAFT_MESH: {"solver.fem.section_size", "solver.fem.axial_size"},
                    "penalty": {"solver.fem.surface_factor"},
                    "step": {"solver.fem.step_factor"},
                }[ladder.name]
            )
    full = next(ladder for ladder in ladders(1.0, False) if ladder.name == TIP_MESH)
    assert len(full.levels) >= 4
    assert full.levels[-1].size <= 0.1 + 1e-12  # mm


def test_preset_is_known_by_its_distance_and_every_ladder_but_the_penaltys() -> None:
    def found(limit: float, uncertainty: float) -> Convergence:
        return Convergence(True, 2.0, limit, uncertainty, limit, uncertainty)

    peak = QUANTITIES[0]
    verdicts = {
        (TIP_MESH, peak): found(100.0, 0.004),
        (SHAFT_MESH, peak): found(100.0, 0.002),
        ("step", peak): found(100.0, 0.001),
        ("penalty", peak): found(100.0, 0.5),
        ("step", QUANTITIES[1]): found(100.0, 0.5),
    }
    (row,) = preset_rows({peak: 99.5, QUANTITIES[1]: 1.0, QUANTITIES[2]: None}, verdicts)
    assert row["from_limit_percent"] == pytest.approx(-0.5)
    assert row["uncertainty_percent"] == pytest.approx(0.5 + 0.4 + 0.2 + 0.1)


def test_unreachable_scene_and_unknown_model_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="fem3d"):
        run_converge("soft", model="hcm", quick=True, out=tmp_path)  # type: ignore[arg-type]


@pytest.mark.slow
def test_plane_study_is_written_and_resumed(tmp_path: Path) -> None:
    run_converge("soft", model="fem2d", quick=True, out=tmp_path)
    folder = tmp_path / "converge" / "soft-fem2d-quick"
    for name in ("levels.csv", "convergence.csv", "convergence.md", "convergence.png"):
        assert (folder / name).stat().st_size > 100
    kept = sorted((tmp_path / "converge" / "levels").iterdir())
    times = [path.stat().st_mtime_ns for path in kept]
    value = json.loads(kept[0].read_text())["values"][QUANTITIES[0]]
    assert math.isfinite(value)
    run_converge("soft", model="fem2d", quick=True, out=tmp_path)
    assert [path.stat().st_mtime_ns for path in kept] == times
