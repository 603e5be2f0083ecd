"""The figures of ``fingertap validate``, and the context of its page's template."""

from pathlib import Path
from typing import Any

from validation.compare.figures import difference_figure, mesh_figure, overlay_figure
from validation.harness.files import safe_name
from validation.harness.provenance import provenance
from validation.models import adapter
from validation.render.off_screen import INTERACTIVE, STILL, Renders, render_run
from validation.validate.found_runs import Runs
from validation.validate.headline import (
    assumption_effects,
    cautions,
    cumulative_differences,
    differences,
    labels,
    sentences,
    unit_notes,
)
from validation.validate.plan import (
    MESHES,
    PAPER_REFERENCE,
    PENALTIES,
    REFINED,
    RunName,
    first_jobs,
)
from validation.validate.tables import ACCURACY_COLUMNS, EFFICIENCY_COLUMNS

PAPERS = " ".join(PAPER_REFERENCE)  # the reference whose tables also show the paper's numbers
HIDDEN = ("reference_model", "scene")  # stated once above the page's table
CAPTION = (
    "Points: each model's difference from the reference; bars: what both runs state as numerical "
    "errors (none: one states none); times are of the solve."
)
STEPS = " Blue: what each refined assumption adds to the paper's, one after the other."
CAPTIONS = {
    "stress": "von Mises stress at peak force, cut along the plane of motion",
    "velocity": "Speed at peak force",
    "pressure": "Contact pressure at peak force, seen from below",
    "sequence": "The tap: von Mises stress, cut along the plane of motion, one colour scale",
}


def draw_differences(folder: Path, runs: Runs) -> list[tuple[Path, str]]:
    """Draw the first screen's figures, one per scene; returns paths and captions."""
    found = []
    for scene in runs.scenes:
        path = folder / f"differences-{safe_name(scene)}.png"
        rows = [row for row in differences(runs) if row.scene == scene]
        difference_figure(path, rows, cumulative_differences(runs, scene), labels(runs, scene))
        found.append((path, f"{scene} finger: how far each model lies from the reference, and why"))
    return found


def draw_figures(folder: Path, runs: Runs) -> list[tuple[Path, str]]:
    """Draw figs. 7 and 9; returns paths and captions."""
    forces, meshes = folder / "forces.png", folder / "elements.png"
    lines = [r for s in runs.scenes for r in runs.drawn_runs(s)]
    band = [r for s in runs.scenes for r in runs.spread_over(s)] if runs.plan.in_full else []
    compared = {
        scene: [(reference, run) for run in runs.compared(scene)]
        for scene in runs.scenes
        if (reference := runs.reference(scene)) is not None
    }
    overlay_figure(forces, lines, band, runs.scenes, compared)
    found = [
        (forces, "Models and references (as the paper's fig. 9), below them the models' difference"
                 " from the reference. Source: the runs below."),
    ]  # fmt: skip
    if runs.plan.in_full:
        counted = [
            (title, run)
            for scene in runs.scenes
            for variant, title in MESHES.items()
            if (run := runs.find(scene, RunName("hcm", variant))) is not None
        ]
        mesh_figure(meshes, counted, runs.scenes)
        text = "Reduced model with N elements in all (the paper's fig. 7). Source: our own runs."
        found.append((meshes, text))
    return found


def draw_fields(
    folder: Path, runs_folder: Path, runs: Runs, interactive: bool = False
) -> dict[str, Renders]:
    """Render the reference on every scene that it completed."""
    result, jobs = {}, first_jobs(runs.plan)
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


def page_context(
    runs: Runs,
    accuracy: list[dict[str, Any]],
    efficiency: list[dict[str, Any]],
    figures: list[tuple[Path, str]],
    apart: list[tuple[Path, str]],
    renders: dict[str, Renders],
) -> dict[str, Any]:
    """The variables of the page's template."""
    headline = differences(runs)
    drawn = [
        (what, path, f"{scene} finger: {CAPTIONS[what]}")
        for scene, pictures in renders.items()
        for what, path in pictures.pictures.items()
        if what != INTERACTIVE
    ]
    factors = ", ".join(f"{penalty:g}" for penalty in (0.1, *PENALTIES))
    tables = {}
    for scene in runs.scenes:
        labels = dict.fromkeys([*(r.label for r in runs.references(scene)[:1]), PAPERS])
        for label in labels:
            mine = [r for r in accuracy if (r["scene"], r["reference_model"]) == (scene, label)]
            if mine:
                tables[f"{scene} finger against {label}"] = mine
    return {
        "plan": runs.plan,
        "failures": runs.failures(),
        "unit_notes": unit_notes(runs),
        "sentences": sentences(headline),
        "reasons": assumption_effects(runs),
        "differences": headline,
        "cautions": cautions(runs),
        "spread_text": f"penalty factors {factors}",
        "read_back": read_back_note(runs),
        "figures": figures,
        "apart": apart,
        "apart_caption": CAPTION + (STEPS if REFINED in runs.plan.models else ""),
        "accuracy": tables,
        "accuracy_columns": [c for c in ACCURACY_COLUMNS if c not in HIDDEN],
        "efficiency": efficiency,
        "efficiency_columns": [c for c in EFFICIENCY_COLUMNS if c != "processor"],
        "render_problems": [f"{s}: {r.problem}" for s, r in renders.items() if r.problem],
        "small_renders": [(path, text) for what, path, text in drawn if what != "sequence"],
        "interactive": [
            (scene, f"{r.pictures[INTERACTIVE].parent.name}/{r.pictures[INTERACTIVE].name}")
            for scene, r in renders.items()
            if INTERACTIVE in r.pictures
        ],
        "wide_renders": [(path, text) for what, path, text in drawn if what == "sequence"],
        "provenance": provenance({}),
    }
