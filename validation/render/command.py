"""``fingertap render``: pictures and an animation of a run, or of a scene that is run first."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from validation.errors import RunFailedError, UserError
from validation.harness.command_line import Flag, Overrides
from validation.harness.console import output, say
from validation.harness.files import exclusive_folder, safe_name
from validation.harness.interrupts import unless_interrupted
from validation.harness.store import Store
from validation.render.interactive import check_interactive
from validation.render.off_screen import INTERACTIVE, PICTURES, missing_libraries, render_run
from validation.render.run_folder import FIELDS, read_curves, read_run
from validation.runs.command import failure_of, folder_for, scene_for, stored_or_solved


def render(
    run_or_scene: str,
    /,
    *,
    model: Literal["fem3d", "fem2d"] | None = None,
    overrides: Overrides = (),
    interactive: Flag = False,
    out: Path = Path("out"),
) -> None:
    """Draw a finished run's fields, or run a scene and draw its.

    Parameters
    ----------
    run_or_scene
        The folder of a finished solid run, or a scene, which is run first.
    model
        The model to run a scene with: fem3d (default) or fem2d.
    interactive
        Also write a page to rotate and step through (the extra interactive).
    out
        Folder for render/NAME-WHAT.png, .gif and .html, and for run/SCENE-MODEL/ of a scene.
    """
    check_interactive(interactive)
    problem = missing_libraries()
    if problem:
        raise UserError(f"cannot draw: {problem}")
    with exclusive_folder(out / "render") as pictures:
        if os.path.isdir(run_or_scene):
            if model is not None or overrides:
                raise UserError(
                    f"render {run_or_scene}: a finished run takes neither --model nor --set"
                )
            folder = Path(run_or_scene)
        else:
            folder = _run(run_or_scene, model or "fem3d", overrides, out)
        if doubt := read_run(folder).doubt:  # refuses what is not a run before anything is drawn
            say(f"caution: {doubt}")
        if interactive:
            read_curves(folder)  # likewise
        name = safe_name(folder.resolve().name)
        drawn = render_run(folder, pictures, name, (*PICTURES, *[INTERACTIVE] * interactive))
    if drawn.refused:
        raise UserError(drawn.problem)
    if drawn.problem:
        raise RunFailedError(f"render {run_or_scene}: {drawn.problem}; pictures so far: {pictures}")
    for what, path in drawn.pictures.items():
        output(f"{what:<12}{path}")


def _run(source: str, model: str, overrides: Sequence[str], out: Path) -> Path:
    """The folder of a scene's run, solved, kept and read back as by ``fingertap run``."""
    scene = scene_for(source, model, overrides)
    folder = folder_for(scene, model, out)
    with exclusive_folder(folder):
        kept = stored_or_solved(scene, model, folder, Store(out / "store"), None)
    unless_interrupted(kept.record)
    if kept.unwritten or not (folder / FIELDS / "tap.pvd").is_file():
        why = failure_of(kept, folder, None)
        raise RunFailedError(f"render {source}: {why}; nothing to draw")
    return folder
