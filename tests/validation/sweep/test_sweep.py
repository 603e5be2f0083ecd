"""Sweeps: the numbers of single runs, kept as they come, nothing twice, whatever ends them."""

import json
import shlex
import signal
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pytest
import xarray

from tests.processes import COMMAND, started
from tests.validation.commands import Run
from tests.validation.sweep.plans import PLAN, in_this_process, written
from validation.errors import RunFailedError, UserError
from validation.runs.execute import solve
from validation.scenes.load import load_scene
from validation.sweep import command, executor, runs
from validation.sweep.executor import Crew, solve_all
from validation.sweep.page import write_report
from validation.sweep.plan import read_plan
from validation.sweep.points import points_of
from validation.sweep.runs import CRASHED, INTERRUPTED, Row, SweepTask

__all__ = ["in_this_process"]  # a fixture

TWO = PLAN.replace(
    '["hcm"]', '["hcm", { model = "hcm", variant = "coarse", set = { "finger.elements" = 1 } }]'
).replace('"finger.elements" = 2', '"finger.elements" = 2\n"solver.hcm.flight" = "rigid"')


def opened(folder: Path) -> xarray.Dataset:
    with xarray.open_dataset(folder / "sweep" / "plan" / "sweep.nc") as data:
        return data.load().drop_vars(["wall_time_s", "spent_s", "processor"])


def lines(folder: Path) -> list[str]:
    return (folder / "sweep" / "plan" / "results.jsonl").read_text().splitlines()


@pytest.mark.usefixtures("in_this_process")
def test_a_sweep_has_the_numbers_of_its_runs(
    tmp_path: Path, fingertap: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(command, "write_report", write_report)
    path = written(tmp_path, TWO)
    assert "8 completed" in fingertap("sweep", path, "--out", tmp_path).out
    plan, data = read_plan(path), opened(tmp_path)
    points = points_of(plan)
    assert data["model"].values.tolist() == ["hcm", "hcm coarse"]
    assert data["peak_normal_force_N"].units == "N"
    assert data["material.youngs_modulus"].units == "Pa"
    assert not [name for name in data if "memory" in str(name)]  # other scenes' too
    assert data["surface.friction"].values.tolist() == points.columns["surface.friction"]
    for point in range(4):
        for number, own in enumerate(((), ("finger.elements=1",))):
            changes = (*plan.common, *own, *points.overrides(point))
            run = solve(load_scene("soft", changes), "hcm", None).record
            for key in ("peak_normal_force_N", "contact_duration_s", "peak_stress_R_Pa"):
                assert data[key].values[point, number] == run.summary[key]
                assert data[f"{key}_error"].values[point, number] == run.errors[key]
    table = (tmp_path / "sweep" / "plan" / "sweep.csv").read_text().splitlines()
    assert len(table) == 1 + 8
    page = (tmp_path / "sweep" / "plan" / "index.html").read_text()
    for title in ("How far the models are apart", "Parity", "worst scenes", "Map", "Sobol"):
        assert title in page
    worst = pandas.read_csv(tmp_path / "sweep" / "plan" / "worst-0.csv").iloc[0]
    again = shlex.split(worst["run again"].partition(" && ")[0])
    assert again[:5] == ["fingertap", "run", "soft", "--model", "hcm"]
    scene = int(worst["scene"])
    ended = fingertap(*again[1:], "--json")
    peak = json.loads(ended.out)["peak_normal_force_N"]
    assert peak == data["peak_normal_force_N"].values[scene, 1]


@pytest.mark.usefixtures("in_this_process")
def test_nothing_is_solved_twice(
    tmp_path: Path, fingertap: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(tmp_path)
    fingertap("sweep", path, "--out", tmp_path)
    before, first = lines(tmp_path), opened(tmp_path)
    # the first of more points are those that are there
    path.write_text(path.read_text().replace("number = 4", "number = 6"))
    fingertap("sweep", path, "--out", tmp_path)
    assert lines(tmp_path)[:4] == before
    assert len(lines(tmp_path)) == 6
    assert opened(tmp_path).isel(scene=slice(4)).equals(first)
    monkeypatch.setattr(runs, "solve", lambda *a, **b: pytest.fail("solved again"))
    ended = fingertap("sweep", path, "--out", tmp_path)
    assert ended.code == 0
    assert "has 6 of 6 results" in ended.err


@pytest.mark.usefixtures("in_this_process")
def test_equal_scenes_are_solved_once(
    tmp_path: Path, fingertap: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a list that names a value twice, and of an accuracy that the model's own one hides."""
    vary = PLAN.replace("number = 4", 'kind = "grid"').partition("[vary]")[0] + "[vary]\n"
    text = vary + '"surface.friction" = { values = [0.5, 0.7, 0.5] }\n'
    ended = fingertap("sweep", written(tmp_path, text), "--out", tmp_path)
    assert "1 of 3 runs are of a scene that another has too" in ended.err
    assert "3 completed" in ended.out
    assert len(lines(tmp_path)) == 2
    peaks = opened(tmp_path)["peak_normal_force_N"].values[:, 0]
    assert peaks[0] == peaks[2] != peaks[1]
    text = vary.replace("[points]", '"solver.hcm.accuracy" = 0.01\n[points]')
    text += '"solver.accuracy" = { values = [0.01, 0.1] }\n'
    ended = fingertap("sweep", written(tmp_path, text), "--out", tmp_path)
    assert "1 of 2 runs are of a scene that another has too" in ended.err

    def fails(*given: Any, **named: Any) -> Any:
        raise RunFailedError("of this scene")

    monkeypatch.setattr(runs, "solve", fails)
    text = vary + '"surface.friction" = { values = [0.9, 0.9] }\n'
    ended = fingertap("sweep", written(tmp_path, text), "--out", tmp_path)
    assert "1 runs failed or crashed, the first: of this scene" in ended.err
    assert "2 failed" in ended.out


@pytest.mark.usefixtures("in_this_process")
def test_scenes_without_a_result_say_why(tmp_path: Path, fingertap: Run) -> None:
    text = 'scene = "soft"\nmodels = ["hcm"]\n[set]\n"finger.phalanges" = 1\n'
    text += '"finger.elements" = 2\n"surface.height" = 0.03\n[points]\nkind = "grid"\n[vary]\n'
    text += '"solver.hcm.max_flight_time" = { values = [1e-3, 1.0] }\n'
    text += '"finger.length" = { values = [0.02, 0.04] }\n'
    ended = fingertap("sweep", written(tmp_path, text), "--out", tmp_path)
    assert ended.code == 0
    data = opened(tmp_path)
    status = data["status"].values[:, 0].tolist()
    assert status == ["REFUSED", "NOT_REACHED", "REFUSED", "COMPLETED"]
    assert "is never reached" in data["message"].values[0, 0]
    assert np.isnan(data["peak_normal_force_N"].values[:3]).all()
    assert len(lines(tmp_path)) == 4


@pytest.mark.usefixtures("in_this_process")
def test_a_run_that_fails_is_tried_again(
    tmp_path: Path, fingertap: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, own = written(tmp_path), runs.solve
    broken = points_of(read_plan(path)).columns["surface.friction"][2]

    def fails(scene: Any, *given: Any, **named: Any) -> Any:
        if scene.tables.surface.friction == broken:
            raise RunFailedError("of this scene")
        return own(scene, *given, **named)

    monkeypatch.setattr(runs, "solve", fails)
    ended = fingertap("sweep", path, "--out", tmp_path)
    assert ended.code == 1
    assert "1 runs failed or crashed, the first: of this scene" in ended.err
    assert opened(tmp_path)["status"].values[:, 0].tolist().count("COMPLETED") == 3
    assert len(lines(tmp_path)) == 3
    monkeypatch.setattr(runs, "solve", own)
    assert fingertap("sweep", path, "--out", tmp_path).code == 0
    assert len(lines(tmp_path)) == 4


def test_another_mesh_file_of_that_name_is_no_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A worker elsewhere may have another one, or none, under a relative path."""
    for folder, content in (("here", b"one"), ("there", b"two"), ("nowhere", None)):
        (tmp_path / folder).mkdir()
        if content is not None:
            (tmp_path / folder / "finger.vtu").write_bytes(content)
    document, overrides = load_scene("soft").document, ("solver.fem.mesh='finger.vtu'",)
    monkeypatch.chdir(tmp_path / "here")
    task = runs.task_of(0, 0, "fem2d", "soft", document, overrides)
    for folder, status in (("here", "REFUSED"), ("there", "FAILED"), ("nowhere", "FAILED")):
        monkeypatch.chdir(tmp_path / folder)
        (found,) = runs.solve_tasks("soft", document, [task], {})
        assert found["status"] == status
        assert ("is not the command's file" in found["message"]) == (status == "FAILED")
    assert "FAILED" in runs.RETRIED


@pytest.mark.usefixtures("in_this_process")
def test_an_interrupted_sweep_has_what_was_finished(
    tmp_path: Path, fingertap: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    own, count = runs.solve, iter(range(9))

    def interrupted(*given: Any, **named: Any) -> Any:
        if next(count) == 2:
            raise KeyboardInterrupt
        return own(*given, **named)

    monkeypatch.setattr(runs, "solve", interrupted)
    path = written(tmp_path)
    folder = tmp_path / "sweep" / path.stem
    folder.mkdir(parents=True)
    for name in ("index.html", "distribution.svg"):
        (folder / name).write_text("of fewer scenes")
    assert fingertap("sweep", path, "--out", tmp_path).code == 1
    assert opened(tmp_path)["status"].values[:, 0].tolist().count("COMPLETED") == 2
    assert not list(folder.glob("*.html"))
    assert not list(folder.glob("*.svg"))


@pytest.mark.usefixtures("in_this_process")
def test_a_killed_sweep_leaves_no_dataset_of_another_plan(
    tmp_path: Path, fingertap: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(tmp_path)
    fingertap("sweep", path, "--out", tmp_path)
    names = [tmp_path / "sweep" / "plan" / name for name in ("sweep.nc", "sweep.csv")]
    assert all(name.exists() for name in names)
    there: list[bool] = []

    def looks(*given: Any, **named: Any) -> Any:
        there.extend(name.exists() for name in names)
        raise RunFailedError("killed here")

    monkeypatch.setattr(runs, "solve", looks)
    path.write_text(path.read_text().replace("0.03", "0.031"))
    fingertap("sweep", path, "--out", tmp_path)
    assert there == [False] * 8


def tasks(count: int) -> list[SweepTask]:
    return [SweepTask(point, 0, "hcm", (f"n={point}",), str(point)) for point in range(count)]


def crew(answer: Callable[[tuple[str, ...]], list[Row]], log: list[int]) -> Crew:
    """Answers, or raises, at once; `log` has the sizes of the batches."""

    def submit(function: Any, name: str, document: Any, given: Any, wanted: Any) -> Future[Any]:
        del function, name, document, wanted
        future: Future[Any] = Future()
        log.append(len(given))
        try:
            future.set_result(answer(tuple(task.overrides[0] for task in given)))
        except CancelledError:
            future.cancel()
            future.set_running_or_notify_cancel()
        except Exception as error:
            future.set_exception(error)
        return future

    return Crew(submit, lambda: 2)


def answers(given: tuple[str, ...]) -> list[Row]:
    return [{**runs.row("COMPLETED", text), "spent_s": 0.02} for text in given]


def solved(answer: Callable[[tuple[str, ...]], list[Row]], count: int = 400) -> Any:
    log: list[int] = []
    kept: dict[int, Row] = {}

    def keep(task: SweepTask, found: Row) -> None:
        assert task.point not in kept
        kept[task.point] = found

    solve_all(crew(answer, log), "soft", {}, tasks(count), keep)
    assert sorted(kept) == list(range(count))
    return kept, log


def test_batches_take_about_a_second() -> None:
    """Scenes of 20 ms: 50 a batch, a single one while nobody knows, few at the end."""
    kept, log = solved(answers)
    assert all(found["message"] == f"n={point}" for point, found in kept.items())
    assert log[0] == 1
    assert max(log) in (49, 50)
    assert log[-1] == 1


def test_a_scene_that_kills_its_worker_costs_the_others_nothing() -> None:
    def dies(given: tuple[str, ...]) -> list[Row]:
        if "n=200" in given:
            raise RunFailedError("a worker process died")
        return answers(given)

    kept, log = solved(dies)
    assert [p for p, found in kept.items() if found["status"] == CRASHED] == [200]
    assert "twice: RunFailedError: a worker process died" in kept[200]["message"]
    assert sum(log) < 400 + 60

    def fails(given: tuple[str, ...]) -> list[Row]:
        raise ValueError("of its own")

    kept, _ = solved(fails, 2)
    assert "twice: ValueError: of its own" in kept[1]["message"]


def test_batches_that_are_whole_are_kept_before_an_interrupt_ends_the_sweep() -> None:
    """They were dropped where the set of finished futures gave the interrupted one first."""
    started: list[str] = []
    kept: list[int] = []

    def answer(given: tuple[str, ...]) -> list[Row]:
        started.extend(given)
        return [runs.row(INTERRUPTED, "")] if started[0] in given else answers(given)

    def keep(task: SweepTask, found: Row) -> None:
        if found["status"] == INTERRUPTED:
            raise KeyboardInterrupt
        kept.append(task.point)

    with pytest.raises(KeyboardInterrupt):
        solve_all(crew(answer, []), "soft", {}, tasks(4), keep)
    assert sorted(kept) == list(range(1, len(started)))
    assert len(started) > 1


def test_what_a_lost_connection_cancels_is_sent_again() -> None:
    lost = iter(range(100))

    def cancelled(given: tuple[str, ...]) -> list[Row]:
        if next(lost, 100) in (3, 4, 5):
            raise CancelledError
        return answers(given)

    kept, _ = solved(cancelled)
    assert {found["status"] for found in kept.values()} == {"COMPLETED"}

    def never(given: tuple[str, ...]) -> list[Row]:
        raise CancelledError

    with pytest.raises(RunFailedError, match=f"lost {executor.TRIES} times"):
        solved(never)


def test_a_worker_with_another_program_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    own = runs.programs.__wrapped__("hcm")
    for change, said in (
        ({"python": "3.99"}, "runs Python"),
        ({"versions": {**own["versions"], "numba": "0.1"}}, "has numba"),
        ({"source": "other"}, "other sources"),
        ({"environment": {"OPENBLAS_CORETYPE": "Zen"}}, "OPENBLAS_CORETYPE"),
    ):
        with pytest.raises(UserError, match=said):
            runs.check_program({**own, **change}, own, "worker")
    runs.check_program(own, own, "worker")
    assert "machine" not in own
    assert not any(name.endswith("_NUM_THREADS") for name in own["environment"])


def test_a_lost_connection_is_no_workers_death() -> None:
    """A scene is given up after two deaths, however often its batch was sent for other reasons."""
    task = SweepTask(0, 0, "hcm", (), "digest")
    cut: Future[list[Row]] = Future()
    cut.cancel()
    dead: Future[list[Row]] = Future()
    dead.set_exception(RuntimeError("killed"))
    again = deque([executor.Batch((task,))])
    for future in (cut, dead, cut):
        assert executor._rows(future, again.popleft(), again) == []
    (row,) = executor._rows(dead, again.popleft(), again)
    assert row["status"] == CRASHED


@pytest.mark.parametrize(("common", "threads"), [("", ["1"]), ('"solver.fem.threads" = 2', [])])
def test_threads_that_a_plan_sets_for_all_models_are_kept(
    tmp_path: Path, common: str, threads: list[str]
) -> None:
    text = PLAN.replace('["hcm"]', '["fem2d"]').replace("[set]", f"[set]\n{common}")
    plan = read_plan(written(tmp_path, text))
    tasks = command._tasks(plan, points_of(plan))
    (found,) = {tuple(o for o in task.overrides if "threads" in o) for task in tasks}
    assert [one.partition("=")[2] for one in found] == threads


def test_a_solids_scene_takes_one_thread() -> None:
    assert runs.on_one_thread("fem3d") == ("solver.fem.threads=1",)
    assert runs.on_one_thread("hcm") == ()


def killed_and_finished(folder: Path, kills: int, number: int, seed: int) -> None:
    """Kill a sweep with all its processes at random moments; then let it end."""
    text = TWO.replace("number = 4", f"number = {number}")
    whole, broken = folder / "whole", folder / "broken"
    path = written(folder, text)
    words = ("-c", COMMAND, "sweep", path, "--workers", "2", "--out")
    assert started(*words, whole).wait(300) == 0
    moments = np.random.default_rng(seed)
    found = 0
    for _ in range(kills):
        process = started(*words, broken)
        timer = threading.Timer(
            float(moments.uniform(2.0, 9.0)), process.send_signal, [signal.SIGKILL]
        )
        timer.start()
        process.wait(300)
        timer.cancel()
        if (broken / "sweep" / "plan" / "results.jsonl").exists():
            assert len(lines(broken)) >= found  # nothing is lost
            found = len(lines(broken))
    assert started(*words, broken).wait(300) == 0
    assert opened(broken).identical(opened(whole).assign_attrs(opened(broken).attrs))
    keys = [row["key"] for line in lines(broken) if (row := parsed(line)) is not None]
    assert len(keys) == len(set(keys)) == 2 * number


def parsed(line: str) -> Any:
    """A line, None of one that a kill has cut."""
    try:
        return json.loads(line)
    except ValueError:
        return None


def test_processes_solve_as_this_one_does(tmp_path: Path) -> None:
    plan = read_plan(written(tmp_path))
    points = points_of(plan)
    given = [
        runs.task_of(n, 0, "hcm", plan.scene, plan.document, points.overrides(n)) for n in range(3)
    ]
    kept: dict[int, Row] = {}
    with executor.processes_here(1) as here:
        solve_all(
            here, plan.scene, plan.document, given, lambda t, row: kept.update({t.point: row})
        )
    for task in given:
        scene = load_scene("soft", (*plan.common, *task.overrides))
        record = solve(scene, "hcm", None).record
        assert kept[task.point]["errors"].keys() == record.errors.keys()
        for key in ("contact_time_s", "peak_normal_force_N", "normal_impulse_N_s"):
            assert kept[task.point]["summary"][key] == record.summary[key]


@pytest.mark.slow
def test_a_sweep_killed_twenty_times_is_the_same(tmp_path: Path) -> None:
    killed_and_finished(tmp_path, 20, 2000, 2)
