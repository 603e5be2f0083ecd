import json
import os
import signal
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import meshio
import numpy as np
import pytest
import xarray

from reference_fem import Snapshot
from tests.validation.commands import Make, Patch
from validation.harness.files import atomic, safe_name, write_json
from validation.harness.processes import CrashedError, call_isolated, peak_memory_MB
from validation.harness.quantities import unit_of
from validation.harness.record import RunRecord, plain
from validation.harness.run_files import Fields, write_fields, write_run
from validation.harness.store import NO_STORE, key
from validation.models.adapter import Outcome
from validation.runs import execute
from validation.runs.execute import Job, in_fresh_process, keep


def test_history_round_trip_keeps_values_units_and_origin(
    make_record: Make, tmp_path: Path
) -> None:
    run = make_record()
    write_run(tmp_path, run)
    with xarray.open_dataset(tmp_path / "history.nc", engine="h5netcdf") as data:
        for name, array in run.history.items():
            np.testing.assert_array_equal(data[name].values, array)
        assert data.normal_force_N.dims == ("time",)
        assert data.tip_position_m.dims[0] == "time"
        named = {"normal_force_N": "N", "tip_position_m": "m", "time_s": "s"}
        assert {name: data[name].attrs["units"] for name in named} == named
        assert data.attrs["status"] == "COMPLETED"
        origin = json.loads(data.attrs["provenance_json"])
        assert json.loads(data.attrs["summary_json"]) == plain(run.to_json())
        assert (data.peak_normal_force_N, data.peak_normal_force_N.attrs["units"]) == (64, "N")
        assert data.identical(run.to_dataset())
    assert "youngs_modulus = 1000000000.0" in origin["scene_toml"]
    assert set(origin["versions"]) >= {"fingertap", "numpy", "numba"}
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["peak_normal_force_N"] == 64
    assert summary["events"][0] == [0.136, "contact"]


def test_a_run_without_history_is_kept(make_record: Make, tmp_path: Path) -> None:
    write_run(tmp_path / "new", make_record(history={}, ok=False, status="FAILED"))
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["summary.json"]


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("tip_velocity_m_per_s", "m/s"),
        ("normal_impulse_N_s", "N s"),
        ("contact_area_m2", "m2"),
        ("stress_R_Pa", "Pa"),
        ("drive_work_J", "J"),
        ("mode", "1"),
    ],
)
def test_units_come_from_names(name: str, unit: str) -> None:
    assert unit_of(name) == unit


def test_a_failed_write_leaves_the_old_file_and_no_other(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")

    def write(divisor: int) -> None:
        with atomic(path) as temporary:
            temporary.write_text("new")
            assert path.read_text() == "old"
            assert 1 // divisor

    with pytest.raises(ZeroDivisionError):
        write(0)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
    write(1)
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


def test_json_has_no_nan(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    write_json(path, {"a": float("nan"), "b": [np.float64(1), np.int64(2), np.bool_(True)]})
    assert json.loads(path.read_text()) == {"a": None, "b": [1.0, 2, True]}


@pytest.mark.parametrize("name", ["../x", "..", "a/b", "", "~", "x\n"])
def test_safe_names_stay_inside(name: str, tmp_path: Path) -> None:
    path = (tmp_path / safe_name(name)).resolve()
    assert path.parent == tmp_path.resolve()


def test_names_that_can_not_be_kept_stay_different() -> None:
    """Two plans, ä and ö, had one folder."""
    names = ("ä", "ö", "_", "a b", "a_b", "a/b", "run", "", ".", "/")
    assert len({safe_name(name) for name in names}) == len(names)
    assert [safe_name(name) for name in ("soft-hcm", "a=0.1")] == ["soft-hcm", "a=0.1"]


def test_long_names_are_cut_and_stay_different(tmp_path: Path) -> None:
    """As of a comparison that sets a table of torques."""
    one, two = (safe_name("drive.torques=" + "0.01, " * 100 + end) for end in "12")
    assert one != two
    write_json(tmp_path / f"{one}.json", {})


def test_peak_memory_is_the_process_own() -> None:
    before = peak_memory_MB()
    block = np.ones(30_000_000)  # 240 MB
    assert 200 < peak_memory_MB() - before + 1e-9 * block[0] < 300 or before > 600


def test_fields_open_in_meshio(tmp_path: Path) -> None:
    points = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
    cells = np.array([[0, 1, 3, 2, 4, 5, 7, 6]])
    steps = tuple(
        Snapshot(0.1 * n, n * points, points, np.array([1e6 * n]), np.full(8, 1e5 * n))
        for n in range(2)
    )
    path = write_fields(tmp_path, Fields(points, cells, steps))
    entries = list(ElementTree.parse(path).getroot().iter("DataSet"))
    assert [float(entry.attrib["timestep"]) for entry in entries] == [0, 0.1]
    mesh = meshio.read(tmp_path / entries[1].attrib["file"])
    np.testing.assert_allclose(mesh.point_data["displacement"], points)
    np.testing.assert_allclose(mesh.cell_data["von_mises_Pa"][0], [1e6])


def test_a_runs_files_are_those_of_no_earlier_run(make_record: Make, tmp_path: Path) -> None:
    """Fields of an earlier run with more steps stood beside the later one's."""
    names = ("tap_000.vtu", "tap_011.vtu", "tap.pvd")
    (tmp_path / "fields").mkdir()
    for path in (*(tmp_path / "fields" / name for name in names), tmp_path / "error.txt"):
        path.touch()
    keep(tmp_path, Outcome(make_record()))
    assert not list((tmp_path / "fields").iterdir())
    assert not (tmp_path / "error.txt").exists()


def test_bad_jobs_do_not_harm_the_others(tmp_path: Path) -> None:
    jobs = [
        Job("soft", "hcm", ("surface.friction=-1",), "bad"),
        Job("soft", "hcm", ("surface.height=9",), "unreachable"),
    ]
    records = in_fresh_process(jobs, tmp_path)
    assert [run.status for run in records] == ["FAILED", "FAILED"]
    assert "surface.friction" in records[0].message
    assert "surface.height" in records[1].message


def test_a_refused_job_leaves_no_earlier_run(tmp_path: Path, make_record: Make) -> None:
    job = Job("soft", "hcm", ("surface.height=0.001",))  # cuts the finger
    task = execute.Task(job, tmp_path)
    keep(tmp_path, Outcome(make_record(history={"time_s": np.arange(3.0)})))
    (record,) = execute._work([task])
    assert record.status == "FAILED"
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


def test_a_crashing_process_is_a_failure_of_its_job(tmp_path: Path, monkeypatch: Patch) -> None:
    monkeypatch.setattr(execute, "_work", _die_on_one)
    jobs = [Job("soft", "hcm", (), name) for name in ("good", "crash", "fine")]
    records = in_fresh_process(jobs, tmp_path)
    assert [run.status for run in records] == ["FAKED", "CRASHED", "FAKED"]
    assert records[1].message == "its process ended abruptly (signal 9)"


def _die_on_one(tasks: list[execute.Task]) -> list[RunRecord]:
    if any(task.job.variant == "crash" for task in tasks):
        os.kill(os.getpid(), signal.SIGKILL)
    return [execute.failed(task.job, "FAKED", "") for task in tasks]


def test_an_exception_in_a_process_is_a_crash() -> None:
    with pytest.raises(CrashedError, match="exit code 1"):
        call_isolated(int, "no number")
    assert call_isolated(int, "7") == 7


def test_a_memory_of_its_own_is_not_that_of_a_shared_process(tmp_path: Path) -> None:
    """The peak of a process that has run other jobs was given for the job's own."""
    job = Job("soft", "hcm")
    own, shared = (execute._task(job, tmp_path, NO_STORE, first).inputs for first in (True, False))
    assert own is not None
    assert shared is not None
    assert key(own) != key(shared)
