"""``fingertap run``: one model on one scene."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from validation.errors import RunFailedError, UserError, file_reason
from validation.harness.command_line import (
    Accuracy,
    AsJson,
    Flag,
    Fresh,
    NoEstimate,
    Overrides,
    Source,
)
from validation.harness.console import output, output_kept, progress_bar, say, summary_text
from validation.harness.files import exclusive_folder, json_text, safe_name
from validation.harness.record import RunRecord
from validation.harness.run_files import write_run
from validation.harness.store import Store
from validation.harness.stored_run import keep_run, load_run, relabelled, restore_run
from validation.models import adapter, default_accuracy, estimate_override
from validation.models.adapter import Adapter, Checkpoint, Outcome
from validation.models.inputs import run_inputs
from validation.runs import execute
from validation.runs.execute import keep, solve
from validation.scenes.load import NamedScene, changed_scene, load_scene, sets

DEFAULT_OUT = Path("out")

Result = TypeVar("Result")


def run_scene(
    scene: Source,
    /,
    *,
    model: str,
    overrides: Overrides = (),
    accuracy: Accuracy = None,
    as_json: AsJson = False,
    out: Path | None = None,
    resume: Flag = False,
    fresh: Fresh = False,
    no_estimate: NoEstimate = False,
) -> None:
    """Run, print, keep; a run that writes files and is stored already is read back.

    Files are written unless only JSON was asked for; a run that fails is always kept. A solid
    model's run that writes files leaves a restart file as it goes.

    Parameters
    ----------
    model
        hcm, hcm-refined: the reduced model. fem3d, fem2d: finite elements. Or an installed
        plug-in's name.
    out
        Folder for run/SCENE-MODEL/ with summary.json, history.nc, curves.csv and fields; by default
        out. With --json files are written only if it is given or the run fails.
    resume
        Continue a run that was killed, from the restart file in its folder, to the same result.
    """
    with output_kept():
        module = adapter(model)
    resumable = module.resumable
    if resume and not resumable:
        raise UserError(f"--resume: {model} leaves no restart file to resume; leave it out")
    wanted = accuracy_override(module, accuracy, overrides)
    asked = (*overrides, *wanted, *estimate_override(model, not no_estimate))
    named = scene_for(scene, model, asked)
    folder = folder_for(named, model, out)
    checkpoint = None
    if out is not None or not as_json or resume:
        if resumable:
            checkpoint = Checkpoint(folder / "restart.npz", resume)
        with exclusive_folder(folder):
            store = Store((out or DEFAULT_OUT) / "store", fresh)
            kept = stored_or_solved(named, model, folder, store, checkpoint)
    else:
        outcome = _solved(named, model, folder, None)
        failed = not outcome.record.ok
        kept = Kept(outcome.record, _unwritten(_keep_alone, folder, outcome) if failed else "")
    record = kept.record
    if record.ok and record.message:
        say(f"caution: {record.message}")
    output(json_text(record.to_json()) if as_json else summary_text(record))
    if failure := failure_of(kept, folder, checkpoint):
        raise RunFailedError(f"scene {named.name}, model {model}: {failure}")
    if not as_json:
        output(f"  files in {folder}")


def scene_for(source: str, model: str, overrides: Sequence[str]) -> NamedScene:
    """A scene, held to the model's default accuracy if it leaves that open."""
    named = load_scene(source, overrides)
    if by_default := default_accuracy(model, named.tables):
        return changed_scene(named.name, named.document, by_default, source)
    return named


def folder_for(scene: NamedScene, model: str, out: Path | None) -> Path:
    """Where a run's files are kept."""
    return (out or DEFAULT_OUT) / "run" / safe_name(f"{scene.name}-{model}")


@dataclass(frozen=True)
class Kept:
    """A run's record, why some of its files could not be written, and whether a store has it."""

    record: RunRecord
    unwritten: str = ""
    stored: bool = False


def accuracy_override(
    module: Adapter, accuracy: str | None, overrides: Sequence[str]
) -> tuple[str, ...]:
    """The override that ``--accuracy`` stands for.

    Raises UserError: it is empty, the model takes none, or an override states another.
    """
    if accuracy is None:
        return ()
    if not accuracy.strip():
        raise UserError(f"--accuracy {accuracy!r}: is empty; give a number, as in --accuracy 1e-3")
    if not module.settings:
        raise UserError(f"--accuracy {accuracy}: {module.name} takes none; leave it out")
    keys = ("solver.accuracy", f"solver.{module.settings}.accuracy")
    if twice := [one for one in overrides if any(sets(one, key) for key in keys)]:
        raise UserError(
            f"--accuracy {accuracy} and --set {twice[0]}: two accuracies; leave one out"
        )
    return (f"solver.{module.settings}.accuracy={accuracy}",)


def failure_of(kept: Kept, folder: Path, checkpoint: Checkpoint | None) -> str:
    """Why the command fails, with what it left and what to do; empty if it does not."""
    record, going_on = kept.record, _going_on(checkpoint)
    if kept.unwritten:
        again = "reads it from there" if kept.stored else "runs it again"
        return (
            f"{'' if record.ok else record.message + '; '}its files could not all be written "
            f"({kept.unwritten}); {'the store has it; ' if kept.stored else ''}when {folder} can "
            f"be written, the same command {going_on or again}"
        )
    if record.ok:
        return ""
    further = record.status == "INTERRUPTED" and going_on
    return f"{record.message or record.status}; partial results are in {folder}" + (
        f"; the same command {going_on}" if further else ""
    )


def stored_or_solved(
    scene: NamedScene, model: str, folder: Path, store: Store, checkpoint: Checkpoint | None
) -> Kept:
    """The run, its files in its folder; restart files are removed once the result is kept."""
    inputs = run_inputs(scene.tables, model, execute.__name__, process="command")
    record, unwritten = None, ""
    try:
        record = restore_run(store, inputs, folder, fields=True)
    except OSError as error:  # no room for the fields; the record may still be readable
        record, unwritten = load_run(store, inputs), file_reason(error)
    if record is not None:
        record = relabelled(record, scene.name, None, scene.document)
        unwritten = unwritten or _unwritten(write_run, folder, record)
        say(f"{store.folder} has this run (measured {record.measured}); --fresh runs it again")
        kept = Kept(record, unwritten, stored=True)
    else:
        outcome = _solved(scene, model, folder, checkpoint)
        stored = keep_run(store, inputs, outcome.record, outcome.fields)
        kept = Kept(outcome.record, _unwritten(keep, folder, outcome), stored)
    needed = kept.record.status == "INTERRUPTED" or (kept.unwritten and not kept.stored)
    if checkpoint is not None and not needed:
        checkpoint.remove()
    return kept


@output_kept()
def _solved(scene: NamedScene, model: str, folder: Path, checkpoint: Checkpoint | None) -> Outcome:
    if checkpoint is not None and checkpoint.resume and not checkpoint.path.exists():
        say(f"nothing to resume in {folder}: the run starts from the beginning")
    if checkpoint is not None and not checkpoint.resume:
        checkpoint.remove()  # a later --resume must not meet another run's
    try:
        with progress_bar(f"{scene.name} {model}") as progress:
            return solve(scene, model, folder, progress, checkpoint)
    except KeyboardInterrupt as error:  # where no solver handles it: loading, meshing
        if not _going_on(checkpoint):
            raise
        raise RunFailedError(
            f"scene {scene.name}, model {model}: interrupted; "
            f"the same command {_going_on(checkpoint)}"
        ) from error


def _going_on(checkpoint: Checkpoint | None) -> str:
    """How the same command continues from the restart file; empty if there is none."""
    if checkpoint is None or not checkpoint.path.exists():
        return ""
    return f"with --resume goes on from {checkpoint.path}"


def _keep_alone(folder: Path, outcome: Outcome) -> None:
    with exclusive_folder(folder):
        keep(folder, outcome)


def _unwritten(write: Callable[[Path, Result], None], folder: Path, result: Result) -> str:
    """Why some of a result's files could not be written; empty if all were.

    A solved run is shown even if its files cannot be written.
    """
    try:
        write(folder, result)
    except OSError as error:
        return file_reason(error)
    except UserError as error:  # another command writes there
        return str(error)
    return ""
