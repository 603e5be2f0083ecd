"""``fingertap sweep``: many scenes through models, here or on a cluster."""

import itertools
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path

import xarray

from validation.errors import RunFailedError, UserError
from validation.harness.console import output, progress_bar, say
from validation.harness.files import exclusive_folder, remove, safe_name
from validation.harness.line_store import LineStore
from validation.models.adapter import Progress
from validation.runs.execute import compile_in_fresh_process
from validation.scenes.load import sets
from validation.sweep import dataset
from validation.sweep.executor import Crew, dask_cluster, processes_here, solve_all
from validation.sweep.page import clear_report, write_report
from validation.sweep.plan import Plan, assignment, lists_replaced, read_plan
from validation.sweep.points import PointTable, points_of
from validation.sweep.runs import (
    INTERRUPTED,
    RETRIED,
    THREADS,
    Row,
    SweepTask,
    on_one_thread,
    task_of,
)


def run_sweep(
    plan: Path,
    /,
    *,
    workers: int | None = None,
    dask: str | None = None,
    out: Path = Path("out"),
) -> None:
    """Solve a plan's scenes; results are kept as they come, and none is solved twice.

    Parameters
    ----------
    plan
        TOML: scene, models, set, points, vary.
    workers
        Processes on this machine; by default one a core. Each scene takes one thread.
    dask
        Address of a Dask cluster's scheduler, instead of processes here: tcp://host:8786
    out
        Folder for sweep/NAME/: results.jsonl, sweep.nc, sweep.csv, index.html.
    """
    if workers is not None and (workers < 1 or dask is not None):
        why = "must be 1 or more" if workers < 1 else "the cluster of --dask has its own; leave one"
        raise UserError(f"--workers {workers}: {why}")
    chosen = read_plan(plan)
    points = points_of(chosen)
    for line in lists_replaced(chosen, points.columns):
        say(f"caution: {line}")
    with exclusive_folder(out / "sweep" / safe_name(chosen.name)) as folder:
        whole, retried = solve_plan(chosen, points, folder, (workers, dask))
        write_report(folder, chosen, points, whole)
    counts = Counter(whole["status"].to_numpy().ravel().tolist())
    output(", ".join(f"{n} {status.lower().replace('_', ' ')}" for status, n in counts.items()))
    output(f"files in {folder}")
    if set(counts) == {"REFUSED"}:
        raise RunFailedError(f"every run was refused, the first: {whole['message'].values.flat[0]}")
    if retried:
        raise RunFailedError(
            f"{len(retried)} runs failed or crashed, the first: {retried[0]}; the same"
            " command tries them again"
        )


def solve_plan(
    chosen: Plan, points: PointTable, folder: Path, where: tuple[int | None, str | None]
) -> tuple[xarray.Dataset, list[str]]:
    """Solve what is not finished, write the dataset; returns it and the messages of failed runs.

    where : number of processes here (None: one per core); address of a Dask cluster, or None.
    """
    finished = LineStore(folder / "results.jsonl")
    tasks = list(_tasks(chosen, points))
    distinct = {task.run: task for task in tasks}
    if alike := len(tasks) - len(distinct):
        say(f"{alike} of {len(tasks)} runs are of a scene that another has too: it is solved once")
    todo = [task for task in distinct.values() if finished.load(task.inputs) is None]
    if had := len(distinct) - len(todo):
        say(f"{folder / 'results.jsonl'} has {had} of {len(distinct)} results")
    retried, ended = dict[str, Row](), itertools.count(had + 1)

    def keep(progress: Progress, task: SweepTask, found: Row) -> None:
        if found["status"] == INTERRUPTED:
            raise KeyboardInterrupt
        if found["status"] in RETRIED:
            retried[task.run] = found
        else:
            finished.keep(task.inputs, found)
        done = next(ended)
        progress(done / len(distinct), f"{task.model}, {done} of {len(distinct)} runs")

    begun = not todo
    try:
        if todo:
            models = tuple(dict.fromkeys(task.model for task in todo))
            with (
                progress_bar(f"sweep {chosen.name}") as progress,
                _crew(models, where, partial(progress, had / len(distinct))) as crew,
            ):
                begun = True  # before, the folder stays as it is
                clear_report(folder)
                # an older dataset does not fit the new results, and may be of another plan
                remove(folder, dataset.DATASET, dataset.TABLE)
                solve_all(crew, chosen.scene, chosen.document, todo, partial(keep, progress))
    finally:
        if begun:  # the results so far, also if the sweep is interrupted
            rows = [[dataset.SweepResult()] * len(chosen.solvers) for _ in range(len(points))]
            for task in tasks:
                found = finished.load(task.inputs) or retried.get(task.run)
                rows[task.point][task.solver] = dataset.solved(found)
            whole = dataset.build(chosen, points, rows)
            dataset.write(folder, whole)
    return whole, [found["message"] for found in retried.values()]


def _tasks(plan: Plan, points: PointTable) -> Iterator[SweepTask]:
    """All tasks, ordered by model, so that those of a batch are alike."""
    for number, solver in enumerate(plan.solvers):
        own = tuple(assignment(key, value) for key, value in solver.set.items())
        # a number that the plan sets stands: for all models, or after this one for its own
        if not any(sets(text, THREADS) for text in plan.common):
            own = (*on_one_thread(solver.model), *own)
        for point in range(len(points)):
            overrides = (*own, *points.overrides(point))
            yield task_of(point, number, solver.model, plan.scene, plan.document, overrides)


def _crew(
    models: tuple[str, ...], where: tuple[int | None, str | None], doing: Callable[[str], None]
) -> AbstractContextManager[Crew]:
    """Workers here, for which kernels are compiled first, or those of a cluster."""
    workers, address = where
    doing("starting")
    if address is not None:
        return dask_cluster(address, models)
    compile_in_fresh_process(models, doing)
    return processes_here(workers)
