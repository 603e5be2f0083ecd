"""One run: warm up, solve, measure, keep. In this process, or alone in a fresh one."""

import contextlib
import traceback
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from validation.errors import RunFailedError, UserError
from validation.fields import write_fields
from validation.isolated import CrashedError, call_isolated
from validation.memory import peak_memory_MB
from validation.models import MODEL_NAMES, ModelName, adapter
from validation.models.adapter import Checkpoint, Outcome, Progress
from validation.record import RunRecord
from validation.scenes.load import NamedScene, load_scene
from validation.storage import safe_name, write_run, write_text


@dataclass(frozen=True)
class Job:
    """A run to be made: scene, model, overrides, and a name for what was changed."""

    scene: str
    model: ModelName
    overrides: tuple[str, ...] = ()
    variant: str | None = None
    keep_fields: bool = False

    @property
    def name(self) -> str:
        """The job's name before it has run."""
        return " ".join(filter(None, (self.scene, self.model, self.variant)))


def solve(
    scene: NamedScene,
    model: ModelName,
    folder: Path | None,
    progress: Progress | None = None,
    checkpoint: Checkpoint | None = None,
) -> Outcome:
    """Warm up, solve and measure.

    Raises
    ------
    UserError
        The model cannot take this scene.
    RunFailedError
        The solver stopped with an error of its own; its trace is kept in ``folder``.
    """
    try:
        module = adapter(model)
        if progress is not None:
            progress(0.0, "loading compiled code")
        module.warm_up()
        outcome = module.run(scene, progress, checkpoint)
    except (UserError, KeyboardInterrupt):
        raise
    except Exception as error:
        text = " ".join(str(error).split()) or "no message"
        where = ""
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            write_text(folder / "error.txt", traceback.format_exc())
            where = f"; its trace is in {folder / 'error.txt'}"
        raise RunFailedError(
            f"scene {scene.name}, model {model}: {type(error).__name__}: {text}{where}"
        ) from error
    return replace(outcome, record=outcome.record.with_summary(peak_memory_MB=peak_memory_MB()))


def keep(folder: Path, outcome: Outcome) -> None:
    """Write a run's record, and its fields where it has them."""
    write_run(folder, outcome.record)
    if outcome.fields is not None and outcome.fields.steps:
        write_fields(folder / "fields", outcome.fields)


def failed(job: Job, status: str, message: str) -> RunRecord:
    """The record of a run that gave nothing."""
    return RunRecord(job.scene, job.model, job.variant or "", status, False, message, summary={})


def _work(jobs: Sequence[Job], folder: Path) -> list[RunRecord]:
    """Run jobs one after the other in this (fresh) process, keeping each as it ends."""
    from threadpoolctl import threadpool_limits

    records = []
    with threadpool_limits(1, user_api="blas"):  # the models' own threads are what is timed
        for job in jobs:
            run_folder = folder / safe_name(job.name.replace(" ", "-"))
            try:
                scene = load_scene(job.scene, job.overrides)
                outcome = solve(scene, job.model, run_folder)
            except (UserError, RunFailedError) as error:
                records.append(failed(job, "FAILED", str(error)))
                continue
            record = replace(outcome.record, scene=job.scene)
            if job.variant is not None:
                record = replace(record, variant=job.variant)
            keep(run_folder, Outcome(record, outcome.fields if job.keep_fields else None))
            records.append(record)
            if record.status == "INTERRUPTED":
                break
    return records


def _warm_up_all() -> None:
    """Compile whatever is not compiled yet; a model that cannot says so when it runs."""
    for name in MODEL_NAMES:
        with contextlib.suppress(Exception):
            adapter(name).warm_up()


def compile_in_fresh_process() -> None:
    """Fill the compiled code's cache, so that no measured run pays for a compiler's memory."""
    with contextlib.suppress(CrashedError):  # the run that crashes reports it
        call_isolated(_warm_up_all)


def in_fresh_process(jobs: Sequence[Job], folder: Path) -> list[RunRecord]:
    """Run jobs in a process of their own: the first one's peak memory is its own.

    A crash of the process (a segmentation fault, the system out of memory) is reported as the
    failure of the job that caused it: after a crash each job gets a process of its own.
    """
    try:
        records: list[RunRecord] = call_isolated(_work, jobs, folder)
    except CrashedError as error:
        if len(jobs) == 1:
            return [failed(jobs[0], "CRASHED", str(error))]
        return [record for job in jobs for record in in_fresh_process([job], folder)]
    return records
