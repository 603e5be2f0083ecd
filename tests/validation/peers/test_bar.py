"""The bar that the reference shares with its peers: the wave itself, and who gets it right."""

import importlib.util
import math
import multiprocessing.spawn
import subprocess
from dataclasses import replace
from multiprocessing import resource_tracker

import numba
import pytest

from tests.validation.commands import Patch
from validation.peers import bar_programs, calculix_bar, own_bar
from validation.peers.bar import SPEED, STEP_S, WAVE_SPEED, YOUNG, Bar, BarRun, seconds_per_step
from validation.peers.bar_programs import PROGRAMS, BarProgram
from validation.studies.bench import bar as bench_bar
from validation.studies.bench.bar import BarRow, measure_program, table

BAR = Bar((20, 2, 2), 60, 1)
# A standing wave on n elements with lumped mass runs slow by (pi/n)^2/24 = 1.0e-3, shortened steps
# by less; after omega t = 3.8 rad of it the end is off by at most this share of the amplitude.
GRID_ERROR = 4.2e-3
AMPLITUDE = SPEED / (math.pi * WAVE_SPEED / BAR.length)


def test_exact_wave_starts_with_its_velocity_and_returns_after_a_period() -> None:
    points, _ = BAR.mesh()
    early = Bar((20, 2, 2), 1, 1)
    assert early.exact_end_m == pytest.approx(early.velocity(points)[0, 0] * early.time_s, rel=1e-2)
    period = 2 * BAR.length / WAVE_SPEED
    whole = Bar((20, 2, 2), round(period / STEP_S), 1)
    assert abs(whole.exact_end_m) < 0.01 * AMPLITUDE


@pytest.mark.parametrize("element", own_bar.POINTS)
def test_reference_carries_the_wave(element: str) -> None:
    ran = own_bar.run_bar(BAR, element)
    assert abs(ran.end_m - BAR.exact_end_m) < GRID_ERROR * AMPLITUDE
    assert ran.seconds_per_step > 0


@pytest.mark.parametrize("peer", [p for p in PROGRAMS if p.present], ids=lambda p: p.name)
def test_installed_peers_carry_the_same_wave(peer: BarProgram) -> None:
    row = measure_program(peer, BAR, peer.elements[0])
    assert row.status == "COMPLETED"
    assert abs(row.ran.end_m - BAR.exact_end_m) < GRID_ERROR * AMPLITUDE


def test_deck_names_every_node_and_the_material() -> None:
    deck = calculix_bar.deck(BAR, "C3D8R", 7)
    points, cells = BAR.mesh()
    assert f"\n{len(points)}," in deck
    assert f"\n{len(cells)},{','.join(str(n + 1) for n in cells[-1])}\n" in deck
    assert f"{YOUNG},0." in deck
    assert f"{7 * STEP_S:.12g}" in deck


def hide_peers(monkeypatch: Patch) -> None:
    """As if none were installed."""
    real = importlib.util.find_spec
    peers_only = ("exudyn", "akantu", "KratosMultiphysics")
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *more: None if name in peers_only else real(name)
    )
    monkeypatch.setenv("PATH", "")


def test_absent_peers_are_named_and_broken_ones_are_rows(monkeypatch: Patch) -> None:
    hide_peers(monkeypatch)
    assert bar_programs.absent() == [
        "CalculiX (apt-get install calculix-ccx)",
        "Akantu (pip install 'fingertap[bench]')",
        "Kratos (pip install 'fingertap[bench]')",
    ]

    def late(bar: Bar, element: str) -> BarRun:
        raise subprocess.TimeoutExpired("ccx", 1.0)

    row = measure_program(replace(PROGRAMS[1], run_bar=late), BAR, "hexahedron_8")
    assert row.ran is None
    assert row.status.startswith("stopped after")


def test_a_program_that_dies_is_a_row(monkeypatch: Patch) -> None:
    resource_tracker.ensure_running()  # or it would be this /bin/false too, for all later tests
    monkeypatch.setattr(multiprocessing.spawn, "_python_exe", b"/bin/false")
    row = measure_program(PROGRAMS[1], BAR, "hexahedron_8")
    assert row.status == "failed: no answer: its process ended abruptly (exit code 1)"


def test_ratios_are_taken_of_the_same_number_of_points_and_threads() -> None:
    def row(code: str, points: int, seconds: float, threads: int = 1) -> BarRow:
        ran = BarRun(points, seconds, BAR.exact_end_m, STEP_S, 1)
        return BarRow(code, "1", "", "e", replace(BAR, threads=threads), ran)

    rows = [row("fingertap", 8, 2.0), row("fingertap", 1, 1.0), row("CalculiX", 1, 30.0)]
    rows += [row("fingertap", 8, 1.1, 2), row("Kratos", 8, 22.0, 2)]
    found = table([*rows, BarRow("Kratos", "1", "", "e", BAR, None, "failed: x")])
    assert found[2]["hex8_sri_over_it"] == pytest.approx(15)
    assert found[2]["same_points_over_it"] == pytest.approx(30)
    assert found[4]["hex8_sri_over_it"] == found[4]["same_points_over_it"] == pytest.approx(20)
    assert "off_exact" not in found[5]


def test_a_program_of_one_thread_is_compared_with_ours_on_one(monkeypatch: Patch) -> None:
    def timed(bar: Bar, element: str) -> BarRun:
        return BarRun(8, 1.0 / bar.threads, 1e-6, STEP_S, 3)

    monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", 2)
    monkeypatch.setattr(own_bar, "run_bar", timed)
    programs = [
        replace(p, module="numpy", elements=("e",), run_bar=timed, most_threads=most)
        for p, most in zip(PROGRAMS[1:], (1, 8), strict=True)
    ]
    monkeypatch.setattr(bench_bar, "PROGRAMS", programs)
    rows = bench_bar.measure_bar(replace(BAR, threads=2), lambda *_: None)
    assert [row.bar.threads for row in rows] == [2, 2, 1, 1, 1, 2]
    assert [line["hex8_sri_over_it"] for line in table(rows)[4:]] == [1.0, 1.0]


def test_steps_of_a_part_are_all_taken() -> None:
    taken: list[int] = []
    assert seconds_per_step(lambda: taken.append(1), 11) >= 0.0
    assert len(taken) == 11
