"""What is refined, what the preset is off by, and the files of a small study."""

import itertools
import json
import math
from pathlib import Path

import numpy as np
import pytest

from tests.validation.commands import Run
from validation.compare.grid_convergence import Convergence
from validation.converge.command import run_converge
from validation.converge.refinements import PENALTY, SHAFT_MESH, TIP_MESH, Tip, refinements
from validation.converge.verdicts import RefinedRuns, judged, preset_rows
from validation.harness.quantities import OF_A_TAP
from validation.harness.store import VALUES

TIP = Tip(1.0, 5e-4, 7.5e-3, (0.0, 0.0, 1e-3), 845.0)


def test_refinements_change_one_thing_each() -> None:
    damped = "material.relaxation_time"
    for quick in (False, True):
        for refinement in refinements(TIP, quick):
            sizes = [level.size for level in refinement.levels]
            assert len(sizes) >= 3
            assert all(fine < coarse for coarse, fine in itertools.pairwise(sizes))
            changing = {
                key
                for level in refinement.levels
                for overrides in level.runs
                for key, value in overrides.items()
                if value != refinement.levels[0].runs[0][key]
            }
            assert (
                changing
                == {
                    TIP_MESH: {
                        "solver.fem.tip_size",
                        "solver.fem.growth",
                        "solver.fem.turn",
                        damped,
                    },
                    SHAFT_MESH: {"solver.fem.section_size", "solver.fem.axial_size"},
                    PENALTY: {"solver.fem.surface_factor", "solver.fem.turn"},
                    "step": {"solver.fem.step_factor"},
                }[refinement.name]
            )


def test_tips_lie_in_all_places_of_their_cells_and_a_finger_keeps_its_damping() -> None:
    (tip,) = [one for one in refinements(TIP, False) if one.name == TIP_MESH]
    assert len(tip.levels) >= 4
    assert tip.levels[-1].size <= 0.12 + 1e-12  # mm: a quarter of the patch's radius
    for level in tip.levels:
        places = [run["solver.fem.turn"] * TIP.radius / (1e-3 * level.size) for run in level.runs]
        assert np.mod(places, 1.0) == pytest.approx([0.5, 0.75, 0.0, 0.25])
        relaxation = level.runs[0]["material.relaxation_time"]
        assert relaxation == pytest.approx((1e-4 * level.size / 845.0,) * 2 + (1e-3,))


def test_a_level_is_the_mean_of_its_runs_and_its_error_counts() -> None:
    (tip,) = [one for one in refinements(TIP, False) if one.name == TIP_MESH]
    peak, scatter = OF_A_TAP[0], np.array([-0.3, -0.1, 0.1, 0.3])
    runs = {
        level.size: [
            dict.fromkeys((entry.key for entry in OF_A_TAP), 100.0 + level.size**2 + noise)
            for noise in scatter
        ]
        for level in tip.levels
    }
    found = judged([RefinedRuns(tip, runs)])[TIP_MESH, peak]
    h = tip.levels[-1].size
    assert found.asymptotic
    assert found.limit == pytest.approx(100.0)
    assert found.order == pytest.approx(2.0)
    error = scatter.std(ddof=1) / 2.0
    assert found.uncertainty == pytest.approx((1.25 * h**2 + error) / (100.0 + h**2))


def test_preset_is_known_by_its_distance_and_every_refinement() -> None:
    def found(limit: float, uncertainty: float) -> Convergence:
        return Convergence(True, 2.0, limit, uncertainty, limit, uncertainty)

    peak, impulse, duration = OF_A_TAP
    verdicts = {
        (TIP_MESH, peak): found(100.0, 0.004),
        (SHAFT_MESH, peak): found(100.0, 0.002),
        ("step", peak): found(100.0, 0.001),
        (PENALTY, peak): found(100.0, 0.003),
        ("step", impulse): found(100.0, 0.5),
    }
    (row,) = preset_rows({peak.key: 99.5, impulse.key: 1.0, duration.key: None}, verdicts)
    assert row["from_limit_percent"] == pytest.approx(-0.5)
    assert row["uncertainty_percent"] == pytest.approx(0.5 + 0.4 + 0.2 + 0.1 + 0.3)


def test_unknown_model_is_refused(tmp_path: Path, fingertap: Run) -> None:
    assert "fem3d" in fingertap("converge", "soft", "--model", "hcm", "--out", tmp_path).refusal


@pytest.mark.slow
def test_plane_study_is_written_and_resumed(tmp_path: Path) -> None:
    run_converge("soft", model="fem2d", quick=True, out=tmp_path)
    folder = tmp_path / "converge" / "soft-fem2d-quick"
    for name in ("levels.csv", "convergence.csv", "convergence.md", "convergence.png"):
        assert (folder / name).stat().st_size > 100
    kept = sorted((tmp_path / "store").iterdir())
    assert len(kept) > 5
    times = [path.stat().st_mtime_ns for path in kept]
    value = json.loads((kept[0] / VALUES).read_text())[OF_A_TAP[0].key]
    assert math.isfinite(value)
    run_converge("soft", model="fem2d", quick=True, out=tmp_path)
    assert [path.stat().st_mtime_ns for path in kept] == times
