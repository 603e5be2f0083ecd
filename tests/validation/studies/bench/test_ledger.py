"""The skip ledger and the peers: what is compared with what, and what happens without a peer."""

from pathlib import Path

import numpy as np
import pytest

from tests.validation.commands import Patch, Run
from tests.validation.peers.test_bar import hide_peers
from validation.compare.tap_errors import TapErrors
from validation.harness.provenance import installed
from validation.harness.timing import shortest_in_turns
from validation.peers import exudyn_finger
from validation.peers.bar import Bar
from validation.studies.bench import (
    bar,
    exudyn_settings,
    hcm_settings,
    shortcuts,
    truths,
)
from validation.studies.bench.shortcuts import Entry, table
from validation.studies.bench.work_precision import Point

CHEAP = hcm_settings.hcm_setting(
    exudyn_settings.STUDY, "tolerances", 2, hcm_settings.BASE, {"flight_tolerance": 1e-5}
)


def test_runs_that_are_compared_take_turns() -> None:
    order: list[str] = []
    timed = shortest_in_turns([lambda: order.append("a"), lambda: order.append("b")], 0.0)
    assert "".join(order) == "ab" * 4
    assert [t.runs for t in timed] == [3, 3]


def test_smooth_surface_and_absent_torque_change_nothing() -> None:
    """mu = 1e-12 changes forces by about mu, a torque of 1e-300 N m not even a bit."""
    entries = {
        e.shortcut: e for e in (shortcuts.measure_shortcut(s, 0.0) for s in shortcuts.HCM[2:])
    }
    smooth, still = entries["no friction at mu = 0"], entries["no torque at zero drive"]
    assert smooth.changes.peak == pytest.approx(0, abs=1e-9)
    assert (still.changes.peak, still.changes.impulse, still.changes.duration) == (0, 0, 0)


def test_skipping_the_search_in_flight_changes_no_bit() -> None:
    entry = shortcuts.measure_contact_search("fem2d", 0.0)
    assert entry.changes == shortcuts.UNCHANGED
    assert entry.speedup > 0


# Reused factors stop at Newton's tolerance too; the error control takes its steps from them (to
# 1e-9 m). Half a body's stable step is 0.9 % shorter than the whole's, whose Lanczos vector starts
# elsewhere: a node comes or goes in another step, which is 1.3e-3 of the duration (measured: 1e-4
# to 2.7e-4), and the peak differs by what steps leave of it (3e-7 on one processor, 3e-5 on
# another).
@pytest.mark.parametrize(
    ("name", "largest", "peak"),
    [("factorization reuse", 1e-4, 1e-4), ("half model by symmetry", 1.3e-3, 1e-4)],
)
def test_shortcuts_change_results_by_less_than_steps_do(
    name: str, largest: float, peak: float
) -> None:
    switch = next(s for s in (*shortcuts.HCM, *shortcuts.SOLID) if s.name == name)
    entry = shortcuts.measure_shortcut(switch, 0.0)
    assert entry.changes.largest < largest
    assert entry.changes.peak == pytest.approx(0.0, abs=peak)


def test_stored_run_is_read_back_to_the_bit(monkeypatch: Patch) -> None:
    entry = shortcuts.measure_stored_run("hcm", 0.0)
    assert entry.changes == shortcuts.UNCHANGED
    assert entry.note.endswith("to the bit")
    monkeypatch.setattr(shortcuts, "load_run", lambda store, inputs: None)
    assert shortcuts.measure_stored_run("hcm", 0.0).changes is None


def test_ledger_has_a_line_for_what_cannot_be_compared() -> None:
    (row,) = table([Entry("half model", "fem3d", "symmetry = false", 1.0, 2.0, None, "structural")])
    assert (row["speedup"], row["peak_change"], row["note"]) == (2.0, None, "structural")


def _point(solver: str, time: float, error: float) -> Point:
    errors = TapErrors(error, 0.0, error, 0.0)
    return Point(exudyn_settings.STUDY, solver, "s", f"{time}", "COMPLETED", time, 3, 10, errors)


def test_cheapest_setting_that_reaches_an_error() -> None:
    tried = [("hcm", 0.004, 9e-4), ("hcm", 0.03, 9e-5), ("Exudyn", 0.03, 2e-3),
             ("Exudyn", 0.08, 8e-4)]  # fmt: skip
    failed = Point(exudyn_settings.STUDY, "Exudyn", "s", "failed", "stopped", 0.001, 0)
    points = [*(_point(*one) for one in tried), failed]
    rows = exudyn_settings.cheapest_table(points)
    assert rows[0]["exudyn_against"] == "hcm.reference_solution"
    found = {
        row["error_of_peak_and_duration"]: row for row in rows[: len(exudyn_settings.ERROR_LIMITS)]
    }
    assert found[1e-2]["exudyn_over_hcm"] == pytest.approx(7.5)
    assert found[1e-3]["exudyn_over_hcm"] == pytest.approx(20)
    assert found[1e-4]["exudyn_over_hcm"] is None  # the peer has no such setting
    assert found[1e-4]["exudyn_setting"] == "none of those tried"


def test_absent_peer_is_skipped_by_name(tmp_path: Path, monkeypatch: Patch, fingertap: Run) -> None:
    hide_peers(monkeypatch)
    monkeypatch.setattr(exudyn_settings, "hcm_settings", lambda quick: [CHEAP])
    monkeypatch.setattr(bar, "QUICK_BAR", Bar((4, 2, 2), 4, 1))
    ended = fingertap("bench", "--peers", "--quick", "--out", tmp_path)
    assert "skipped: Exudyn (pip install 'fingertap[bench]')" in ended.err
    assert "fingertap" in (tmp_path / "bench" / "peers-reference.csv").read_text()


@pytest.mark.skipif(not installed("exudyn"), reason="the extra bench is not installed")
def test_exudyn_agrees_and_locating_the_contact_pays() -> None:
    """Both codes see one tap: 0.1 % of the peak (measured 6e-4 at these steps); a contact that ends
    with a step is off by up to a step (3 us of 232 us)."""

    given = hcm_settings.soft_scene(truths.TAP_ELEMENTS)
    truth = truths.TAP.values
    until = truth.contact_time_s - exudyn_settings.LOOK_BEFORE_S
    located, unlocated = (
        exudyn_finger.tap(given, 5e-4, 3e-6, where, until).quantities for where in (True, False)
    )
    assert located.peak_normal_force_N == pytest.approx(truth.peak_normal_force_N, rel=1e-3)
    assert located.duration_s == pytest.approx(truth.duration_s, rel=1e-3)
    assert abs(unlocated.duration_s - truth.duration_s) > 3 * abs(
        located.duration_s - truth.duration_s
    )
    assert np.isfinite(unlocated.normal_impulse_N_s)


def test_what_switches_a_shortcut_off_is_what_only_one_run_has() -> None:
    for shortcut in (*shortcuts.HCM, *shortcuts.SOLID, *shortcuts.SOLID_FULL):
        keys = shortcut.switched_off_by
        assert keys, shortcut.name
        for key in keys:
            alone = shortcut.without_it if not key.startswith("no ") else shortcut.with_it
            other = shortcut.with_it if not key.startswith("no ") else shortcut.without_it
            assert key.removeprefix("no ") in alone
            assert key.removeprefix("no ") not in other
