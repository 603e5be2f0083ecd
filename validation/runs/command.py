"""``fingertap run``: one model on one scene."""

import json
from pathlib import Path

from validation.errors import RunFailedError, UserError
from validation.harness.command_line import AsJson, Flag, Overrides
from validation.harness.console import progress_bar, say, summary_text
from validation.harness.files import output_folder, safe_name, write_run
from validation.harness.record import RunRecord
from validation.harness.store import Store
from validation.harness.stored_run import keep_run, relabelled, restore_run
from validation.models import ModelName
from validation.models.adapter import Checkpoint
from validation.models.inputs import run_inputs
from validation.runs import execute
from validation.runs.execute import keep, solve
from validation.scenes.load import NamedScene, load_scene

DEFAULT_OUT = Path("out")


def run_scene(
    scene: str,
    /,
    *,
    model: ModelName,
    overrides: Overrides = (),
    as_json: AsJson = False,
    out: Path | None = None,
    resume: Flag = False,
    fresh: Flag = False,
) -> None:
    """Run, print, keep; a run that writes files and is stored already is read back.

    Files are written unless only JSON was asked for; a run that fails is always kept. A solid
    model's run that writes files leaves a restart file as it goes.

    Parameters
    ----------
    scene
        A built-in scene (hard, soft, driven-1, driven-2, driven-3) or the path of a TOML file.
    model
        hcm: the reduced model. fem3d, fem2d: finite elements.
    overrides
        KEY=VALUE with a dotted key, as often as needed: --set surface.friction=0.7
    as_json
        Print only one JSON object; files are written only if --out is given or the run fails.
    out
        Folder for run/SCENE-MODEL/ with summary.json, history.nc and fields; by default out.
    resume
        Continue a run that was killed, from the restart file in its folder, to the same result.
    fresh
        Run again; without it an unchanged run that is in OUT/store is read back.

    Raises
    ------
    UserError
        Bad scene, override or output folder: nothing was solved.
    RunFailedError
        The run did not complete; the message says where what it had is.
    """
    if resume and model == "hcm":
        raise UserError("--resume: hcm runs in seconds and has nothing to resume; leave it out")
    named = load_scene(scene, overrides)
    folder = (out or DEFAULT_OUT) / "run" / safe_name(f"{named.name}-{model}")
    write = out is not None or not as_json or resume
    if write:
        output_folder(folder)
        record = _stored_or_solved(named, model, folder, out or DEFAULT_OUT, resume, fresh)
    else:
        with progress_bar(f"{named.name} {model}") as progress:
            outcome = solve(named, model, folder, progress)
        record = outcome.record
        if not record.ok:
            keep(output_folder(folder), outcome)
    if record.ok and record.message:
        say(f"caution: {record.message}")
    print(json.dumps(record.to_json(), indent=2) if as_json else summary_text(record), flush=True)
    if not record.ok:
        raise RunFailedError(
            f"scene {named.name}, model {model}: {record.message or record.status}; "
            f"what it had is in {folder}"
        )
    if not as_json:
        print(f"  files in {folder}")


def _stored_or_solved(
    scene: NamedScene, model: ModelName, folder: Path, out: Path, resume: bool, fresh: bool
) -> RunRecord:
    """The run's record, its files in its folder; the restart file goes after they are kept."""
    store = Store(out / "store", fresh)
    inputs = run_inputs(scene.tables, model, execute.__name__, process="command")
    checkpoint = None if model == "hcm" else Checkpoint(folder / "restart.npz", resume)
    record = restore_run(store, inputs, folder, fields=True)
    if record is not None:
        record = relabelled(record, scene.name, None, scene.document)
        write_run(folder, record)
        say(f"{store.folder} has this run (measured {record.measured}); --fresh runs it again")
    else:
        if checkpoint is not None and resume and not checkpoint.path.exists():
            say(f"nothing to resume in {folder}: the run starts from the beginning")
        with progress_bar(f"{scene.name} {model}") as progress:
            outcome = solve(scene, model, folder, progress, checkpoint)
        record = outcome.record
        keep_run(store, inputs, record, outcome.fields)
        keep(folder, outcome)
    if checkpoint is not None and record.status != "INTERRUPTED":
        checkpoint.path.unlink(missing_ok=True)
    return record
