"""CalculiX beside the reference: its input, what it prints, and what a table says without it."""

from __future__ import annotations

import shutil
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from validation.peers import calculix, calculix_block
from validation.peers.calculix import COMPLETED, NOT_CONVERGED, TIMED_OUT, CalculixRun
from validation.studies.stress.command import run_peers
from validation.studies.stress.hcm import peers
from validation.studies.stress.reference.peers import (
    CELLS,
    calculix_balance,
    calculix_deck,
    compare_cell,
    impulse_balance,
)

# As version 2.20 prints two increments of a block of two nodes.
PRINTED = """
 total force (fx,fy,fz) for set FLOOR and time  0.1000000E-04

       -1.000000E+00  0.000000E+00  0.000000E+00

 velocities (vx,vy,vz) for set BODY and time  0.1000000E-04

         1  5.000000E-01 -1.000000E+00  0.000000E+00
         2  5.000000E-01 -1.000000E+00  0.000000E+00

 total force (fx,fy,fz) for set FLOOR and time  0.3000000E-04

       -1.000000E+00  1.622533E+00  3.950000E-18

 velocities (vx,vy,vz) for set BODY and time  0.3000000E-04

         1  5.000000E-01  1.250000E+00  0.000000E+00
         2  5.000000E-01 -1.250000E-03  0.000000E+00
"""
EASY = CELLS["soft pressure: the same problem"]


def test_what_it_prints_is_read() -> None:
    times, forces = calculix_block.floor_forces(PRINTED)
    assert times.tolist() == [1e-5, 3e-5]
    assert forces.tolist() == [0.0, 1.622533]
    velocity = calculix_block.last_velocities(PRINTED)
    assert velocity is not None
    assert velocity.tolist() == [[0.5, 1.25, 0.0], [0.5, -0.00125, 0.0]]


def test_nothing_printed_is_no_force() -> None:
    times, forces = calculix_block.floor_forces("")
    assert times.size == forces.size == 0
    assert calculix_block.last_velocities("") is None


@pytest.mark.parametrize(
    ("code", "said", "answer"),
    [
        (0, " Job finished\n", COMPLETED),
        (None, "", TIMED_OUT),
        (201, " *ERROR: too many cutbacks\n best solution and residuals", NOT_CONVERGED),
        (0, "no convergence", NOT_CONVERGED),
        (201, "x\n *ERROR in e_c3d: nonpositive jacobian\n", "stopped: *ERROR in e_c3d: nonpositive"
         " jacobian"),
        (-11, "", "stopped: exit code -11"),
    ],
)  # fmt: skip
def test_how_it_ended(code: int | None, said: str, answer: str) -> None:
    assert calculix.answer(code, said) == answer


def program(folder: Path, body: str) -> None:
    """A stand-in for ccx."""
    path = folder / calculix.PROGRAM
    path.write_text(f"#!/bin/sh\n{body}\n", encoding="ascii")
    path.chmod(0o755)


def test_a_run_that_takes_too_long_is_killed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "printed").write_text(PRINTED, encoding="ascii")
    program(tmp_path, f"/bin/cp {tmp_path}/printed job.dat\nexec /bin/sleep 60")
    monkeypatch.setenv("PATH", str(tmp_path))
    ran = calculix.run_calculix("", timeout_s=0.5)
    assert (ran.answer, calculix_block.floor_forces(ran.printed)[0].size) == (TIMED_OUT, 2)


def test_without_it_the_table_is_skipped_by_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    monkeypatch.setattr(peers, "peers_table", lambda progress: [{"cell": "a hard one"}])
    run_peers(tmp_path)
    assert "CalculiX is not installed (apt-get install calculix-ccx)" in capsys.readouterr().out
    assert (tmp_path / "stress" / "peers.json").exists()
    assert not (tmp_path / "stress" / "peers-reference.json").exists()


def test_a_block_that_bounces_back_closes_its_momentum() -> None:
    _, model = EASY.simulate()
    model = replace(model, gravity=0.0)
    back = np.zeros_like(model.points)
    back[:, 1] = 0.5 * EASY.speed
    given = 1.5 * float(model.mass.sum()) * model.copies * EASY.speed
    found = impulse_balance(
        np.array([0.0, given, 0.0]), np.array([0.0, 1.0, 2.0]), back, EASY, model
    )
    assert found.open_share == pytest.approx(0.0, abs=1e-12)
    assert found.kinetic_share == pytest.approx(0.25)
    assert found.peak_normal_force_N == given


def test_an_unfinished_run_of_it_gives_no_impulse(monkeypatch: pytest.MonkeyPatch) -> None:
    late = CalculixRun(TIMED_OUT, "", PRINTED, 40.0)
    monkeypatch.setattr(calculix, "run_calculix", lambda deck, timeout_s: late)
    told = compare_cell("easy", EASY)
    assert told["CalculiX: answer"] == TIMED_OUT
    assert told["CalculiX: impulse (N s)"] == told["CalculiX: peak (N)"] == ""
    assert told["ours: impulse (N s)"] != ""


def test_the_input_is_the_same_block() -> None:
    result, model = EASY.simulate()
    text = calculix_deck(EASY, model, result.snapshots[0].displacement, 1e-3)
    assert model.contact is not None
    assert f"PRESSURE-OVERCLOSURE=LINEAR\n{model.contact.modulus:.9g}\n" in text  # type: ignore[attr-defined]
    nodes = text.split("*NODE,NSET=FLOOR")[0].splitlines()[1:]
    assert len(nodes) == len(model.points)
    lowest = min(float(line.split(",")[2]) for line in nodes)
    top = max(float(line.split(",")[2])
              for line in text.split("*NODE,NSET=FLOOR")[1].splitlines()[1:9])  # fmt: skip
    assert 0.0 < lowest - top < 1e-3 * 0.02 + EASY.speed * 1e-4
    facets = text.split("*SURFACE,NAME=OUTSIDE")[1].split("*SURFACE")[0].split()
    assert len(facets) == len(model.contact.quadrature.facets)  # type: ignore[attr-defined]
    other = replace(EASY, contact="impulse")
    unlike = other.simulate()[1]
    with pytest.raises(ValueError, match="only 'surface'"):
        calculix_deck(other, unlike, result.snapshots[0].displacement, 1e-3)


@pytest.mark.skipif(not calculix.available(), reason="CalculiX is not installed")
def test_a_short_fall_of_it_meets_ours() -> None:
    result, model = EASY.simulate()
    end = 2e-4
    deck = calculix_deck(EASY, model, result.snapshots[0].displacement, end)
    ran = calculix.run_calculix(deck, 30.0)
    assert ran.answer == COMPLETED
    velocity = calculix_block.last_velocities(ran.printed)
    assert velocity is not None
    assert len(velocity) == len(model.points)
    found = calculix_balance(EASY, ran, model)
    assert found is not None
    f = result.forces
    rows = f.time_s <= end
    assert found.open_share < 0.01  # the trapezoid over its automatic increments
    impulse = np.trapezoid(f.normal_force_N[rows], f.time_s[rows])
    # consistent against lumped masses: the pulse is not over, its front differs
    assert found.normal_impulse_N_s == pytest.approx(impulse, rel=0.1)


def _slow(seconds: float) -> peers.PeerAnswer:
    time.sleep(seconds)
    return "completed", None, seconds


def test_a_peer_that_gives_no_answer_is_ended() -> None:
    began = time.monotonic()
    assert peers.limited(60.0, _slow, 0.01) == ("completed", None, 0.01)
    assert peers.limited(3.0, _slow, 120.0) == ("no answer after 3 s", None, 3.0)
    assert time.monotonic() - began < 60.0
