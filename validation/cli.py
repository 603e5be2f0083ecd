"""The command ``fingertap`` (design.md section 9). Each verb imports its work when it is called."""

import gc
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

import cyclopts

from validation.errors import RunFailedError, UserError

GARBAGE_AFTER = 100_000  # new containers between two looks for garbage

app = cyclopts.App(
    name="fingertap",
    help="Cross-validation of a reduced model and finite elements: a soft finger taps a surface.",
    version="0.1.0",
    suppress_keyboard_interrupt=False,
)


@app.command
def run(
    scene: str,
    /,
    *,
    model: Literal["hcm", "fem3d", "fem2d"],
    overrides: Annotated[Sequence[str], cyclopts.Parameter(name="--set", negative="")] = (),
    as_json: Annotated[bool, cyclopts.Parameter(name="--json", negative="")] = False,
    out: Path | None = None,
    resume: Annotated[bool, cyclopts.Parameter(negative="")] = False,
    fresh: Annotated[bool, cyclopts.Parameter(negative="")] = False,
) -> None:
    """Run one model on one scene.

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
    """
    from validation.runs.command import run_scene

    run_scene(scene, model, overrides, as_json, out, resume, fresh)


@app.command
def compare(
    scene: str,
    /,
    *,
    model: Literal["hcm", "fem3d", "fem2d"],
    overrides: Annotated[Sequence[str], cyclopts.Parameter(name="--set", negative="")] = (),
    out: Path = Path("out"),
) -> None:
    """Run one model on a scene with and without a change, and say what it changes.

    Parameters
    ----------
    scene
        A built-in scene or the path of a TOML file.
    model
        hcm, fem3d or fem2d.
    overrides
        The change, KEY=VALUE as often as needed: --set solver.fem.flight=explicit
    out
        Folder for compare/SCENE-MODEL-CHANGE/ with differences.csv and both runs.
    """
    from validation.compare.command import compare as run_comparison

    run_comparison(scene, model, overrides, out)


@app.command
def render(
    run_or_scene: str,
    /,
    *,
    model: Literal["fem3d", "fem2d"] | None = None,
    overrides: Annotated[Sequence[str], cyclopts.Parameter(name="--set", negative="")] = (),
    out: Path = Path("out"),
) -> None:
    """Draw stress, velocity, contact pressure, deformation, a sequence and an animation.

    Parameters
    ----------
    run_or_scene
        The folder of a finished solid run, or a scene, which is run first.
    model
        The model to run a scene with: fem3d (default) or fem2d.
    overrides
        KEY=VALUE with a dotted key for a scene, as often as needed.
    out
        Folder for render/NAME-WHAT.png and .gif, and for run/SCENE-MODEL/ of a scene.
    """
    from validation.render.command import render as draw

    draw(run_or_scene, model, overrides, out)


@app.command
def validate(
    *,
    out: Path = Path("out"),
    ladder: Annotated[bool, cyclopts.Parameter(negative="")] = False,
    fresh: Annotated[bool, cyclopts.Parameter(negative="")] = False,
) -> None:
    """Run all models on the paper's hard and soft scenes; tables, figures, renders, one page.

    Parameters
    ----------
    out
        Folder for validate/: index.html, accuracy.csv, efficiency.csv, ladder.csv, figures,
        renders, runs.
    ladder
        Compare with the converged reference on the ladder's third rung: minutes longer.
    fresh
        Run everything again; without it a run that is unchanged is read back from OUT/store.
    """
    from validation.validate.command import run_validation

    run_validation(out, ladder, fresh)


@app.command
def paper(
    *,
    out: Path = Path("out"),
    reference: bool = True,
    fresh: Annotated[bool, cyclopts.Parameter(negative="")] = False,
) -> None:
    """Compute every number and figure of the article, and judge each one.

    Parameters
    ----------
    out
        Folder for paper/: index.html, ledger.csv, figures.
    reference
        Whether to run the ls-dyna-like reference too; its rows are not judged without it.
    fresh
        Run everything again; without it a run that is unchanged is read back from OUT/store.
    """
    from validation.studies.paper.command import run_paper

    run_paper(out, reference, fresh)


@app.command
def converge(
    scene: str,
    /,
    *,
    model: Literal["fem3d", "fem2d"] = "fem3d",
    overrides: Annotated[Sequence[str], cyclopts.Parameter(name="--set", negative="")] = (),
    quick: Annotated[bool, cyclopts.Parameter(negative="")] = False,
    out: Path = Path("out"),
) -> None:
    """Refine mesh, penalty and step of the reference, each alone; state its error bar.

    All runs start from one impact state. Runs are kept: a study that was stopped goes on.

    Parameters
    ----------
    scene
        A built-in scene (hard, soft, driven-1, driven-2, driven-3) or the path of a TOML file.
    model
        fem3d or fem2d.
    overrides
        KEY=VALUE with a dotted key, as often as needed: --set surface.friction=0.7
    quick
        Coarser levels: two minutes instead of a half hour, and a wider error bar.
    out
        Folder for converge/SCENE-MODEL/: levels.csv, convergence.csv, convergence.png.
    """
    from validation.converge.command import run_converge

    run_converge(scene, overrides, model, quick, out)


@app.command
def bench(
    *,
    quick: Annotated[bool, cyclopts.Parameter(negative="")] = False,
    skips: Annotated[bool, cyclopts.Parameter(negative="")] = False,
    peers: Annotated[bool, cyclopts.Parameter(negative="")] = False,
    resume: Annotated[bool, cyclopts.Parameter(negative="")] = False,
    out: Path = Path("out"),
) -> None:
    """Measure time against error; with --skips what each shortcut saves; with --peers others.

    Parameters
    ----------
    quick
        Fewer and cheaper settings: under three minutes.
    skips
        The ledger of shortcuts instead: time saved and error added by each.
    peers
        Exudyn beside hcm on its scene, CalculiX, Akantu and Kratos beside the reference on a bar
        instead (extra bench, apt-get install calculix-ccx); absent peers are named.
    resume
        Take the points of work-precision that a stopped benchmark has left.
    out
        Folder for bench/: index.html, tables as CSV and Markdown, figures, machine.json.
    """
    from validation.studies.bench.command import bench as measure

    measure(out, quick, skips, peers, resume)


identify = cyclopts.App(name="identify", help="Parameters that the reduced model needs.")
app.command(identify)


@identify.command(name="contact")
def identify_contact(
    scene: str,
    /,
    *,
    overrides: Annotated[Sequence[str], cyclopts.Parameter(name="--set", negative="")] = (),
    as_json: Annotated[bool, cyclopts.Parameter(name="--json", negative="")] = False,
    out: Path = Path("out"),
) -> None:
    """Press the meshed tip on the surface: k and eta^2, beside Hertz, Mindlin and the paper.

    Parameters
    ----------
    scene
        A built-in scene (hard, soft, driven-1, driven-2, driven-3) or the path of a TOML file.
    overrides
        KEY=VALUE with a dotted key, as often as needed: --set material.poisson_ratio=0.45
    as_json
        Print only one JSON object.
    out
        Folder for identify/: contact-SCENE as CSV, Markdown, LaTeX, JSON and PNG.
    """
    from validation.identify.contact_command import run_identify_contact

    run_identify_contact(scene, overrides, as_json, out)


@identify.command(name="torque")
def identify_torque(
    *, as_json: Annotated[bool, cyclopts.Parameter(name="--json", negative="")] = False
) -> None:
    """Find the unit of the paper's printed t_3 from its three arrival times.

    Parameters
    ----------
    as_json
        Print only one JSON object.
    """
    from validation.studies.paper.torque_command import run_identify_torque

    run_identify_torque(as_json)


@app.command
def stress(
    *,
    quick: Annotated[bool, cyclopts.Parameter(negative="")] = False,
    only: Literal["hcm", "reference", "fuzz"] | None = None,
    peers: Annotated[bool, cyclopts.Parameter(negative="")] = False,
    out: Path = Path("out"),
) -> None:
    """Map where the models are right, refuse, or stop; no cell may be silently wrong.

    Finished cells are kept: a campaign that was stopped goes on.

    Parameters
    ----------
    quick
        Coarser maps and fewer random scenes: three minutes.
    only
        The maps of one model, or the random scenes.
    peers
        Hard cells by SciPy's and Exudyn's means (extra bench) beside hcm, and by CalculiX
        (apt-get install calculix-ccx) beside the reference instead; absent peers are named.
    out
        Folder for stress/full/ (quick/): index.html, a CSV and a figure per map, summary.csv.
    """
    from validation.studies.stress.command import run_peers, run_stress

    if peers:
        run_peers(out)
        return
    run_stress(quick, only, out)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line; ends with exit code 0 done, 1 a run failed, 2 bad input."""
    from validation.harness.console import say_error
    from validation.harness.interrupts import heard_interrupts

    # threads that spin while they wait make a shared machine many times slower
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")
    # what is imported stays: looking for garbage in it takes a tenth of a short command's time
    gc.set_threshold(GARBAGE_AFTER)
    try:
        with heard_interrupts():
            app(arguments, exit_on_error=False, print_error=False, result_action="return_value")
    except (UserError, RunFailedError) as error:
        say_error(str(error))
        sys.exit(error.exit_code)
    except cyclopts.CycloptsError as error:
        say_error(f"{error}; see fingertap --help")
        sys.exit(UserError.exit_code)
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        say_error(
            f"{where}{error.strerror or error}; what was finished is kept: "
            "when that is mended, the same command goes on"
        )
        sys.exit(RunFailedError.exit_code)
    except KeyboardInterrupt:
        say_error("interrupted; what was finished is kept in the output folder")
        sys.exit(RunFailedError.exit_code)
