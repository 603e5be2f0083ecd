"""``fingertap calibrate``: the errors that runs state beside those that they have."""

from pathlib import Path
from typing import Literal

import reference_fem
from validation.errors import UserError
from validation.harness.command_line import Flag
from validation.harness.console import output, progress_bar
from validation.harness.files import exclusive_folder
from validation.harness.quantities import COMPONENTS, QUANTITIES
from validation.runs.execute import compile_in_fresh_process
from validation.scenes.load import load_scene
from validation.studies.calibration.report import write_report
from validation.studies.calibration.scenes import case
from validation.studies.calibration.solves import TIGHT_SHARE, solve_case
from validation.studies.campaign import Case, run_cases

SCENES, QUICK_SCENES = 500, 12


def calibrate(
    *,
    model: Literal["hcm", "fem3d"] = "hcm",
    scenes: int | None = None,
    first: int = 0,
    accuracy: float | None = None,
    quick: Flag = False,
    out: Path = Path("out"),
) -> None:
    """Solve random scenes by fixed settings and tightly; compare stated with true errors.

    Parameters
    ----------
    model
        Model whose estimates are checked.
    scenes
        Number of scenes, 500 by default: falling, driven, tilted, and with three taps in turn.
    first
        Number of the first scene: another number gives other scenes.
    accuracy
        Solve for this relative error instead of the fixed settings, and count the runs that keep
        it.
    quick
        Twelve scenes, instead of --scenes.
    out
        Folder for calibration/: a page, tables as CSV, Markdown and LaTeX, a figure.
    """
    if quick and scenes is not None:
        raise UserError(f"--quick --scenes {scenes}: two numbers of scenes; leave one out")
    count = (QUICK_SCENES if quick else SCENES) if scenes is None else scenes
    if count < 1 or first < 0:
        raise UserError(f"--scenes {count} --first {first}: must be 1 or more, and 0 or more")
    if accuracy is not None:
        load_scene("soft", (f"solver.accuracy={accuracy}",))
        smallest = reference_fem.SMALLEST / TIGHT_SHARE
        if model == "fem3d" and accuracy < smallest:
            raise UserError(
                f"--model fem3d --accuracy {accuracy:g}: must be {smallest:.2g} or more, as no"
                " tighter mesh judges a finer run"
            )
    chosen = {number: case(model, number, accuracy) for number in range(first, first + count)}
    cases = [Case(model, scene, solve_case) for scene in chosen.values()]
    names = {entry.key: entry.title for entry in (*QUANTITIES, *COMPONENTS)}
    name = model if accuracy is None else f"{model}-{accuracy:g}"
    with exclusive_folder(out / "calibration") as folder:
        with progress_bar("calibrate") as progress:
            progress(0.0, "loading compiled code, compiling it the first time")
            compile_in_fresh_process((model,))
            verdicts = run_cases(cases, folder / "scenes.jsonl", progress)
        rows = list(zip(chosen, chosen.values(), verdicts, strict=True))
        output(write_report(folder, name, rows, names))
    output(f"files in {folder}")
