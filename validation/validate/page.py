"""The report of ``fingertap validate``: its tables, its figures, and the page with both."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from validation.compare.figures import difference_figure, mesh_figure, overlay_figure, scenes_drawn
from validation.harness.files import safe_name
from validation.harness.page import opening, write_page
from validation.harness.tables import table_of, write_table
from validation.models import adapter
from validation.render.off_screen import INTERACTIVE, STILL, Renders, render_run
from validation.validate import headline, patches, plan, scene_values, tables
from validation.validate.ladder import rungs
from validation.validate.ladder.ladder import (
    Ladder,
    cause_sentences,
    check_sentences,
    peak_sentences,
)
from validation.validate.plan import Plan, RunName, Runs

PAPERS = " ".join(plan.PAPER_REFERENCE)  # the reference whose tables also show the paper's numbers
HIDDEN = ("reference_model", "scene")  # stated once above the page's table
STATED = "what both runs state as numerical errors, together"
DATA_STATED = "the model's numerical error and the data's uncertainty, together"
CAPTION = (
    "Points: each model's difference from the reference; bars: {} (none: one is not stated); "
    "times are of the solve."
)
STEPS = " Blue: what each refined assumption adds to the paper's, one after the other."
RUNGS = {  # titles, and what the reference's uncertainty is
    2: (
        "Rung 2, structure: the same lumped law on both bodies",
        "the index of convergence over three meshes, or their range",
    ),
    3: (
        "Rung 3, contact: blind prediction with identified k and eta^2 against the full contact",
        "the error that the run states or, if it is larger, the change from the mesh before; with "
        "--ladder the index or range over three meshes, or what fingertap converge found if its "
        "study lies in the same folder and is of this code",
    ),
    4: (
        "Rung 4, as in the paper: the scene's own k against the ls-dyna-like reference",
        "the error that this run states or, if it is farther, the distance to the farthest of "
        "the 3D runs with other meshes and penalties",
    ),
}
TABLES: dict[str, tuple[Sequence[str] | None, str]] = {  # columns (None: the rows') and caption
    "scenes": (None, "What was solved: the scenes' values"),
    "accuracy": (tables.ACCURACY_COLUMNS, "The models against the references"),
    "efficiency": (tables.EFFICIENCY_COLUMNS, "Time and memory of each run, alone in its process"),
    "ladder": (tuple(rungs.Comparison.__annotations__), "The ladder of comparisons, rungs 2 to 4"),
    "ladder_causes": (rungs.CAUSE_COLUMNS, "From the blind prediction to the reference"),
    "table_2": (tables.COLUMNS_2, "The paper's Table 2"),
    "table_3": (tables.COLUMNS_3, "The paper's Table 3"),
    "reference_checks": (
        tables.CHECK_COLUMNS,
        "What each choice in the reference changes in its own result",
    ),
    "accuracy_cost": (
        tables.COST_COLUMNS,
        "Models of the ladder against the reference that is known best, and their time",
    ),
    "contact_patch": (
        patches.PATCH_COLUMNS,
        "Contact patch and pressure at peak force, beside Hertz",
    ),
}
Rows = Mapping[str, Sequence[Any]]  # by the names of TABLES


def table_rows(ladder: Ladder, runs: Runs) -> Rows:
    """Rows of all tables, from the validation's own runs and the ladder's."""
    loaded = {name: scene.tables for name, scene in runs.plan.loaded.items()}
    return {
        "scenes": scene_values.scene_rows(loaded),
        "accuracy": tables.all_accuracy_rows(runs),
        "efficiency": tables.efficiency_rows(runs.measured(), runs.plan.models),
        "ladder": [*ladder.rows, *rungs.paper_rung(runs)],
        "ladder_causes": ladder.causes,
        "table_2": tables.paper_rows(runs, tables.TABLE_2),
        "table_3": tables.paper_rows(runs, tables.TABLE_3),
        "reference_checks": [*tables.shaft_holes(runs), *ladder.checks],
        "accuracy_cost": tables.accuracy_against_cost(runs, ladder.predictions, ladder.references),
        "contact_patch": patches.contact_patches(runs, ladder.references),
    }


def write_tables(folder: Path, rows: Rows) -> None:
    """Write every table as CSV, Markdown and LaTeX."""
    for name, (columns, caption) in TABLES.items():
        write_table(folder, name, table_of(rows[name], columns), caption)


def draw_differences(folder: Path, runs: Runs) -> list[tuple[Path, str]]:
    """Draw the first screen's figures, one per scene that has a difference; returns paths and
    captions.
    """
    found = []
    for scene in runs.scenes:
        path = folder / f"differences-{safe_name(scene)}.png"
        rows = [row for row in headline.differences(runs) if row.scene == scene]
        if all(row.error_percent is None for row in rows):
            continue
        steps, labels = headline.cumulative_differences(runs, scene), headline.labels(runs, scene)
        if runs.plan.leads_to_refined:  # the steps stand between the two
            between = plan.PAPER_REDUCED.model, plan.REFINED
            rows.sort(key=lambda row: [*between, row.model].index(row.model))
        difference_figure(path, rows, steps, labels)
        found.append((path, f"{scene} finger: how far each model lies from the reference, and why"))
    return found


def draw_figures(folder: Path, runs: Runs) -> list[tuple[Path, str]]:
    """Draw figs. 7 and 9 of the scenes that have forces; returns paths and captions."""
    forces, meshes = folder / "forces.png", folder / "elements.png"
    lines = [r for s in runs.scenes for r in (*runs.compared(s), *runs.references(s))]
    band = [r for s in runs.scenes for r in runs.spread_over(s)] if runs.plan.in_full else []
    compared = {
        scene: [(reference, run) for run in runs.compared(scene)]
        for scene in runs.scenes
        if (reference := runs.reference(scene)) is not None
    }
    if not (scenes := scenes_drawn(runs.scenes, lines)):
        return []
    overlay_figure(forces, lines, band, scenes, compared)
    as_paper = " (as the paper's fig. 9)" * runs.plan.in_full
    apart = ", below them the models' difference from the reference" * bool(compared)
    found = [
        (forces, "Models and references" + as_paper + apart + ". Source: the runs below."),
    ]  # fmt: skip
    if runs.plan.in_full:
        counted = [
            (title, run)
            for scene in runs.scenes
            for variant, title in plan.MESHES.items()
            if (run := runs.find(scene, RunName("hcm", variant))) is not None
        ]
        text = "Reduced model with N elements in all (the paper's fig. 7). Source: our own runs."
        if scenes := scenes_drawn(scenes, [run for _, run in counted]):
            mesh_figure(meshes, counted, scenes)
            found.append((meshes, text))
    return found


def draw_fields(
    folder: Path, runs_folder: Path, runs: Runs, interactive: bool = False
) -> dict[str, Renders]:
    """Render the reference on every scene that it completed."""
    result, jobs = {}, plan.first_jobs(runs.plan)
    for scene in runs.scenes:
        if scene in runs.plan.data or adapter(runs.plan.reference).kind == "reduced":
            continue  # has forces, but no fields
        result[scene] = Renders({}, "no completed run to draw")
        if (run := runs.reference(scene)) is not None:
            wanted = (*STILL, "pressure", *[INTERACTIVE] * interactive)
            models = (run.model, *(compared.model for compared in runs.compared(scene)))
            sources = [runs_folder / jobs[runs.plan.scenes[scene], m].folder_name for m in models]
            result[scene] = render_run(sources[0], folder, scene, wanted, sources[1:])
    return result


def read_back_note(runs: Runs) -> str:
    """A note on times and memories that were measured earlier; empty if all are new."""
    days = sorted(str(run.provenance.get("created")) for run in runs.records if run.read_back)
    if not days:
        return ""
    return (
        f" {len(days)} of {len(runs.records)} unchanged runs are read back, with the time and "
        f"memory measured then ({days[0]} to {days[-1]}); --fresh measures again."
    )


def heading(of: Plan) -> str:
    """The page's heading: of which scenes, and which models it compares with what."""
    references = [data.record.model for data in of.data.values()] or [of.reference]
    scenes, models, others = map(" and ".join, (of.scenes, of.models, references))
    return f"{opening(scenes)} finger: {models} against {others}"


def page_context(
    runs: Runs,
    rows: Rows,
    figures: list[tuple[Path, str]],
    apart: list[tuple[Path, str]],
    renders: dict[str, Renders],
) -> dict[str, Any]:
    """The variables of the page's template."""
    differences = headline.differences(runs)
    factors = ", ".join(f"{penalty:g}" for penalty in (0.1, *plan.PENALTIES))
    stated = DATA_STATED if runs.plan.data else STATED
    accuracy = {}
    for scene in runs.scenes:
        for label in dict.fromkeys([*(r.label for r in runs.references(scene)[:1]), PAPERS]):
            pair = scene, label
            mine = [r for r in rows["accuracy"] if (r["scene"], r["reference_model"]) == pair]
            if mine:
                accuracy[f"{scene} finger against {label}"] = mine
    return {
        "plan": runs.plan,
        "heading": heading(runs.plan),
        "stated": stated,
        "failures": runs.failures(),
        "unit_notes": headline.unit_notes(runs),
        "sentences": headline.sentences(differences),
        "reasons": headline.assumption_effects(runs),
        "differences": differences,
        "cautions": headline.cautions(runs),
        "spread_text": f"penalty factors {factors}",
        "read_back": read_back_note(runs),
        "figures": figures,
        "apart": apart,
        "scenes": rows["scenes"],
        "scenes_columns": [scene_values.KEY_AND_UNIT, *runs.scenes],
        "apart_caption": CAPTION.format(stated) + STEPS * runs.plan.leads_to_refined,
        "of_paper": runs.plan.in_full and any(row["hcm_paper"] for row in rows["table_2"]),
        "accuracy": accuracy,
        "accuracy_columns": [c for c in tables.ACCURACY_COLUMNS if c not in HIDDEN],
        "efficiency": rows["efficiency"],
        "efficiency_columns": [c for c in tables.EFFICIENCY_COLUMNS if c != "processor"],
        "render_problems": [f"{s}: {r.problem}" for s, r in renders.items() if r.problem],
        "renders": renders,
    }


def ladder_context(ladder: Ladder, rows: Rows) -> dict[str, Any]:
    """The variables of the ladder's block in the page's template."""
    return {
        "ladder": ladder,
        "table_rows": rows,
        "table_columns": {name: columns for name, (columns, _) in TABLES.items()},
        "ladder_rungs": [
            (title, known, [row for row in rows["ladder"] if row.rung == rung])
            for rung, (title, known) in RUNGS.items()
        ],
        "ladder_sentences": [
            *peak_sentences(rows["ladder"]),
            *cause_sentences(rows["ladder_causes"]),
            *check_sentences(rows["reference_checks"]),
        ],
    }


def report(folder: Path, runs: Runs, ladder: Ladder, interactive: bool = False) -> dict[str, Any]:
    """Write all tables, figures, renders and the page; returns the page's context."""
    rows = table_rows(ladder, runs)
    write_tables(folder, rows)
    figures = draw_figures(folder / "figures", runs)
    apart = draw_differences(folder / "figures", runs)
    renders = draw_fields(folder / "renders", folder / "runs", runs, interactive)
    context = page_context(runs, rows, figures, apart, renders) | ladder_context(ladder, rows)
    context["cautions"] += ladder.doubts
    write_page(folder / "index.html", "validate.html.j2", context)
    return context
