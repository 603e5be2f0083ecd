"""Other solvers on the reduced model's hard cells."""

import os
import re
import time

import pytest

import hcm
from tests.validation.commands import Patch
from validation.harness.provenance import installed
from validation.studies.stress.hcm import hard_cells


def _slow(*arguments: object) -> hard_cells.PeerAnswer:
    time.sleep(120.0)
    return "completed", None, 120.0


def _killed(*arguments: object) -> hard_cells.PeerAnswer:
    os._exit(3)


def test_a_peer_that_gives_no_answer_is_ended(monkeypatch: Patch) -> None:
    """Or that takes its process with it: other cells keep their answers."""
    scene = hard_cells.hard_cells()["softest tip, k 1e3 N/m"]
    tap = hcm.simulate_scene(scene)
    monkeypatch.setattr(hard_cells, "SECONDS", 3.0)
    for solve, said in ((_slow, "it did not end within 3 s"), (_killed, "exit code 3")):
        monkeypatch.setattr(hard_cells, "_exudyn", solve)
        assert said in hard_cells._exudyn_cell(scene, tap, None)


def _percent_off(cell: str) -> float:
    found = re.fullmatch(r"completed, off by (\S+) % \(.* s\)", cell)
    assert found is not None, cell
    return float(found[1])


def test_scipy_answers_a_hard_cell(monkeypatch: Patch) -> None:
    """It was handed what it does not take. Its defaults ask for 1e-3 of each of many steps."""
    name = "softest beams, E 1e6 Pa"
    scene = hard_cells.hard_cells()[name]
    monkeypatch.setattr(hard_cells, "hard_cells", lambda: {name: scene})
    (row,) = hard_cells.peers_table(lambda fraction, doing: None)
    assert row["cell"] == name
    assert _percent_off(row["hcm"]) < 0.1  # measured 2.6e-4
    assert _percent_off(row["SciPy RK45, defaults"]) < 5.0


@pytest.mark.skipif(not installed("exudyn"), reason="the extra bench is not installed")
def test_exudyn_answers_a_hard_cell() -> None:
    """One linear spring, which both see: measured 1e-5."""
    scene = hard_cells.hard_cells()["softest tip, k 1e3 N/m"]
    result = hcm.simulate_scene(scene)
    cell = hard_cells._exudyn_cell(scene, result, hard_cells.peak_and_impulse(result))
    assert _percent_off(cell) < 0.1
