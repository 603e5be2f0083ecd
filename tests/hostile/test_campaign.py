"""The campaign in small, and what its oracle would not let pass."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.hostile.campaign import SHARES, Counts, attempt, campaign, labels
from tests.hostile.laws import broken, printed
from tests.hostile.oracle import Said, faults
from validation.cli import main
from validation.scenes.load import load_scene

TRIES, SEED = 40, 13
# what starts processes is tested one by one, in test_endings and test_surroundings
CLASSES = tuple(SHARES)[:-3]
GOOD = Said(2, "", "fingertap: error: scene soft: surface.height = 2.0: must be a number\n")


def test_a_small_campaign(tmp_path: Path) -> None:
    every = labels(TRIES, SEED, CLASSES)
    assert every == labels(TRIES, SEED, CLASSES)
    counts: Counts = campaign(every, 2, tmp_path / "out")
    assert counts["all", "tried"] == len(every) >= TRIES
    assert all(counts[name, "tried"] for name in CLASSES)
    assert counts["all", "fell through"] == 0, (tmp_path / "out" / "tries.jsonl").read_text()


@pytest.mark.parametrize("label", ["values:1.9999", "texts:1.9999", "arguments:1.9999"])
def test_a_label_repeats_its_try(label: str, tmp_path: Path) -> None:
    assert attempt(label, tmp_path)["what"] == attempt(label, tmp_path)["what"]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "change",
    [{"code": 3}, {"code": None}, {"error": GOOD.error + "Traceback\n"}, {"error": GOOD.error * 2},
     {"error": GOOD.error.replace("soft", "so\x1bft")}, {"error": "numpy: overflow\n"},
     {"code": 0}, {"error": ""}, {"out": "{"}, {"error": "fingertap: error: no\n"},
     {"seconds": 1e3}, {"code": 1, "error": "fingertap: error: KeyError: 'a'\n"}],
)  # fmt: skip
def test_no_bad_answer_passes(change: dict[str, Any]) -> None:
    assert faults(GOOD, ["surface.height"]) == []
    assert faults(replace(GOOD, **change), ["surface.height"])


def test_no_broken_law_passes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A run's numbers, one wrong at a time."""
    import h5py

    main(["run", "hard", "--model", "hcm", "--json", "--out", str(tmp_path)])
    run, scene = printed(capsys.readouterr().out), load_scene("hard").tables
    history = tmp_path / "run" / "hard-hcm" / "history.nc"
    assert broken(run, scene, history) == []
    wrong: dict[str, Callable[[float], Any]] = {
        "peak_normal_force_N": lambda value: 1.01 * value,
        "normal_impulse_N_s": lambda value: 0.99 * value,
        "peak_tangential_force_N": lambda value: 1.01 * value,
        "contact_duration_s": lambda value: None,
        "peak_normal_force_time_s": lambda value: -value,
        "first_peak_normal_force_N": lambda value: 1.01 * value,
        "energy_residual": lambda value: 0.2,
        "error_estimates": lambda value: {"peak_normal_force_N": -1.0},
    }
    for key, change in wrong.items():
        assert broken(run | {key: change(run[key])}, scene, history), key
    for name, factor in (("normal_force_N", -1.0), ("kinetic_energy_J", 2.0), ("time_s", np.nan),
                         ("tip_velocity_m_per_s", -1.0), ("hinge_reactions_N", 30.0)):  # fmt: skip
        with h5py.File(history, "r+") as file:
            before = file[name][()]
            file[name][...] = factor * before
        assert broken(run, scene, history), name
        with h5py.File(history, "r+") as file:
            file[name][...] = before
    with pytest.raises(ValueError, match="NaN"):
        printed('{"peak_normal_force_N": NaN}')
