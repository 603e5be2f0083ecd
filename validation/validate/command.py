"""``fingertap validate``: compare models on scenes, by default the paper's, and report."""

from pathlib import Path

from validation.errors import OutsideToleranceError, RunFailedError
from validation.harness.command_line import AsJson, Flag, Fresh, NoEstimate
from validation.harness.console import output, progress_bar, say
from validation.harness.files import exclusive_folder, output_folder
from validation.harness.processes import CrashedError, call_isolated
from validation.harness.store import Store
from validation.models.adapter import Progress
from validation.render.interactive import check_interactive
from validation.runs.execute import compile_in_fresh_process, in_fresh_process, stored
from validation.validate.checks import check_text, outcome, write_checks
from validation.validate.ladder.ladder import Ladder, compute_ladder
from validation.validate.page import report
from validation.validate.plan import PAPER, PAPER_REDUCED, REFINED, Plan, Runs, validation_jobs
from validation.validate.request import plan_of


def run_all(
    folder: Path, plan: Plan, progress: Progress, store: Store, estimate: bool = True
) -> Runs:
    """Run every job that is not stored, one process at a time: each has the machine to itself."""
    jobs = validation_jobs(plan, estimate)
    records = []
    if not all(stored(group, store) for group in jobs):
        models = dict.fromkeys(job.model for group in jobs for job in group)
        compile_in_fresh_process(models, lambda what: progress(0.0, what))
    for number, group in enumerate(jobs):
        progress(number / len(jobs), group[0].name)
        records += in_fresh_process(group, folder, store)
    return Runs(tuple(records), plan)


def isolated_ladder(plan: Plan, out: Path, full: bool, store: Store) -> Ladder:
    """Compute rungs 2 and 3 in a process of their own; a crash is listed with the failures."""
    sources = tuple(plan.scenes.values()) if plan.in_full else ()
    try:
        ladder: Ladder = call_isolated(compute_ladder, sources, full, out / "converge", store)
    except CrashedError as error:
        ladder = Ladder(full, failures=[f"rungs 2 and 3: {error}"])
    return ladder


def run_validation(
    *scenes: str,
    models: str = f"{PAPER_REDUCED.model},{REFINED}",
    reference: str = PAPER.reference,
    tolerance: str = "",
    out: Path = Path("out"),
    ladder: Flag = False,
    interactive: Flag = False,
    fresh: Fresh = False,
    no_estimate: NoEstimate = False,
    as_json: AsJson = False,
) -> None:
    """Run, compare, tabulate, draw, and write the page.

    Parameters
    ----------
    scenes
        Built-in scenes or paths of TOML files; by default the paper's hard and soft.
    models
        Names of the models that are compared, with commas between them: hcm,exudyn; by default the
        reduced model with the paper's assumptions and with the refined ones.
    reference
        The model that they are compared with, or a file of its curves for each scene: CSV,
        LS-DYNA's rcforc, CalculiX's .dat. With hcm and fem3d, the default, the paper's whole
        comparison is made; with another reference, only the models are run.
    tolerance
        Largest differences in percent, peak=5,impulse=3: a difference beyond its tolerance, or one
        that is too uncertain to tell, ends with exit code 3. Further names: duration, arrival,
        tangential, stress, or the key of another compared quantity.
    out
        Folder for validate/: index.html, accuracy.csv, efficiency.csv, ladder.csv, validate.json,
        junit.xml, figures, renders, runs.
    ladder
        Compare with the converged reference on the ladder's third rung: minutes longer.
    interactive
        Also draw fields and curves as pages to rotate and step through (the extra interactive).
    """
    check_interactive(interactive)
    plan = plan_of(scenes, models, reference, tolerance)
    with exclusive_folder(out / "validate") as folder, progress_bar("validate") as progress:
        for name in ("runs", "figures", "renders"):
            output_folder(folder / name)
        store = Store(out / "store", fresh)
        runs = run_all(folder / "runs", plan, progress, store, not no_estimate)
        progress(0.8, "ladder: structure and contact")
        rungs = isolated_ladder(plan, out, ladder, store)
        progress(0.95, "tables, figures, renders")
        context = report(folder, runs, rungs, interactive)
        failures = [f"{run.scene} {run.label}: {run.message}" for run in runs.failures()]
        failures += rungs.failures
        notes = (*plan.notes, *context["unit_notes"], *context["cautions"])
        checks, verdicts = write_checks(folder, runs, notes, failures)
    page = folder / "index.html"
    said = (*context["sentences"], *context["reasons"], *context["ladder_sentences"])
    said = (*said, f"page: {page}", *(f"renders: {text}" for text in context["render_problems"]))
    output(verdicts if as_json else "\n".join(said))
    for note in notes:
        say(f"caution: {note}")
    if failures:
        names = "; ".join(failures)
        raise RunFailedError(f"{len(failures)} runs failed ({names}); the page {page} has the rest")
    if wrong := [check_text(row) for row in checks if outcome(row) != "inside"]:
        raise OutsideToleranceError(f"{len(wrong)} of {len(checks)} checks: {'; '.join(wrong)}")
