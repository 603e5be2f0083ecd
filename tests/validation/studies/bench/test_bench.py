"""The benchmark: its arithmetic against closed forms, its truths against each other, its rows."""

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib import pyplot as plt
from matplotlib.colors import to_rgba

import hcm
from tests.validation.commands import Capture, Patch
from tests.validation.studies.bench import truths_anew
from validation.compare.tap_errors import TapErrors, TapQuantities, tap_errors
from validation.harness.figures import GREY
from validation.harness.provenance import provenance
from validation.harness.store import Store
from validation.harness.timing import Timed, shortest
from validation.peers.bar import SIZE_M, Bar, BarRun, box
from validation.scenes.load import load_scene
from validation.studies.bench import (
    command,
    figures,
    files,
    hcm_settings,
    hcm_speed,
    kernels,
    reference_settings,
    truths,
    work_precision,
)
from validation.studies.bench.bar import OWN, BarRow
from validation.studies.bench.kernels import FALL_M_PER_S, falling_block
from validation.studies.bench.shortcuts import Entry
from validation.studies.bench.shortcuts import table as ledger_table
from validation.studies.bench.work_precision import (
    Point,
    Setting,
    Solution,
    Solver,
    front,
    measure_setting,
    measure_settings,
    point_against,
    table,
)

EXACT = TapQuantities(0.1, 1e-4, 2e-4, 64.0, 0.01)
LATER = "2100-01-01T00:00:00+00:00"


def _hcm_point(setting: Setting, solver: Solver = hcm_settings.HCM_SOLVER) -> Point:
    truth = truths.TRUTHS[setting.study].values
    return point_against(truth, setting, measure_setting(setting, solver, budget_s=0.0))


def _reference_point(setting: Setting) -> Point:
    solver = replace(reference_settings.REFERENCE_SOLVER, least_runs=1)
    truth = truths.REFERENCE_TRUTHS[setting.study].values
    return point_against(truth, setting, measure_setting(setting, solver, 0.0, warm_up=False))


def test_errors_are_relative_and_events_in_seconds() -> None:
    found = TapQuantities(0.1 + 3e-6, 1e-4, 2e-4 * 1.01, 64.0 * 0.98, 0.01 * 1.03)
    measured = tap_errors(found, EXACT)
    assert measured.peak == pytest.approx(0.02)
    assert measured.impulse == pytest.approx(0.03)
    assert measured.duration == pytest.approx(0.01)
    assert measured.event_s == pytest.approx(3e-6)
    assert measured.largest == measured.impulse


@pytest.mark.parametrize("power", [0.5, 1.0, 2.0])
def test_exponent_of_a_power_law(power: float) -> None:
    sizes = [5, 10, 20, 40]
    assert hcm_speed.exponent(sizes, [3e-6 * n**power for n in sizes]) == pytest.approx(power)


def test_shortest_counts_its_runs_and_leaves_out_the_warm_up() -> None:
    calls: list[int] = []
    timed = shortest(lambda: calls.append(0) or len(calls), budget_s=0.0, least=4)
    assert (len(calls), timed.runs, timed.result) == (5, 4, 5)


@pytest.mark.parametrize("counts", [(4, 3), (4, 3, 2)])
def test_box_is_made_of_right_handed_unit_cells(counts: tuple[int, ...]) -> None:
    """Every cell has the volume of a cube, with VTK's node order (a negative one would be not)."""
    points, cells = box(counts)
    assert len(points) == np.prod([n + 1 for n in counts])
    assert len(np.unique(cells)) == len(points)
    corner = points[cells]
    neighbours = (1, 3) if len(counts) == 2 else (1, 3, 4)
    edges = np.stack([corner[:, a] - corner[:, 0] for a in neighbours], axis=1)
    volume = np.linalg.det(edges)
    assert volume == pytest.approx(np.full(np.prod(counts), SIZE_M ** len(counts)))
    # the face opposite to the first corner closes the cell
    assert corner[:, 2] - corner[:, 1] == pytest.approx(corner[:, 3] - corner[:, 0])


def test_kernels_are_timed_for_every_element_of_a_dimension() -> None:
    speeds = kernels.measure_box((6, 4, 4), (1,), budget_s=0.0)
    assert {s.element for s in speeds} >= {"hex8-sri"}
    assert all(s.million_updates_per_s > 0 and s.elements == 96 for s in speeds)
    assert all(s.over_one_thread == 1 for s in speeds)
    assert np.isfinite([s.step_over_kernel for s in speeds]).all()
    # u, v of the state, X, masses and forces' buffer alone: 13 numbers a node, 175 nodes
    assert all(s.model_and_state_MB > 13 * 175 * 8e-6 for s in speeds)
    one_point = next(s for s in speeds if s.element == "hex8-one-point")
    assert one_point.bytes_per_element == 8 * 4 + 3 * 8


@pytest.mark.parametrize("counts", [(4, 3), (4, 3, 2)])
def test_timed_steps_have_the_whole_lower_side_in_contact(counts: tuple[int, ...]) -> None:
    from reference_fem import Material
    from reference_fem.dynamics.step import advance, start_state

    points, cells = box(counts)
    element = "hex8-one-point" if len(counts) == 3 else "quad4-plane-stress"
    model = falling_block(points, cells, element, Material(1e9, 0.4, 1e3))
    assert len(model.contact.nodes) == np.prod([counts[0] + 1, *(n + 1 for n in counts[2:])])
    velocity = np.zeros_like(model.points)
    velocity[:, 1] = -FALL_M_PER_S
    state = start_state(model, np.zeros_like(velocity), velocity, 0.0)
    after, _ = advance(model, state, 2, True)
    assert after.memory.touching.all()


def test_stored_truth_of_the_tap_is_the_one_that_the_tests_of_hcm_know() -> None:
    """tests.hcm.test_reference_solution solves it at another tolerance: digits as printed."""
    tap = truths.TAP.values
    assert tap.contact_time_s == pytest.approx(0.1361070906587, abs=2e-12)
    assert tap.contact_time_s + tap.duration_s == pytest.approx(0.1363394657064, abs=2e-10)
    assert tap.peak_normal_force_N == pytest.approx(64.4778123, rel=2e-8)


def test_solved_impact_converges_to_the_stored_truth() -> None:
    """Two elements a phalanx are further off than five; five are within the measured 1.2e-4."""
    known = truths.TRUTHS["contact"].values
    far, near = (tap_errors(hcm_settings.solve_impact(n, 1e-8), known).largest for n in (2, 5))
    assert near < 2e-4 < far


def test_a_series_of_tolerances_costs_steps_and_buys_accuracy() -> None:
    settings = hcm_settings.tap_and_contact_settings(quick=True)
    points = [_hcm_point(s) for s in settings if s.series == "tolerances"][1:4]
    assert all(p.errors for p in points)
    assert all(p.ok and p.status == "COMPLETED" for p in points)
    for cheap, dear in pairwise(points):
        assert dear.steps > cheap.steps
        assert dear.errors.event_s < cheap.errors.event_s
    assert [row["event_error_s"] for row in table(points)] == [p.errors.event_s for p in points]


def test_a_run_that_fails_is_kept_without_errors(tmp_path: Path) -> None:
    failing = hcm_settings.hcm_setting("tap", "tolerances", 2, {"max_flight_time": 0.01})
    point = _hcm_point(failing)
    assert point.status == "NOT_REACHED"
    assert not point.ok
    good = replace(point, status="COMPLETED", errors=tap_errors(EXACT, EXACT))
    figures.work_precision(tmp_path / "a.png", [good, point])
    assert (tmp_path / "a.png").stat().st_size > 0
    assert table([point])[0]["peak_error"] is None


def _solid(time: float, error: float | None, model: str = "fem3d") -> Point:
    found = None if error is None else TapErrors(error, error, error, error)
    status = "COMPLETED" if error is not None else "UNSTABLE"
    return Point(model, model, "mesh", "", status, time, 2, 10, found)


def test_a_run_of_the_stored_truth_is_as_near_to_it_as_it_says() -> None:
    """The tip of twice the edge: what the truth's own error is read from."""
    known = truths.TRUTHS["fem2d"]
    found = tap_errors(truths_anew.solve_tap("fem2d", 0.5, 0.5), known.values)
    assert 0.5 * known.own_error < found.largest < known.own_error


def test_truth_is_the_finest_run_with_the_shafts_change_and_the_true_bodys_flight(
    monkeypatch: Patch,
) -> None:
    peaks = {(2.0, 0.5): 95.0, (2.0, 1.0): 94.0, (1.0, 1.0): 94.25}
    monkeypatch.setattr(truths_anew, "solve_tap", lambda _, shaft, tip: TapQuantities(
        0.1, 1e-4, 2e-4, peaks[shaft, tip], 0.01))  # fmt: skip
    found = truths_anew.solve_truth("fem3d")
    assert found.peak_normal_force_N == pytest.approx(95.25, rel=1e-14)
    stored = truths.TRUTHS["fem3d"].values.contact_time_s  # to six digits
    assert found.contact_time_s == pytest.approx(stored, rel=1e-5)


def test_two_integrators_of_one_mesh_leave_the_same_error() -> None:
    """At 5 elements the mesh's 1e-4 is left by either; their own are below a tenth of it."""
    tight = next(s for s in hcm_settings.dop853_settings(quick=True)
                 if s.name == "5 elements, rtol 1e-06")  # fmt: skip
    explicit = _hcm_point(tight, hcm_settings.DOP853_SOLVER).errors
    changes = hcm_settings.IMPACT_TOLERANCE
    implicit = _hcm_point(hcm_settings.hcm_setting("contact", "elements", 5, changes)).errors
    assert explicit.peak == pytest.approx(implicit.peak, rel=0.1)
    assert explicit.duration == pytest.approx(implicit.duration, rel=0.1)


def test_front_is_what_no_setting_beats() -> None:
    points = [_solid(3.0, 1e-3), _solid(1.0, 1e-1), _solid(2.0, 2e-1), _solid(0.1, None)]
    assert front(points, "peak") == [(1.0, 1e-1), (3.0, 1e-3)]


def test_both_models_on_one_plot_with_the_gap_between_their_truths(tmp_path: Path) -> None:
    known = {"hcm": truths.TAP, **truths.REFERENCE_TRUTHS}
    gap = tap_errors(truths.TAP.values, truths.TRUTHS["fem3d"].values)
    assert gap.peak == pytest.approx(1 - 64.478 / 95.623, rel=1e-4)
    peak = next(r for r in truths.truths_table(known) if r["quantity"] == "peak_normal_force_N")
    assert peak["hcm_off_fem3d"] == pytest.approx(-gap.peak)
    points = [_solid(1.0, 0.1), _solid(0.2, None, "fem2d"), _solid(0.01, 1e-4, "hcm")]
    figures.both_models(tmp_path / "all.png", points, known)
    assert (tmp_path / "all.png").stat().st_size > 0


@pytest.mark.parametrize("model", truths.REFERENCE_TRUTHS)
def test_reference_settings_change_mesh_penalty_and_step(model: str) -> None:
    settings = reference_settings.reference_settings(model, quick=False)
    quick = reference_settings.reference_settings(model, quick=True)
    assert all(setting in settings for setting in quick)
    assert len(quick) < len(settings)
    assert {r.series.split(",")[0] for r in settings} == {
        "presets", "mesh", "nodal penalty", "surface penalty", "step"
    }  # fmt: skip
    for setting in settings:
        fem = load_scene("soft", setting.overrides()).tables.solver.fem
        if setting.series.startswith("mesh"):
            assert setting.name == f"tip {1e3 * fem.tip_size:.3g} mm"
            assert fem.growth == pytest.approx(1.25 ** (fem.tip_size / 1e-4))


def test_step_beyond_stability_is_a_failed_point_and_a_finer_tip_a_better_one() -> None:
    settings = reference_settings.reference_settings("fem2d", quick=True)
    point = _reference_point(next(s for s in settings if "unstable" in s.name))
    assert (point.status, point.errors) == ("UNSTABLE", None)
    coarse, fine = (
        _reference_point(next(s for s in settings if text in s.name)).errors
        for text in ("tip 0.283 mm", "tip 0.1 mm")
    )
    assert fine.duration < 0.5 * coarse.duration
    assert fine.largest < 0.02  # measured 1.1e-2; the truth's own error is 2e-3


def test_stopped_benchmark_is_taken_up_where_it_was(
    tmp_path: Path, capsys: Capture, monkeypatch: Patch
) -> None:
    settings = [hcm_settings.hcm_setting("tap", "tolerances", n) for n in (2, 3)]
    good, bad = Solution("COMPLETED", EXACT, 10), Solution("UNSTABLE", None)

    def measured(*solutions: Solution, resume: bool) -> list[Point]:
        left = iter(solutions)
        solver = replace(hcm_settings.HCM_SOLVER, read=lambda result: next(left))
        store = Store(tmp_path, fresh=not resume)
        return measure_settings(settings, solver, 0.0, store, lambda share, text: None)

    first = measured(good, bad, resume=False)
    assert [point.ok for point in first] == [True, False]
    monkeypatch.setattr(work_precision, "now", lambda: LATER)
    again = measured(bad, good, resume=True)
    assert again == [replace(point, read_back=True) for point in first]
    assert LATER not in [row["measured"] for row in table(again)]
    assert "2 settings were measured" in capsys.readouterr().err
    with files.measured_part(tmp_path, True, "skips") as points:
        points += again
        files.save(tmp_path, "skips", table(points), "", show=False)
    html = files.page(tmp_path).read_text(encoding="utf-8")
    assert f"skips: measured {first[0].measured}" in html
    assert "settings read back from an earlier benchmark: 2 of 2" in html
    assert LATER not in html
    assert [point.ok for point in measured(bad, good, resume=False)] == [False, True]


def test_page_shows_what_is_there_and_nothing_from_elsewhere(tmp_path: Path) -> None:
    changes = TapErrors(1e-3, 2e-3, 3e-3, 0.0)
    entries = [Entry("rigid flight", "fem2d", "flight = explicit", 1.0, 90.0, changes, "")]
    with files.measured_part(tmp_path, True, "skips"):
        files.save(tmp_path, "skips", ledger_table(entries), "ledger")
        figures.shortcuts(tmp_path / "skips.png", entries)
    html = files.page(tmp_path).read_text(encoding="utf-8")
    assert "The skip ledger" in html
    assert "rigid flight" in html
    assert "Peers" not in html
    assert "data:image/svg+xml;base64," in html
    assert "http" not in html.replace("http://www.w3.org", "")


def _stop() -> None:
    raise KeyboardInterrupt


def test_each_part_of_the_page_keeps_the_date_and_the_settings_of_its_measurement(
    tmp_path: Path, monkeypatch: Patch
) -> None:
    """A bench that was stopped at once dated the whole page anew, without "quick"."""
    entry = Entry("rigid flight", "fem2d", "flight = explicit", 1.0, 90.0, None, "")
    with files.measured_part(tmp_path, True, "scaling"):
        files.save(tmp_path, "scaling", [{"size": 1}], "", show=False)
    with files.measured_part(tmp_path, False, "skips"):
        files.save(tmp_path, "skips", ledger_table([entry, entry]), "", show=False)
        figures.shortcuts(tmp_path / "skips.png", [entry, entry])
    first = json.loads((tmp_path / "machine-scaling.json").read_text(encoding="utf-8"))["created"]
    old = provenance({})
    monkeypatch.setattr(files, "provenance", lambda document: {**old, "created": LATER})
    with suppress(KeyboardInterrupt), files.measured_part(tmp_path, False, "kernels"):
        _stop()
    with suppress(KeyboardInterrupt), files.measured_part(tmp_path, False, "skips"):
        files.save(tmp_path, "skips", ledger_table([entry]), "", show=False)
        _stop()
    html = files.page(tmp_path).read_text(encoding="utf-8")
    assert re.search(f"scaling: measured {re.escape(first)}[^;]*, quick\\.", html)
    assert f"skips: measured {LATER}; it was stopped, and this is what it had." in html
    assert "kernels: " not in html
    assert not (tmp_path / "skips.png").exists()  # of the ledger before


def test_a_stopped_benchmark_has_a_page_of_what_it_measured(
    tmp_path: Path, monkeypatch: Patch, capsys: Capture
) -> None:
    def shortcuts(folder: Path, quick: bool) -> None:
        with files.measured_part(folder, quick, "skips"):
            files.save(folder, "skips", [{"size": 1}], "", show=False)
            _stop()

    monkeypatch.setattr(command, "_bench_shortcuts", shortcuts)
    with pytest.raises(KeyboardInterrupt):
        command.bench(skips=True, out=tmp_path)
    page = tmp_path / "bench" / "index.html"
    assert f"stopped; what was measured by then, if anything: {page}" in capsys.readouterr().err
    assert "it was stopped, and this is what it had" in page.read_text(encoding="utf-8")


def test_only_settings_that_were_not_meant_to_fail_are_told(
    tmp_path: Path, capsys: Capture
) -> None:
    meant = replace(_solid(1.0, None), setting=f"{reference_settings.FAILS}, 9 elements")
    command._report(tmp_path, True, [], [_solid(1.0, 0.1), meant])
    assert "failed" not in capsys.readouterr().err
    command._report(tmp_path, True, [], [_solid(1.0, None), meant])
    assert "settings that failed: 1" in capsys.readouterr().err


def test_random_scenes_are_shared_out_and_all_of_them_end(monkeypatch: Patch) -> None:
    monkeypatch.setattr(hcm_speed, "QUICK_SCENES", 5)
    told: list[float] = []
    measured = hcm_speed.measure_throughput(True, lambda share, text: told.append(share))
    ended = sum(int(text.split()[0]) for text in measured["endings"].split(", "))
    assert measured["scenes"] == ended == 5
    alone = [hcm.simulate_scene(scene) for scene in hcm_speed.scenes(5)]
    steps = sum(result.statistics.steps for result in alone)
    assert measured["steps_per_s"] == steps / measured["wall_time_s"]
    assert steps > 0
    assert told[-1] == 1.0
    assert measured["scenes_per_s"] == pytest.approx(5 / measured["wall_time_s"])


@dataclass(frozen=True)
class Held:
    whole: np.ndarray
    part: np.ndarray
    deeper: tuple[dict[str, np.ndarray], float]


def test_every_array_counts_once() -> None:
    whole = np.zeros(1000)
    other = np.zeros(10, dtype=np.int32)
    held = Held(whole, whole[10:20], ({"a": other, "b": whole}, 1.0))
    assert kernels.array_bytes(held, other, held) == 8000 + 40
    assert kernels.array_bytes(3.0, "text") == 0
    assert kernels.array_bytes(whole[5:6]) == 8000


def test_a_point_that_was_timed_for_less_is_timed_again(monkeypatch: Patch, tmp_path: Path) -> None:
    """The shortest of a tenth of a second's runs was given for that of ten seconds'."""
    budgets = []

    def measured(setting: Setting, solver: Solver, budget_s: float, warm_up: bool) -> Any:
        budgets.append(budget_s)
        return Timed(Solution("COMPLETED", None), 1.0, 3)

    monkeypatch.setattr(work_precision, "measure_setting", measured)
    setting = hcm_settings.hcm_setting("tap", "tolerances", 2, {})
    for budget in (0.1, 10.0, 0.1):
        store, solver = Store(tmp_path), hcm_settings.HCM_SOLVER
        measure_settings([setting], solver, budget, store, lambda share, text: None)
    assert budgets == [0.1, 10.0]


@contextmanager
def _unsaved(path: Path, columns: int, rows: int = 1, **_: Any) -> Iterator[Any]:
    """Panels that are drawn into, and written to no file, which takes seconds."""
    yield plt.subplots(rows, columns, squeeze=False)[1]


@pytest.mark.usefixtures("figures_kept")
def test_times_and_speeds_are_drawn_in_the_units_of_their_axes(
    tmp_path: Path, monkeypatch: Patch
) -> None:
    """A run of 0.25 s, and a bar of 1e6 elements whose steps take us half a second, them one."""
    monkeypatch.setattr(figures, "panels", _unsaved)
    point = replace(_solid(0.25, 1e-3, "hcm"), study="tap")
    figures.work_precision(tmp_path / "w.png", [point])
    axis = plt.gcf().axes[0]
    assert axis.get_xlabel() == "time (ms)"
    assert axis.lines[0].get_xydata().tolist() == [[250.0, 1e-3]]
    assert axis.lines[-1].get_ydata()[0] == truths.TRUTHS["tap"].own_error
    figures.both_models(tmp_path / "b.png", [point], {"hcm": truths.TAP, **truths.REFERENCE_TRUTHS})
    axis = plt.gcf().axes[0]
    assert axis.get_xlabel() == "time of a run (s)"
    assert axis.lines[0].get_xydata().tolist() == [[0.25, 1e-3]]
    bar = Bar((100, 100, 100), 1, 1)
    rows = [
        BarRow(code, "1", "", "hexahedron", bar, BarRun(8, seconds, 1e-6, 1e-7, 1))
        for code, seconds in ((OWN, 0.5), ("theirs", 1.0))
    ]
    figures.bar_peers(tmp_path / "p.png", rows)
    ours, theirs = plt.gcf().axes[0].patches
    assert (ours.get_width(), theirs.get_width()) == (2.0, 1.0)
    assert theirs.get_facecolor() == to_rgba(GREY) != ours.get_facecolor()


def test_a_steps_time_is_in_us_and_the_larger_half_has_its_own_exponent(
    monkeypatch: Patch,
) -> None:
    """Steps of 2 ms n; then of n us up to 40 elements, the middle one, and of n^2/40 us beyond."""

    def timed(run: int, budget_s: float, least: int) -> Timed[Any]:
        ended = SimpleNamespace(statistics=SimpleNamespace(steps=100))
        return Timed(ended, 100 * 2e-3 * run, least)

    monkeypatch.setattr(hcm_speed, "simulation", lambda model, keys: keys)
    monkeypatch.setattr(hcm_speed, "_overrides", lambda what, size, quick: size)
    monkeypatch.setattr(hcm_speed, "shortest", timed)
    sizes = hcm_speed.measure_scaling(True, 0.0, lambda share, text: None)
    assert [size.step_time_us for size in sizes] == pytest.approx([2e3 * s.size for s in sizes])
    bent = [replace(s, step_time_us=max(s.size, s.size**2 / 40)) for s in sizes[:7]]
    for row in hcm_speed.table(bent):
        assert row["exponent_larger_half"] == pytest.approx(2.0)
        assert 1.0 < row["exponent"] < 2.0
