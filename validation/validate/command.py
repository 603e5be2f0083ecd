"""``fingertap validate``: all models on the paper's hard and soft scenes, and what they say."""

from pathlib import Path
from typing import Any

from validation.errors import RunFailedError
from validation.harness.command_line import Flag, NoEstimate
from validation.harness.console import output, progress_bar
from validation.harness.files import output_folder
from validation.harness.page import write_page
from validation.harness.processes import CrashedError, call_isolated
from validation.harness.store import Store
from validation.harness.tables import table_of, write_table
from validation.models.adapter import Progress
from validation.runs.execute import compile_in_fresh_process, in_fresh_process, stored
from validation.validate.ladder.ladder import Ladder, compute_ladder
from validation.validate.ladder.report import ladder_context, ladder_rows, write_ladder
from validation.validate.page import draw_fields, draw_figures, page_context
from validation.validate.plan import REDUCED, SCENES, Runs, groups
from validation.validate.tables import (
    ACCURACY_COLUMNS,
    EFFICIENCY_COLUMNS,
    accuracy_rows,
    efficiency_rows,
)


def run_all(folder: Path, progress: Progress, store: Store, estimate: bool = True) -> Runs:
    """Run every job that is not stored, one process at a time: each has the machine to itself."""
    work = [group for scene in SCENES for group in groups(scene, estimate)]
    records = []
    if not all(stored(group, store) for group in work):
        models = dict.fromkeys(job.model for group in work for job in group)
        compile_in_fresh_process(models, lambda what: progress(0.0, what))
    for number, group in enumerate(work):
        progress(number / len(work), group[0].name)
        records += in_fresh_process(group, folder, store)
    return Runs(tuple(records))


def isolated_ladder(out: Path, full: bool, store: Store) -> Ladder:
    """Rungs 2 and 3, in a process of their own; a crash is a failure among the others."""
    try:
        ladder: Ladder = call_isolated(compute_ladder, SCENES, full, out / "converge", store)
    except CrashedError as error:
        ladder = Ladder(full, failures=[f"rungs 2 and 3: {error}"])
    return ladder


def report(folder: Path, runs: Runs, ladder: Ladder) -> dict[str, Any]:
    """Write all tables, figures, renders and the page; returns what the page names."""
    accuracy = [
        row
        for scene in SCENES
        if (reduced := runs.find(scene, REDUCED)) is not None
        for row in accuracy_rows(reduced, runs.references(scene), runs.spread_over(scene))
    ]
    title = "Reduced model against the references (the paper's Table 2)"
    write_table(folder, "accuracy", table_of(accuracy, ACCURACY_COLUMNS), title)
    efficiency = efficiency_rows(runs.measured())
    title = "Time and memory of each run, alone in its process (the paper's Table 3)"
    write_table(folder, "efficiency", table_of(efficiency, EFFICIENCY_COLUMNS), title)
    rungs = ladder_rows(ladder, runs)
    write_ladder(folder, rungs)
    figures = draw_figures(folder / "figures", runs)
    renders = draw_fields(folder / "renders", folder / "runs", runs)
    context = page_context(runs, accuracy, efficiency, figures, renders)
    context |= ladder_context(ladder, rungs)
    write_page(folder / "index.html", "validate.html.j2", context)
    return context


def run_validation(
    *,
    out: Path = Path("out"),
    ladder: Flag = False,
    fresh: Flag = False,
    no_estimate: NoEstimate = False,
) -> None:
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
    no_estimate
        Leave the estimates of the runs' errors out.

    Raises
    ------
    UserError
        The output folder cannot be written: nothing was run.
    RunFailedError
        A run did not complete; the page shows it and all the others.
    """
    folder = output_folder(out / "validate")
    for name in ("runs", "figures", "renders"):
        output_folder(folder / name)
    store = Store(out / "store", fresh)
    with progress_bar("validate") as progress:
        runs = run_all(folder / "runs", progress, store, not no_estimate)
        progress(0.8, "ladder: structure and contact")
        rungs = isolated_ladder(out, ladder, store)
        progress(0.95, "tables, figures, renders")
        context = report(folder, runs, rungs)
    page = folder / "index.html"
    output("\n".join([*context["sentences"], *context["ladder_sentences"]]))
    output(f"page: {page}")
    for problem in context["render_problems"]:
        output(f"renders: {problem}")
    failures = [f"{run.scene} {run.label}: {run.message}" for run in runs.failures()]
    failures += rungs.failures
    if failures:
        names = "; ".join(failures)
        raise RunFailedError(f"{len(failures)} runs failed ({names}); the page {page} has the rest")
