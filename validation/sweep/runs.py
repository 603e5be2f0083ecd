"""One scene of a sweep by one model, on one thread, wherever it is solved.

A run is kept as a row of JSON: its scalars, their stated errors and how it ended. Its inputs are
the scene, the model, and the program without the machine and the numbers of threads: parts of a
sweep may be solved on different machines. Each row names its processor.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from validation.errors import RunFailedError, UserError
from validation.harness.identity import program
from validation.harness.provenance import processor
from validation.harness.record import plain
from validation.harness.store import Inputs, key
from validation.models import adapter
from validation.models.inputs import scene_inputs
from validation.runs.execute import solve
from validation.scenes.load import NamedScene, changed_scene

# Statuses that a repeated run may avoid: not kept, so that the next sweep tries again.
FAILED, CRASHED, INTERRUPTED = "FAILED", "CRASHED", "INTERRUPTED"
RETRIED = (FAILED, CRASHED, INTERRUPTED)
REFUSED = "REFUSED"
NOT_SHARED = ("peak_memory_MB",)  # that of a process which has solved other scenes too
THREADS = "solver.fem.threads"
# Endings of environment variables that change the speed of one thread, but not its results.
WITHOUT_EFFECT = ("_NUM_THREADS", "_WAIT_POLICY")

Row = dict[str, Any]


@dataclass(frozen=True)
class SweepTask:
    """A point and a solver by their numbers, the scene's changes, and what names its result.

    run : digest of the scene, the model and its program; tasks with equal ones share a result.
    """

    point: int
    solver: int
    model: str
    overrides: tuple[str, ...]
    run: str

    @property
    def inputs(self) -> Inputs:
        """The store's key of the result: a short digest, as there may be a million."""
        return {"run": self.run}


def on_one_thread(model: str) -> tuple[str, ...]:
    """The override that gives a solid one thread, with the same bits: scenes share the cores."""
    return (f"{THREADS}=1",) * (adapter(model).settings == "fem")


@cache  # what a program is made of does not change while it runs
def programs(model: str) -> dict[str, Any]:
    """What decides a model's results on any machine: sources, versions, the compilers' settings."""
    found = adapter(model)
    made_by = program(*found.sources, __name__, without=found.independent_of)
    own = {k: v for k, v in made_by["environment"].items() if not k.endswith(WITHOUT_EFFECT)}
    parts = ("source", "versions", "python")
    return {**{part: made_by[part] for part in parts}, "environment": own}


def task_of(
    point: int, solver: int, model: str, name: str, document: dict[str, Any],
    overrides: tuple[str, ...],
) -> SweepTask:  # fmt: skip
    """The task of a point; a refused scene is identified by its document and overrides."""
    try:
        run = _digest(changed_scene(name, document, overrides, name), model)
    except UserError:
        inputs = {"model": model, "program": programs(model), "scene": document}
        run = key({**inputs, "overrides": list(overrides)})
    return SweepTask(point, solver, model, overrides, run)


def _digest(scene: NamedScene, model: str) -> str:
    """`SweepTask.run` of a scene, with the content of its mesh file as it is found here."""
    return key({"model": model, "program": programs(model), **scene_inputs(scene.tables, model)})


def solve_tasks(
    name: str, document: dict[str, Any], tasks: Sequence[SweepTask],
    wanted: Mapping[str, Mapping[str, Any]],
) -> list[Row]:  # fmt: skip
    """Solve tasks in a worker; returns their rows in order.

    wanted : by model, the `programs` of the command that sends them.
    """
    from threadpoolctl import threadpool_limits

    for model in wanted:
        check_program(programs(model), wanted[model], "worker")
    rows, warm = [], set[str]()
    with threadpool_limits(1, user_api="blas"):
        for task in tasks:
            rows.append(_solve(name, document, task, task.model in warm))
            warm.add(task.model)
    return rows


def check_program(own: Mapping[str, Any], wanted: Mapping[str, Any], where: str) -> None:
    """Refuse a worker whose `programs` are not the command's.

    Raises UserError: naming what differs first.
    """
    differing = [
        f"has {name} {own[part].get(name)}, the command {wanted[part].get(name)}"
        for part in ("versions", "environment")
        for name in sorted({*own[part], *wanted[part]})
        if own[part].get(name) != wanted[part].get(name)
    ]
    if own["python"] != wanted["python"]:
        differing.append(f"runs Python {own['python']}, the command {wanted['python']}")
    if own["source"] != wanted["source"]:
        differing.append("has other sources of fingertap")
    if differing:
        raise UserError(f"{where}: {differing[0]}; install the same program and versions there")


def _solve(name: str, document: dict[str, Any], task: SweepTask, warm: bool) -> Row:
    started = time.perf_counter()
    found = row(REFUSED, "")
    try:
        scene = changed_scene(name, document, task.overrides, name)
        _check_mesh(scene, task)
        record = solve(scene, task.model, None, warm=warm).record
        summary = {name: v for name, v in record.summary.items() if name not in NOT_SHARED}
        found = row(record.status, record.message)
        found |= {"summary": plain(summary), "errors": plain(record.errors)}
    except UserError as error:
        found["message"] = str(error)
    except RunFailedError as error:
        found = row(FAILED, str(error))
    return {**found, "spent_s": time.perf_counter() - started}


def _check_mesh(scene: NamedScene, task: SweepTask) -> None:
    """Refuse a mesh file that is not the one that the task was made with.

    Raises RunFailedError: another machine may have another file of that name, or none.
    """
    mesh = scene.tables.solver.fem.mesh
    if mesh is not None and _digest(scene, task.model) != task.run:
        raise RunFailedError(
            f"scene {scene.name}: solver.fem.mesh = {mesh}: is not the command's file here; give a"
            " path at which all workers have the same file"
        )


def row(status: str, message: str) -> Row:
    """A row without numbers, as it is kept; an error that could not be estimated is null."""
    found = {"status": status, "message": message, "summary": {}, "errors": {}, "spent_s": 0.0}
    return {**found, "processor": processor()}
