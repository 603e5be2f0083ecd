"""Batches: the bits of single runs, whatever becomes of the scenes beside them."""

import itertools
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from contextlib import nullcontext
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray
from threadpoolctl import threadpool_limits

import hcm
from hcm import batch, loop, stepping
from tests.hcm.cases import SOFT, SOFT_TIP

ROOT = Path(__file__).parents[2]
CHEAP = hcm.Settings(estimate=False, contact_step=1e-5, contact_tolerance=1e-9)
SCENE = hcm.Scene(
    hcm.Finger((replace(SOFT, elements=2),)), hcm.Surface(0.03, 0.5), SOFT_TIP, settings=CHEAP
)
HEIGHTS = [0.024, 0.026, 0.028, 0.03, 0.032]


def scenes() -> list[hcm.Scene]:
    """Of one and of two phalanges, falling as beams and as rods, with estimates and without."""
    falls = [replace(SCENE, surface=hcm.Surface(height, 0.3)) for height in HEIGHTS]
    rods = replace(CHEAP, flight="rigid")
    two = hcm.Finger(SCENE.finger.phalanges * 2)
    rigid = [
        replace(SCENE, settings=rods, finger=two, surface=hcm.Surface(2 * height, 0.3))
        for height in HEIGHTS
    ]
    told = [replace(falls[0], settings=replace(CHEAP, estimate=True))]
    return [*falls, *rigid, *told]


def test_each_scene_has_the_bits_of_its_own_run() -> None:
    many = list(hcm.simulate_each(scenes(), workers=3))
    for scene, outcome in zip(scenes(), many, strict=True):
        alone = hcm.simulate_scene(scene)
        assert outcome.status == alone.status.name
        assert outcome.summary == alone.summary
        assert outcome.errors == alone.errors
        assert outcome.steps == alone.statistics.steps
    assert many[-1].errors
    assert len({outcome.summary for outcome in many}) == len(many) - 1


def test_scenes_have_the_bits_of_one_thread_of_linear_algebra() -> None:
    """Eigenproblems of a modal flight have other last bits on two threads (and take longer)."""
    modal = replace(CHEAP, flight="modal", flight_integrator="gauss", flight_step=1e-3)
    body = hcm.Finger((hcm.Phalanx(0.039, 0.007, 2e8, 2000.0), replace(SOFT, length=0.024)))
    fall = hcm.Scene(body, hcm.Surface(0.05, 0.5), SOFT_TIP, settings=modal)
    falls = [replace(fall, surface=hcm.Surface(height, 0.5)) for height in (0.04, 0.045, 0.05)]
    with threadpool_limits(1, user_api="blas"):
        alone = [hcm.simulate_scene(scene).summary for scene in falls]
    with threadpool_limits(2, user_api="blas"):
        many = [outcome.summary for outcome in hcm.simulate_each(falls, workers=2)]
    assert many == alone


def test_a_datasets_numbers_are_its_own() -> None:
    """Other units in the dataset change nothing in the run."""
    run = hcm.simulate_scene(SCENE)
    largest = run.history.normal_force_N.max()
    data = run.to_dataset()
    data["normal_force_N"] /= 1000.0
    assert run.history.normal_force_N.max() == largest > 0.0
    assert float(run.to_dataset()["normal_force_N"].max()) == largest


def test_a_run_as_a_dataset_comes_back_from_a_file_with_units_and_origin(tmp_path: Path) -> None:
    run = hcm.simulate_scene(replace(SCENE, settings=replace(CHEAP, estimate=True)))
    run.to_dataset().to_netcdf(tmp_path / "run.nc", engine="h5netcdf")
    with xarray.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as data:
        for name, array in vars(run.history).items():
            np.testing.assert_array_equal(data[name], array)
        for name, value in asdict(run.summary).items():
            np.testing.assert_array_equal(data[name], np.nan if value is None else value)
        for name, error in run.errors.items():
            np.testing.assert_array_equal(data[f"{name}_error"], error)
            assert data[f"{name}_error"].attrs["units"] == data[name].attrs["units"]
        assert list(data.event_kind.values) == [event.kind for event in run.events]
        assert list(data.event_time_s.values) == [event.time_s for event in run.events]
        assert data.normal_force_N.time_s.attrs["units"] == "s"
        units = {"normal_impulse_N_s": "N s", "tip_velocity_m_per_s": "m/s", "mode": "1"}
        assert {name: data[name].attrs["units"] for name in units} == units
        given = json.loads(data.attrs["given_json"])
        assert given["finger"]["phalanges"][0] == asdict(SCENE.finger.phalanges[0])
        assert given["settings"]["contact_step"] == CHEAP.contact_step
        assert given["start"] is None
        assert json.loads(data.attrs["versions_json"])["numpy"] == np.__version__
        assert data.attrs["status"] == "COMPLETED"


def test_an_accuracy_chooses_each_scenes_settings() -> None:
    given = scenes()[:2]
    many = list(hcm.simulate_each(given, workers=2, accuracy=1e-2))
    for scene, outcome in zip(given, many, strict=True):
        assert outcome.summary == hcm.simulate_within(1e-2, scene).summary
        assert outcome.summary != hcm.simulate_scene(scene).summary
    with pytest.raises(hcm.ParameterError, match="accuracy = 2"):
        hcm.simulate_each(given, accuracy=2.0)  # at the call, not at the first outcome
    with pytest.raises(hcm.ParameterError, match="accuracy = 'none'"):
        hcm.simulate_many(given, accuracy="none")  # type: ignore[arg-type]


def test_a_scene_that_fails_costs_the_others_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    own = batch.simulate_scene

    def broken(scene: hcm.Scene, progress: Any) -> hcm.TapResult:
        if scene.surface.height in (HEIGHTS[1], 2 * HEIGHTS[1]):
            raise ZeroDivisionError("of this scene")
        return own(scene, progress)

    monkeypatch.setattr(batch, "simulate_scene", broken)
    short = replace(CHEAP, max_flight_time=1e-3)
    given = scenes()
    given[2] = replace(given[2], settings=short)
    given[3] = replace(given[3], surface=hcm.Surface(1e-3, 0.3))  # cuts the finger
    table = hcm.simulate_many(given, workers=2)
    assert table["status"].values.tolist() == [
        "COMPLETED", "FAILED", "NOT_REACHED", "REFUSED", "COMPLETED", "COMPLETED", "FAILED",
        *["COMPLETED"] * 4,
    ]  # fmt: skip
    assert table["message"].values[1] == "ZeroDivisionError: of this scene"
    assert "the surface cuts" in table["message"].values[3]
    peaks = table["peak_normal_force_N"].values
    assert np.isnan(peaks[[1, 2, 3, 6]]).all()
    assert peaks[4] == own(given[4]).summary.peak_normal_force_N
    for name in ("steps", "wall_time_s"):
        assert np.isnan(table[name].values[[1, 3, 6]]).all()
        assert (table[name].values[[0, 2]] > 0).all()


def test_an_interrupt_of_the_first_scene_is_the_callers(monkeypatch: pytest.MonkeyPatch) -> None:
    """It was one scene's status, and the others were solved."""

    def interrupted(fraction: float, doing: str) -> None:
        del fraction, doing
        raise KeyboardInterrupt

    monkeypatch.setattr(batch, "_watch", interrupted)
    with pytest.raises(KeyboardInterrupt):
        next(hcm.simulate_each(scenes()))


def test_a_masked_value_is_none() -> None:
    """Not the number that the mask hides."""
    column = np.ma.masked_array([0.1, 0.2], mask=[False, True])
    first, second = hcm.simulate_each(hcm.vary(SCENE, {"surface.friction": column}))
    assert [first.status, second.status] == ["COMPLETED", "REFUSED"]


@pytest.mark.parametrize("kills", [1, 100])
def test_a_killed_process_costs_the_other_scenes_nothing(
    kills: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All outcomes of the call were lost, and no scene was named."""
    own, left = batch.simulate_scene, multiprocessing.get_context("fork").Value("l", kills)
    given = [replace(SCENE, surface=hcm.Surface(height, 0.5)) for height in HEIGHTS] * 4
    deadly = given[9] = replace(SCENE, surface=hcm.Surface(0.021, 0.5))

    def killed(scene: hcm.Scene, progress: Any) -> hcm.TapResult:
        with left.get_lock():
            left.value -= int(dies := scene == deadly and left.value > 0)
        if dies:
            os.kill(os.getpid(), signal.SIGKILL)
        return own(scene, progress)

    monkeypatch.setattr(batch, "simulate_scene", killed)
    outcomes = list(hcm.simulate_each(given, workers=2))
    assert [o.status for o in outcomes[:9] + outcomes[10:]] == ["COMPLETED"] * (len(given) - 1)
    assert outcomes[9].status == ("COMPLETED" if kills == 1 else "FAILED")
    assert "killed" in outcomes[9].message or kills == 1
    alike = [own(scene).summary for scene in given[:4]]
    assert [o.summary for o in outcomes[:4]] == alike
    assert not multiprocessing.active_children()


def test_a_process_that_is_killed_holds_no_lock(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the flag that ends a batch: in one run of the test above all others waited for ever."""
    own, asked = batch.simulate_scene, hcm.Surface(0.021, 0.5)
    deadly = replace(SCENE, surface=asked)

    def killed(scene: hcm.Scene, progress: Any) -> hcm.TapResult:
        if scene == deadly:
            condition = getattr(batch._stop, "_cond", nullcontext())
            with condition:
                os.kill(os.getpid(), signal.SIGKILL)
        return own(scene, progress)

    monkeypatch.setattr(batch, "simulate_scene", killed)
    given = [SCENE, deadly, *[SCENE] * 3]
    found = [outcome.status for outcome in hcm.simulate_each(given, workers=2)]
    assert found == ["COMPLETED", "FAILED", *["COMPLETED"] * 3]


def test_the_table_has_units_and_whole_columns() -> None:
    table = hcm.simulate_many(scenes()[-2:])
    assert dict(table.sizes) == {"scene": 2, "axis": 2}
    assert table["normal_impulse_N_s"].units == "N s"
    assert table["tip_velocity_at_contact_m_per_s_error"].units == "m/s"
    assert table["tip_velocity_at_contact_m_per_s"].dims == ("scene", "axis")
    assert table["steps"].dtype.kind == "i"
    assert np.isnan(table["peak_normal_force_N_error"].values).tolist() == [True, False]
    # an empty batch is a table too
    assert hcm.simulate_many([]).sizes["scene"] == 0


def test_scenes_are_asked_for_as_they_are_needed() -> None:
    """So that neither scenes nor outcomes pile up, and an end is an end."""
    asked = itertools.count()
    endless = (SCENE for _ in asked)
    stream = hcm.simulate_each(endless, workers=2)
    for _ in range(3):
        assert next(stream).status == "COMPLETED"
    assert next(asked) <= 2 * batch.AHEAD * batch.PART + 2
    stream.close()  # type: ignore[attr-defined]
    assert not multiprocessing.active_children()


def test_what_runs_ends_when_nobody_waits_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """A run of 20,000 calls of the loop is left between two of them."""
    calls = multiprocessing.get_context("fork").Value("l")
    monkeypatch.setattr(stepping, "TABLE_ROWS", 50)
    # falling upwards it swings above the surface for ever
    endless = replace(
        CHEAP, end_time=100.0, max_flight_time=1e5, max_steps=10**6, flight_tolerance=0.0
    )
    upwards = replace(SCENE, settings=endless, drive=hcm.Drive(gravity=-9.8))
    short = [replace(SCENE, surface=hcm.Surface(height, 0.5)) for height in HEIGHTS]
    own = batch.simulate_scene

    def counted(scene: hcm.Scene, progress: Any) -> hcm.TapResult:
        def tell(fraction: float, doing: str) -> None:
            calls.value += 1
            progress(fraction, doing)

        return own(scene, tell)

    monkeypatch.setattr(batch, "simulate_scene", counted)
    # one here, a part of eight, and one beside it
    stream = hcm.simulate_each([*short, *short[:4], upwards], workers=2)
    assert [next(stream).status for _ in range(2)] == ["COMPLETED"] * 2
    while calls.value < 100:
        time.sleep(0.01)
    stream.close()  # type: ignore[attr-defined]
    assert calls.value < 10_000


def test_processes_end_with_their_parent() -> None:
    """One that is killed can stop nobody."""
    code = "; ".join([
        "import os, multiprocessing, tests.hcm.test_batch as t",
        "s = t.hcm.simulate_each(iter(lambda: t.SCENE, None), 2)",
        "[next(s) for _ in range(3)]",
        "print(*[c.pid for c in multiprocessing.active_children()], flush=True)",
        "os.kill(os.getpid(), 9)",
    ])  # fmt: skip
    ran = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, check=False, timeout=300
    )
    workers = [int(pid) for pid in ran.stdout.split()]
    assert len(workers) == 2
    for _ in range(500):
        if not any(Path(f"/proc/{pid}").exists() for pid in workers):
            break
        time.sleep(0.02)
    assert not any(Path(f"/proc/{pid}").exists() for pid in workers)


def test_other_threads_run_while_the_loop_does() -> None:
    assert loop.advance.targetoptions["nogil"]


def test_arrays_make_scenes() -> None:
    frictions = np.array([0.0, 0.5])
    columns = {"surface.friction": frictions, "phalanx.density": [1000, 2000]}
    one, other = hcm.vary(SCENE, columns)
    assert isinstance(one, hcm.Scene)
    assert isinstance(other, hcm.Scene)
    assert one.surface == replace(SCENE.surface, friction=0.0)
    assert other.finger.phalanges[0].density == 2000
    assert other.tip is SCENE.tip
    for kind in (pd.Series, xarray.DataArray, tuple):
        first, _ = hcm.vary(SCENE, {"surface.friction": kind([0.25, 0.5])})
        assert isinstance(first, hcm.Scene)
        assert first.surface.friction == 0.25
    torques = pd.DataFrame([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]], columns=list("abc"))
    rows = list(hcm.vary(SCENE, {"drive.torques": torques}))
    assert [row.drive.torques for row in rows if isinstance(row, hcm.Scene)] == [
        (0.1, 0.2, 0.3), (0.4, 0.5, 0.6)
    ]  # fmt: skip
    with pytest.raises(hcm.ParameterError, match="scene = "):
        hcm.vary(SCENE.finger, {"tip.restitution": [0.5]})
    (refused,) = hcm.vary(SCENE, {"tip.restitution": [2.0]})
    assert "restitution = 2.0" in str(refused)
    assert [o.status for o in hcm.simulate_each([refused, one])] == ["REFUSED", "COMPLETED"]
    uneven = np.array([[1000.0, 2000.0], [1000.0, 1000.0]])
    (why, _) = hcm.vary(SCENE, {"phalanx.density": uneven})
    assert "density = (1000.0, 2000.0): must be a finite number" in str(why)
    (driven,) = hcm.vary(SCENE, {"drive.torques": np.array([[0.1, 0.2]])})
    assert isinstance(driven, hcm.Scene)
    assert driven.drive.torques == (0.1, 0.2)


@pytest.mark.parametrize("workers", [0, -1, 1.5])
def test_workers_are_a_number_of_them(workers: float) -> None:
    with pytest.raises(hcm.ParameterError, match=f"workers = {workers}: must be a whole number"):
        hcm.simulate_many([SCENE], workers=workers)  # type: ignore[arg-type]


@pytest.mark.parametrize("scenes", [None, 1, SCENE])
def test_what_is_no_list_of_scenes_is_refused(scenes: Any) -> None:
    with pytest.raises(hcm.ParameterError, match=r"scenes = .*: must be a list of them"):
        hcm.simulate_many(scenes)


@pytest.mark.parametrize("accuracy", [None, 1e-2])
def test_what_is_no_scene_is_refused_in_its_place(accuracy: float | None) -> None:
    first, second = hcm.simulate_each([1, SCENE], 1, accuracy)  # type: ignore[list-item]
    assert (first.status, first.message) == ("REFUSED", "scene = 1: must be a Scene")
    assert second.status == "COMPLETED"


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        (None, "columns = None: must be a Mapping"),
        ({1: [1.0]}, "column 1: must be a field"),
        ({"surface.slope": [1.0]}, "'surface.slope'"),
        ({"finger.phalanges": [1.0]}, "'finger.phalanges'"),
        ({"friction": [1.0]}, "'friction'"),
        ({"surface.friction": 0.5}, "'surface.friction': must be a list"),
        ({"surface.friction": np.array(0.5)}, "'surface.friction': must be a list"),
        ({"surface.friction": {0: 0.5, 1: 0.7}}, "'surface.friction': must be a list"),
        ({"surface.friction": {0.5, 0.7}}, "'surface.friction': must be a list"),
        ({"surface.friction": "0.5"}, "'surface.friction': must be a list"),
        ({"surface.friction": bytearray(b"ab")}, "'surface.friction': must be a list"),
        ({}, "must hold one column or more"),
        ({"surface.friction": [1.0], "tip.restitution": [1.0, 0.5]}, r"\[1, 2\] rows"),
    ],
)
def test_wrong_columns_are_refused(columns: Any, said: str) -> None:
    with pytest.raises(hcm.ParameterError, match=said):
        hcm.vary(SCENE, columns)
