"""``fingertap run``: one model on one scene."""

import json
from collections.abc import Sequence
from pathlib import Path

from validation.console import progress_bar, summary_text
from validation.errors import RunFailedError
from validation.execute import keep, solve
from validation.models import ModelName
from validation.scenes.load import load_scene
from validation.storage import output_folder, safe_name

DEFAULT_OUT = Path("out")


def run_scene(
    source: str, model: ModelName, overrides: Sequence[str], as_json: bool, out: Path | None
) -> None:
    """Run, print, keep.

    Files are written unless only JSON was asked for; a run that fails is always kept.

    Raises
    ------
    UserError
        Bad scene, override or output folder: nothing was solved.
    RunFailedError
        The run did not complete; the message says where what it had is.
    """
    scene = load_scene(source, overrides)
    folder = (out or DEFAULT_OUT) / "run" / safe_name(f"{scene.name}-{model}")
    write = out is not None or not as_json
    if write:
        output_folder(folder)
    with progress_bar(f"{scene.name} {model}") as progress:
        outcome = solve(scene, model, folder, progress)
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
