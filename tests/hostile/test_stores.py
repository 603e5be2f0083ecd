"""A store's forged entries: discarded in one line and computed again, or a run like any other."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.hostile.stores import NAMED, seal
from tests.validation.commands import Make, Run, Use


@pytest.fixture
def whole(make_record: Make, fake_model: Use, tmp_path: Path, fingertap: Run) -> Path:
    """An output folder whose store holds a run."""
    time = np.linspace(0.136, 0.1362, 5)
    fake_model(make_record(history={"time_s": time, "normal_force_N": np.ones(5)}))
    assert fingertap("run", "soft", "--model", "hcm", "--out", tmp_path / "out").code == 0
    return tmp_path / "out"


def run_again(out: Path, fingertap: Run) -> tuple[str, dict[str, Any]]:
    """What the command says, and the object that it prints."""
    ended = fingertap("run", "soft", "--model", "hcm", "--json", "--out", out)
    assert all(
        line.startswith("fingertap: ") and line.isprintable() for line in ended.err.splitlines()
    )
    return ended.err, json.loads(ended.out, parse_constant=lambda name: pytest.fail(name))


def test_a_whole_entry_is_read_back(whole: Path, fingertap: Run) -> None:
    (entry,) = (whole / "store").iterdir()
    seal(entry)
    said, printed = run_again(whole, fingertap)
    assert "has this run" in said
    assert printed["peak_normal_force_N"] == 64.0


@pytest.mark.parametrize("name", NAMED)
def test_what_is_no_run_is_discarded_in_one_line(name: str, whole: Path, fingertap: Run) -> None:
    (entry,) = (whole / "store").iterdir()
    NAMED[name](entry)
    seal(entry)
    said, printed = run_again(whole, fingertap)
    (line,) = said.splitlines()
    assert "it is computed again" in line
    assert printed["peak_normal_force_N"] == 64.0
    assert "has this run" in run_again(whole, fingertap)[0]
