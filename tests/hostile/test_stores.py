"""A store's forged entries: discarded in one line and computed again, or a run like any other."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.hostile.stores import NAMED, seal
from tests.validation.commands import fake_adapter
from validation.cli import main
from validation.harness.record import RunRecord
from validation.models.adapter import Outcome
from validation.runs import execute


@pytest.fixture
def whole(
    make_record: Callable[..., RunRecord], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> Path:
    """An output folder whose store holds a run."""
    time = np.linspace(0.136, 0.1362, 5)
    record = make_record(history={"time_s": time, "normal_force_N": np.ones(5)})

    def run(scene: Any, progress: Any, checkpoint: Any) -> Outcome:
        return Outcome(replace(record, scene=scene.name))

    monkeypatch.setattr(execute, "adapter", lambda name: fake_adapter(run))
    main(["run", "soft", "--model", "hcm", "--out", str(tmp_path / "out")])
    return tmp_path / "out"


def run_again(out: Path, capsys: pytest.CaptureFixture[str]) -> tuple[str, dict[str, Any]]:
    """What the command says, and the object that it prints."""
    capsys.readouterr()
    main(["run", "soft", "--model", "hcm", "--json", "--out", str(out)])
    captured = capsys.readouterr()
    said = captured.err
    assert all(line.startswith("fingertap: ") and line.isprintable() for line in said.splitlines())
    printed = json.loads(captured.out, parse_constant=lambda name: pytest.fail(name))
    return said, printed


def test_a_whole_entry_is_read_back(whole: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (entry,) = (whole / "store").iterdir()
    seal(entry)
    said, printed = run_again(whole, capsys)
    assert "has this run" in said
    assert printed["peak_normal_force_N"] == 64.0


@pytest.mark.parametrize("name", NAMED)
def test_what_is_no_run_is_discarded_in_one_line(
    name: str, whole: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (entry,) = (whole / "store").iterdir()
    NAMED[name](entry)
    seal(entry)
    said, printed = run_again(whole, capsys)
    (line,) = said.splitlines()
    assert "it is computed again" in line
    assert printed["peak_normal_force_N"] == 64.0
    assert "has this run" in run_again(whole, capsys)[0]
