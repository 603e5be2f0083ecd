"""CalculiX beside the reference: its input, the table, and what is said without it."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.validation.commands import Capture, Patch
from tests.validation.peers.test_calculix import PRINTED
from validation.peers import calculix, calculix_impact
from validation.peers.calculix import COMPLETED, TIMED_OUT, CalculixRun
from validation.studies.stress.command import run_peers
from validation.studies.stress.hcm import hard_cells
from validation.studies.stress.reference.calculix_cells import (
    CELLS,
    IMPULSE,
    KINETIC,
    OPEN,
    PEAK,
    calculix_balance,
    calculix_deck,
    compare_cell,
    impulse_balance,
)

EASY = CELLS["soft pressure: the same problem"]


def test_without_it_the_table_is_skipped_by_name(
    tmp_path: Path, monkeypatch: Patch, capsys: Capture
) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    monkeypatch.setattr(hard_cells, "peers_table", lambda progress: [{"cell": "a hard one"}])
    run_peers(tmp_path)
    assert "CalculiX is not installed (apt-get install calculix-ccx)" in capsys.readouterr().out
    assert (tmp_path / "stress" / "peers.csv").exists()
    assert not (tmp_path / "stress" / "peers-reference.csv").exists()


def test_a_block_that_bounces_back_closes_its_momentum() -> None:
    _, model = EASY.simulate()
    model = replace(model, gravity_vector=(0.0, 0.0))
    back = np.zeros_like(model.points)
    back[:, 1] = 0.5 * EASY.speed
    given = 1.5 * float(model.mass.sum()) * model.symmetry_factor * EASY.speed
    found = impulse_balance(
        np.array([0.0, given, 0.0]), np.array([0.0, 1.0, 2.0]), back, EASY, model
    )
    assert found[OPEN] == pytest.approx(0.0, abs=1e-10)
    assert found[KINETIC] == pytest.approx(25.0)
    assert found[PEAK] == given


def test_an_unfinished_run_of_it_gives_no_impulse(monkeypatch: Patch) -> None:
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
    springs = model.contact.parts
    modulus = (springs.stiffness / springs.area).mean()
    assert f"PRESSURE-OVERCLOSURE=LINEAR\n{modulus:.9g}\n" in text
    nodes = text.split("*NODE,NSET=FLOOR")[0].splitlines()[1:]
    assert len(nodes) == len(model.points)
    lowest = min(float(line.split(",")[2]) for line in nodes)
    top = max(float(line.split(",")[2])
              for line in text.split("*NODE,NSET=FLOOR")[1].splitlines()[1:9])  # fmt: skip
    assert 0.0 < lowest - top < 1e-3 * 0.02 + EASY.speed * 1e-4
    facets = text.split("*SURFACE,NAME=OUTSIDE")[1].split("*SURFACE")[0].split()
    assert len(facets) == len(springs.facets)
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
    velocity = calculix_impact.last_velocities(ran.printed)
    assert velocity is not None
    assert len(velocity) == len(model.points)
    found = calculix_balance(EASY, ran, model)
    assert found is not None
    f = result.forces
    rows = f.time_s <= end
    assert found[OPEN] < 1.0  # the trapezoid over its automatic increments
    impulse = np.trapezoid(f.normal_force_N[rows], f.time_s[rows])
    # consistent against lumped masses: the pulse is not over, its front differs
    assert found[IMPULSE] == pytest.approx(impulse, rel=0.1)
