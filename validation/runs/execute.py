"""One run: warm up, solve, measure, keep; in this process, or in a fresh one of its own."""

import contextlib
import os
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from validation.errors import RunFailedError, UserError, model_failure
from validation.harness.files import safe_name, write_text
from validation.harness.processes import CrashedError, call_isolated, peak_memory_MB, workers
from validation.harness.record import RunRecord
from validation.harness.run_files import clear_run, write_run
from validation.harness.store import NO_STORE, Inputs, Store
from validation.harness.stored_run import (
    check_given_fields,
    check_run,
    keep_run,
    relabelled,
    restore_run,
)
from validation.models import adapter, is_own
from validation.models.adapter import Checkpoint, Outcome, Progress
from validation.models.inputs import run_inputs
from validation.scenes.load import NamedScene, load_scene, scene_name

PLUG_IN_LIMIT_S = 600.0  # for a process with a model that is not this project's


@dataclass(frozen=True)
class Job:
    """A run to do: a scene's source, model, overrides, and a name for what was changed."""

    scene: str
    model: str
    overrides: tuple[str, ...] = ()
    variant: str | None = None
    keep_fields: bool = False

    @property
    def name(self) -> str:
        """The job's name before it has run."""
        return " ".join(filter(None, (scene_name(self.scene), self.model, self.variant)))

    @property
    def folder_name(self) -> str:
        """Name of the folder that its run is written to."""
        parts = safe_name(scene_name(self.scene)), self.model, self.variant
        return safe_name("-".join(filter(None, parts)).replace(" ", "-"))


@contextlib.contextmanager
def _folder_kept() -> Iterator[None]:
    """Restore the current folder at the end, in case a model changes it."""
    here = os.open(".", os.O_RDONLY)
    try:
        yield
    finally:
        os.fchdir(here)
        os.close(here)


@contextlib.contextmanager
def compiling_reported(progress: Progress | None) -> Iterator[None]:
    """Call `progress` with each kernel's name as numba begins to compile it.

    Nothing is reported for code that is loaded from the cache beside the sources.
    """
    if progress is None:
        yield
        return
    from numba.core import event

    tell = progress

    class Listener(event.Listener):
        """Reports each kernel as its compilation begins; those that it calls are within it."""

        def __init__(self) -> None:
            self.depth = 0

        def on_start(self, event: Any) -> None:
            self.depth += 1
            function = event.data["dispatcher"].py_func
            tell(0.0, f"first run: compiling {function.__module__}.{function.__name__}")

        def on_end(self, event: Any) -> None:
            self.depth -= 1
            if self.depth == 0:
                tell(0.0, "compiled; kept for the next run")

    with event.install_listener("numba:compile", Listener()):
        yield


def solve(
    scene: NamedScene,
    model: str,
    folder: Path | None,
    progress: Progress | None = None,
    checkpoint: Checkpoint | None = None,
    warm: bool = False,
) -> Outcome:
    """Warm up, unless this process has run the model before (`warm`); solve and measure.

    The solve's time is the adapter's own or, if it gives none, that of its `run`.

    Raises UserError: the model cannot take this scene.
    Raises RunFailedError: the solver stopped with an error of its own; its trace is kept in
        ``folder``.
    """
    try:
        with _folder_kept():
            module = adapter(model)
            if refused := module.refusal(scene):
                raise UserError(f"scene {scene.name}, model {model}: {refused}")
            if progress is not None:
                progress(0.0, "loading compiled code")
            with compiling_reported(progress):
                if not warm:
                    module.warm_up()
                began = time.perf_counter()
                outcome = module.run(scene, progress, checkpoint)
                elapsed_s = time.perf_counter() - began
        if not isinstance(outcome, Outcome):
            raise TypeError(f"its run gave a {type(outcome).__name__}, not an Outcome")
        check_run(outcome.record)
        check_given_fields(outcome.fields)
    except (UserError, KeyboardInterrupt):
        raise
    except (Exception, SystemExit) as error:  # a model made from a script may exit
        where = ""
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            clear_run(folder)
            write_text(folder / "error.txt", traceback.format_exc())
            where = f"; its trace is in {folder / 'error.txt'}"
        raise model_failure(scene.name, model, error, where) from error
    # a model that runs another one, or another scene, returns a record with their names
    record = replace(relabelled(outcome.record, scene.name, None, scene.document), model=model)
    if record.summary.get("wall_time_s") is None:
        record = record.with_summary(wall_time_s=elapsed_s)
    return replace(outcome, record=record.with_summary(peak_memory_MB=peak_memory_MB()))


def keep(folder: Path, outcome: Outcome) -> None:
    """Write a run's files, replacing those that were there; see `write_run`."""
    clear_run(folder)
    write_run(folder, outcome.record, outcome.fields)


def failed(job: Job, status: str, message: str) -> RunRecord:
    """The record of a run without a result."""
    name = scene_name(job.scene)
    return RunRecord(name, job.model, job.variant or "", status, False, message, summary={})


@dataclass(frozen=True)
class Task:
    """A job, its folder, and the inputs that identify its stored result (None: scene refused)."""

    job: Job
    folder: Path
    store: Store = NO_STORE
    inputs: Inputs | None = None


def _task(job: Job, folder: Path, store: Store, first: bool) -> Task:
    """The task of a job; only the first job of a process has a peak memory of its own."""
    run_folder = folder / job.folder_name
    inputs = None
    # a scene that is refused here is refused again when it is run
    with contextlib.suppress(UserError):
        tables = load_scene(job.scene, job.overrides).tables
        process = "own" if first else "shared"
        inputs = run_inputs(tables, job.model, __name__, process=process)
    return Task(job, run_folder, store, inputs)


def _read_back(task: Task) -> RunRecord | None:
    """The stored result of a task, written to its folder; None if there is none."""
    if task.inputs is None:
        return None
    record = restore_run(task.store, task.inputs, task.folder, task.job.keep_fields)
    if record is not None:
        scene = load_scene(task.job.scene, task.job.overrides)
        record = relabelled(record, scene.name, task.job.variant, scene.document)
        write_run(task.folder, record)
    return record


def _work(tasks: Sequence[Task]) -> list[RunRecord]:
    """Run jobs one after the other in this (fresh) process, keeping each as it ends."""
    from threadpoolctl import threadpool_limits

    records = []
    with threadpool_limits(1, user_api="blas"):  # only the models' own threads are timed
        for task in tasks:
            job = task.job
            try:
                scene = load_scene(job.scene, job.overrides)
                outcome = solve(scene, job.model, task.folder)
            except UserError as error:
                clear_run(task.folder)  # of an earlier run under this name
                records.append(failed(job, "FAILED", str(error)))
                continue
            except RunFailedError as error:
                records.append(failed(job, "FAILED", str(error)))
                continue
            if task.inputs is not None:
                keep_run(task.store, task.inputs, outcome.record, outcome.fields)
            record = outcome.record
            if job.variant is not None:
                record = replace(record, variant=job.variant)
            keep(task.folder, Outcome(record, outcome.fields if job.keep_fields else None))
            records.append(record)
            if record.status == "INTERRUPTED":
                break
    return records


def warm_up(*names: str) -> None:
    """Compile what is not compiled yet; a model that fails here reports it when it runs."""
    for name in names:
        with contextlib.suppress(Exception):
            adapter(name).warm_up()


def compile_in_fresh_process(
    models: Iterable[str], say: Callable[[str], None] = lambda what: None
) -> None:
    """Fill the cache of compiled code, so that no measured run includes the compiler's memory.

    Models of one kind share kernels: each kind has its process, and these run side by side.
    """
    kinds: dict[str, list[str]] = {}
    for name in models:
        kinds.setdefault(adapter(name).kind, []).append(name)
        say(f"loading the compiled code of {name}; the first time it is compiled")
    with workers(max(len(kinds), 1)) as pool:
        for job in [pool.submit(warm_up, *names) for names in kinds.values()]:
            with contextlib.suppress(RunFailedError):  # the run that crashes reports it
                job.result()


def stored(jobs: Sequence[Job], store: Store) -> bool:
    """Whether all jobs are in the store."""
    tasks = (_task(job, Path(), store, n == 0) for n, job in enumerate(jobs))
    return all(task.inputs is not None and store.has(task.inputs) for task in tasks)


def in_fresh_process(jobs: Sequence[Job], folder: Path, store: Store = NO_STORE) -> list[RunRecord]:
    """Run jobs in a fresh process: the peak memory of the first one is its own.

    A crash of the process (a segmentation fault, the system out of memory) is reported as the
    failure of the job that caused it: after a crash each job gets a process of its own.
    """
    return _run([_task(job, folder, store, number == 0) for number, job in enumerate(jobs)])


def _run(tasks: Sequence[Task]) -> list[RunRecord]:
    """Records of tasks, read from the store if it has them."""
    records = {n: found for n, task in enumerate(tasks) if (found := _read_back(task)) is not None}
    rest = [n for n in range(len(tasks)) if n not in records]
    if rest:
        try:
            limit = None if all(is_own(tasks[n].job.model) for n in rest) else PLUG_IN_LIMIT_S
            new: list[RunRecord] = call_isolated(_work, [tasks[n] for n in rest], limit_s=limit)
        except CrashedError as error:
            if len(rest) == 1:
                clear_run(tasks[rest[0]].folder)
                new = [failed(tasks[rest[0]].job, "CRASHED", str(error))]
            else:
                new = [record for n in rest for record in _run([tasks[n]])]
        records |= dict(zip(rest, new, strict=False))  # an interrupted process has fewer
    return [records[n] for n in sorted(records)]
