"""``fingertap run``: one model on one scene."""

import json
from collections.abc import Sequence
from pathlib import Path

from validation.console import progress_bar, say, summary_text
from validation.errors import RunFailedError, UserError
from validation.execute import keep, solve
from validation.models import ModelName
from validation.models.adapter import Checkpoint
from validation.scenes.load import load_scene
from validation.storage import output_folder, safe_name

DEFAULT_OUT = Path("out")


def run_scene(
    source: str,
    model: ModelName,
    overrides: Sequence[str],
    as_json: bool,
    out: Path | None,
    resume: bool = False,
) -> None:
    """Run, print, keep.

    Files are written unless only JSON was asked for; a run that fails is always kept. A solid
    model's run that writes files leaves a restart file as it goes.

    Raises
    ------
    UserError
        Bad scene, override or output folder: nothing was solved.
    RunFailedError
        The run did not complete; the message says where what it had is.
    """
    if resume and model == "hcm":
        raise UserError("--resume: hcm runs in seconds and has nothing to resume; leave it out")
    scene = load_scene(source, overrides)
    folder = (out or DEFAULT_OUT) / "run" / safe_name(f"{scene.name}-{model}")
    write = out is not None or not as_json or resume
    checkpoint = None
    if write:
        output_folder(folder)
        if model != "hcm":
            checkpoint = Checkpoint(folder / "restart.npz", resume)
    if checkpoint is not None and resume and not checkpoint.path.exists():
        say(f"nothing to resume in {folder}: the run starts from the beginning")
    with progress_bar(f"{scene.name} {model}") as progress:
        outcome = solve(scene, model, folder, progress, checkpoint)
    record = outcome.record
    if write or not record.ok:
        keep(output_folder(folder), outcome)
    print(json.dumps(record.to_json(), indent=2) if as_json else summary_text(record), flush=True)
    if not record.ok:
        raise RunFailedError(
            f"scene {scene.name}, model {model}: {record.message or record.status}; "
            f"what it had is in {folder}"
        )
    if not as_json:
        print(f"  files in {folder}")
