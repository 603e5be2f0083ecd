"""``fingertap validate``: all models on the paper's hard and soft scenes, and what they say."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from validation.compare.figures import mesh_figure, overlay_figure
from validation.errors import RunFailedError
from validation.harness.command_line import Flag
from validation.harness.console import progress_bar
from validation.harness.files import output_folder, safe_name
from validation.harness.isolated import CrashedError, call_isolated
from validation.harness.page import write_page
from validation.harness.provenance import provenance
from validation.harness.store import Store
from validation.harness.tables import write_table
from validation.render.off_screen import STILL, Renders, render_run
from validation.runs.execute import compile_in_fresh_process, in_fresh_process, stored
from validation.validate.accuracy import COLUMNS as ACCURACY_COLUMNS
from validation.validate.accuracy import accuracy_rows, accuracy_table
from validation.validate.efficiency import COLUMNS as EFFICIENCY_COLUMNS
from validation.validate.efficiency import efficiency_rows, efficiency_table
from validation.validate.headline import costs, differences, sentences
from validation.validate.ladder.climb import Ladder, climb, paper_rung
from validation.validate.ladder.report import ladder_context, tables, write_ladder
from validation.validate.plan import (
    FAST,
    MESHES,
    PENALTIES,
    PLANE,
    REDUCED,
    REFERENCE,
    SCENES,
    Runs,
    groups,
)

HIDDEN = ("reduced_model", "reference_model", "scene")  # said once above the page's table
CAPTIONS = {
    "stress": "von Mises stress at peak force, cut along the plane of motion",
    "velocity": "Speed at peak force",
    "pressure": "Contact pressure at peak force, seen from below",
    "sequence": "The tap: von Mises stress, cut along the plane of motion, one colour scale",
}

Progress = Callable[[float, str], None]


def run_all(folder: Path, progress: Progress, store: Store) -> Runs:
    """Run every job that is not stored, one process at a time: each has the machine to itself."""
    work = [group for scene in SCENES for group in groups(scene)]
    records = []
    if not all(stored(group, store) for group in work):
        compile_in_fresh_process(lambda what: progress(0.0, what))
    for number, group in enumerate(work):
        progress(number / len(work), group[0].name)
        records += in_fresh_process(group, folder, store)
    return Runs(tuple(records))


def draw_figures(folder: Path, runs: Runs) -> list[tuple[Path, str]]:
    """Figs. 7 and 9; returns paths and captions."""
    forces, meshes = folder / "forces.png", folder / "elements.png"
    lines = [r for s in SCENES for r in runs.several(s, (REDUCED, REFERENCE, FAST, PLANE))]
    overlay_figure(forces, lines, [r for s in SCENES for r in runs.spread_over(s)], SCENES)
    counted = [
        (title, run)
        for scene in SCENES
        for variant, title in MESHES.items()
        if (run := runs.find(scene, ("hcm", variant))) is not None
    ]
    mesh_figure(meshes, counted, SCENES)
    return [
        (forces, "Reduced model and references (the paper's fig. 9). Source: our own runs."),
        (
            meshes,
            "Reduced model with N elements in all (the paper's fig. 7). Source: our own runs.",
        ),
    ]


def draw_fields(folder: Path, runs_folder: Path, runs: Runs) -> dict[str, Renders]:
    """Renders of the reference on every scene that it completed."""
    result = {}
    for scene in SCENES:
        run = runs.find(scene, REFERENCE)
        if run is None:
            result[scene] = Renders({}, "no completed run to draw")
        else:
            result[scene] = render_run(
                runs_folder / safe_name(run.folder_name), folder, scene, (*STILL, "pressure")
            )
    return result


def read_back_note(runs: Runs) -> str:
    """Which times and memories are of an earlier day; empty if all were measured now."""
    days = sorted(str(run.provenance.get("created")) for run in runs.records if run.read_back)
    if not days:
        return ""
    return (
        f" {len(days)} of {len(runs.records)} unchanged runs are read back, with the time and "
        f"memory measured then ({days[0]} to {days[-1]}); --fresh measures again."
    )


def page_context(
    runs: Runs,
    accuracy: list[dict[str, Any]],
    efficiency: list[dict[str, Any]],
    figures: list[tuple[Path, str]],
    renders: dict[str, Renders],
) -> dict[str, Any]:
    """What the page's template names."""
    headline = differences(runs)
    origin = provenance({})
    drawn = [
        (what, path, f"{scene} finger: {CAPTIONS[what]}")
        for scene, pictures in renders.items()
        for what, path in pictures.pictures.items()
    ]
    factors = ", ".join(f"{penalty:g}" for penalty in (0.1, *PENALTIES))
    count = max((len(runs.spread_over(scene)) for scene in SCENES), default=0)
    shown = {
        scene: [
            row
            for row in accuracy
            if row["scene"] == scene and row["reference_model"] == " ".join(REFERENCE)
        ]
        for scene in SCENES
    }
    return {
        "failures": runs.failures(),
        "sentences": sentences(headline),
        "differences": headline,
        "costs": costs(runs),
        "spread_count": count,
        "spread_text": f"two meshes (penalty 0.1) and penalty factors {factors} (coarse mesh)",
        "processor": origin["processor"],
        "read_back": read_back_note(runs),
        "figures": figures,
        "accuracy": {scene: rows for scene, rows in shown.items() if rows},
        "accuracy_columns": [c for c in ACCURACY_COLUMNS if c not in HIDDEN],
        "efficiency": efficiency,
        "efficiency_columns": [c for c in EFFICIENCY_COLUMNS if c != "processor"],
        "render_problems": [f"{s}: {r.problem}" for s, r in renders.items() if r.problem],
        "small_renders": [(path, text) for what, path, text in drawn if what != "sequence"],
        "wide_renders": [(path, text) for what, path, text in drawn if what == "sequence"],
        "provenance": origin,
    }


def climb_ladder(out: Path, full: bool, store: Store) -> Ladder:
    """Rungs 2 and 3, in a process of their own; a crash is a failure among the others."""
    try:
        ladder: Ladder = call_isolated(climb, SCENES, full, out / "converge", store)
    except CrashedError as error:
        return Ladder((), (), (), (f"rungs 2 and 3: {error}",), full)
    return ladder


def run_validation(*, out: Path = Path("out"), ladder: Flag = False, fresh: Flag = False) -> None:
    """Run, compare, tabulate, draw, and write the page.

    Parameters
    ----------
    out
        Folder for validate/: index.html, accuracy.csv, efficiency.csv, ladder.csv, figures,
        renders, runs.
    ladder
        Compare with the converged reference on the ladder's third rung: minutes longer.
    fresh
        Run everything again; without it a run that is unchanged is read back from OUT/store.

    Raises
    ------
    UserError
        The output folder cannot be written: nothing was run.
    RunFailedError
        A run did not complete; the page shows it and all the others.
    """
    folder = output_folder(out / "validate")
    runs_folder, figures, renders = (
        output_folder(folder / name) for name in ("runs", "figures", "renders")
    )
    store = Store(out / "store", fresh)
    with progress_bar("validate") as progress:
        runs = run_all(runs_folder, progress, store)
        progress(0.8, "ladder: structure and contact")
        climbed = climb_ladder(out, ladder, store)
        progress(0.95, "tables, figures, renders")
        accuracy = [
            row
            for scene in SCENES
            if (reduced := runs.find(scene, REDUCED)) is not None
            for row in accuracy_rows(reduced, runs.references(scene), runs.spread_over(scene))
        ]
        efficiency = efficiency_rows(runs.measured())
        title = "Reduced model against the references (the paper's Table 2)"
        write_table(folder, "accuracy", accuracy_table(accuracy), title)
        title = "Time and memory of each run, alone in its process (the paper's Table 3)"
        write_table(folder, "efficiency", efficiency_table(efficiency), title)
        rungs = [*climbed.rows, *paper_rung(runs, SCENES)]
        beside = tables(climbed, runs)
        write_ladder(folder, climbed, rungs, beside)
        drawn = draw_figures(figures, runs)
        fields = draw_fields(renders, runs_folder, runs)
        context = page_context(runs, accuracy, efficiency, drawn, fields)
        context |= ladder_context(climbed, rungs, beside)
        page = folder / "index.html"
        write_page(page, "validate.html.j2", context)
    print("\n".join([*context["sentences"], *context["ladder_sentences"]]))
    print(f"page: {page}")
    for problem in context["render_problems"]:
        print(f"renders: {problem}")
    failures = [f"{run.scene} {run.label}: {run.message}" for run in runs.failures()]
    failures += climbed.failures
    if failures:
        names = "; ".join(failures)
        raise RunFailedError(f"{len(failures)} runs failed ({names}); the page {page} has the rest")
