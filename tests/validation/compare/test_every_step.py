"""The compared curve is the computed one: every step's force, not the history's samples."""

from pathlib import Path

import numpy as np
import pytest
import xarray

from tests.validation.commands import Make
from validation.compare.force_curves import contact_curve
from validation.compare.iso18571 import rate_forces
from validation.compare.sprague_geers import compare_forces
from validation.harness.record import RunRecord
from validation.harness.run_files import write_run
from validation.harness.store import Store
from validation.harness.stored_run import keep_run, load_run
from validation.models import solid
from validation.runs.execute import solve
from validation.scenes.load import load_scene


@pytest.fixture(scope="module")
def solid_run() -> RunRecord:
    return solve(
        load_scene("soft", (*solid.WARM_UP, "solver.fem.tip_size=1e-3")), "fem2d", None
    ).record


def test_a_solid_run_gives_the_force_of_every_step(solid_run: RunRecord) -> None:
    forces = solid_run.contact_forces
    time = forces["time_s"]
    assert time.size > 1.5 * solid_run.history["time_s"].size
    assert forces["normal_force_N"].max() == solid_run.summary["peak_normal_force_N"]
    assert np.trapezoid(forces["normal_force_N"], time) == pytest.approx(
        solid_run.summary["normal_impulse_N_s"], rel=1e-12
    )
    contact = solid_run.value("contact_time_s")
    curve = contact_curve(solid_run, "normal_force_N", time - contact)
    np.testing.assert_array_equal(curve, forces["normal_force_N"])


def test_files_and_store_keep_the_force_of_every_step(solid_run: RunRecord, tmp_path: Path) -> None:
    write_run(tmp_path / "run", solid_run)
    with xarray.open_dataset(tmp_path / "run" / "history.nc", engine="h5netcdf") as data:
        for name, array in solid_run.forces.items():
            assert data[f"step_{name}"].dims == ("step",)
            np.testing.assert_array_equal(data[f"step_{name}"].values, array)
        assert data.step_normal_force_N.attrs["units"] == "N"
        assert data.step_time_s.attrs["units"] == "s"
        assert "step_time_s" in data.step_normal_force_N.coords
        assert data.normal_force_N.dims == ("time",)
    store = Store(tmp_path / "store")
    keep_run(store, {"a": 1}, solid_run)
    found = load_run(store, {"a": 1})
    assert list(found.forces) == list(solid_run.forces)
    for name, array in solid_run.forces.items():
        assert found.forces[name].tobytes() == array.tobytes()


def test_metrics_see_what_lies_between_two_samples(make_record: Make) -> None:
    """A force that doubles between two of the history's samples."""
    run = make_record()
    time, normal = run.history["time_s"], run.history["normal_force_N"]
    forces = {name: run.history[name] for name in ("time_s", "normal_force_N")}
    raised = np.where(np.arange(time.size) % 100 == 0, 1.0, 2.0) * normal
    history = {name: array[::100] for name, array in run.history.items()}
    computed = make_record(history=history, forces={**forces, "normal_force_N": raised})
    reference = make_record(history=history, forces=forces)
    found = compare_forces(computed, reference)
    assert found.magnitude == pytest.approx(1.0, abs=0.02)
    rating = rate_forces(computed, reference)
    assert rating.magnitude == 0.0
