"""``fingertap paper``: every number that the paper prints, with a verdict, and its figures."""

import os
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from validation.compare.claims import read_claims
from validation.compare.figures import mesh_figure, overlay_figure
from validation.harness.command_line import Flag
from validation.harness.console import progress_bar
from validation.harness.files import output_folder
from validation.harness.page import write_page
from validation.harness.processes import workers
from validation.harness.provenance import provenance
from validation.harness.record import RunRecord
from validation.harness.store import Store
from validation.harness.tables import write_table
from validation.models import ModelName
from validation.runs.execute import Job, in_fresh_process
from validation.studies.paper import compliance_rows, driven_rows, friction_rows, validation_rows
from validation.studies.paper.cases import experiments, undriven_cases
from validation.studies.paper.driven_cases import NUMERICS, PRINTED_TORQUES, driven_cases
from validation.studies.paper.driven_figures import (
    DRAWN_TWICE,
    figure_13,
    figure_14,
    figure_15,
    figure_16,
)
from validation.studies.paper.driven_rows import Identified
from validation.studies.paper.finding import Runs
from validation.studies.paper.ledger import VERDICTS, ledger, ledger_table, score
from validation.studies.paper.reference_runs import References, run_references
from validation.studies.paper.solve import solve_cases
from validation.studies.paper.torque_factor import alone, identify
from validation.studies.paper.undriven_figures import figure_10, figure_11, figure_12

SCENES = ("hard", "soft")
CAPTIONS = {
    "fig-07": "Fig. 7: reduced model with N elements in all",
    "fig-09": "Fig. 9: reduced model against the ls-dyna-like reference (other model)",
    "fig-10": "Fig. 10: contact forces and stress at R under different friction",
    "fig-11": "Fig. 11: contact forces and stress at R under different compliance",
    "fig-12": "Fig. 12: hysteresis loops of the normal element",
    "fig-13": "Fig. 13: postures of the driven finger; the contact's own instant included",
    "fig-14": "Fig. 14: contact forces and stress at R of the driven finger",
    "fig-15": "Fig. 15: bending deflection of the third phalanx in its first node's frame",
    "fig-16": "Fig. 16: tangential velocity of the contact particle P",
}


def run_alone(
    folder: Path, model: ModelName, overrides: tuple[str, ...], variant: str, store: Store
) -> dict[str, RunRecord]:
    """A model on both scenes, each run alone in its process; failures left out."""
    records = {}
    for scene in SCENES:
        (record,) = in_fresh_process([Job(scene, model, overrides, variant)], folder, store)
        if record.ok:
            records[scene] = record
    return records


def draw(folder: Path, runs: Runs, references: Mapping[str, RunRecord]) -> list[tuple[Path, str]]:
    """All figures; returns paths and captions."""
    paths = {name: folder / f"{name}.png" for name in CAPTIONS}
    labels = {"": "N = 60", " N=30": "N = 30", " N=15": "N = 15"}
    counted = [(title, runs[f"{scene}{suffix}"].record) for scene in SCENES
               for suffix, title in labels.items()]  # fmt: skip
    mesh_figure(paths["fig-07"], counted, SCENES)
    overlay_figure(
        paths["fig-09"],
        [*(replace(runs[s].record, variant="") for s in SCENES), *references.values()],
        (),
        SCENES,
    )
    for number, figure in ((10, figure_10), (11, figure_11), (12, figure_12), (13, figure_13),
                           (14, figure_14), (15, figure_15), (16, figure_16)):  # fmt: skip
        figure(paths[f"fig-{number}"], runs)
    return [(paths[name], f"{caption}. Source: our own runs.") for name, caption in
            CAPTIONS.items()]  # fmt: skip


def solve_all(progress: Callable[[float, str], None], store: Store) -> tuple[Runs, Identified]:
    """Identify the t_3 factor, then run every case of the reduced model that is not stored."""
    with workers(os.cpu_count() or 1) as pool:
        progress(0.02, "identifying the t_3 factor")
        single = {scene: pool.submit(alone, scene, store) for scene in PRINTED_TORQUES}
        found = Identified(
            identify(pool, (), store),
            {scene: job.result() for scene, job in single.items()},
            {name: identify(pool, numerics, store) for name, numerics in NUMERICS.items()},
        )
        cases = (
            *driven_cases(
                found.common.factor,
                found.common.uncertainty,
                found.alone["driven-2"].best_factor,
                {name: fit.factor for name, fit in found.fitted.items()},
            ),
            *undriven_cases(),
            *experiments(),
        )
        runs = solve_cases(cases, pool, lambda f, what: progress(0.2 + 0.5 * f, what), store)
        return runs, found


def run_paper(*, out: Path = Path("out"), reference: bool = True, fresh: Flag = False) -> None:
    """Run, judge, tabulate, draw, and write the page.

    Parameters
    ----------
    out
        Folder for paper/: index.html, ledger.csv, figures.
    reference
        Whether to run the ls-dyna-like reference too; its rows are not judged without it.
    fresh
        Run everything again; without it a run that is unchanged is read back from OUT/store.

    Raises
    ------
    UserError
        The output folder cannot be written: nothing was run.
    """
    folder = output_folder(out / "paper")
    figures, runs_folder = (output_folder(folder / name) for name in ("figures", "runs"))
    claims = read_claims()
    store = Store(out / "store", fresh)
    with progress_bar("paper") as progress:
        runs, found = solve_all(progress, store)
        progress(0.7, "time and memory of the reduced model")
        alone = run_alone(runs_folder, "hcm", (), "", store)
        references = References({})
        if reference:
            references = run_references(
                lambda changes, name: run_alone(runs_folder, "fem3d", changes, name, store),
                lambda share, what: progress(0.75 + 0.15 * share, what),
            )
        progress(0.9, "ledger and figures")
        findings = {
            **validation_rows.measure(runs, alone, references),
            **friction_rows.measure(runs),
            **compliance_rows.measure(runs),
            **driven_rows.measure(runs, found),
        }
        rows = ledger(claims, findings)
        write_table(folder, "ledger", ledger_table(rows), "Every number that the paper prints")
        drawn = draw(figures, runs, references.judged)
        settled, total = score(rows, claims)
        counts = Counter(row.verdict for row in rows)
        page = folder / "index.html"
        context = {
            "rows": rows,
            "counts": {verdict: counts[verdict] for verdict in VERDICTS},
            "settled": settled,
            "total": total,
            "factor": found.common,
            "found": found,
            "lasting": [driven_rows.duration_ms(runs[name]) for name in DRAWN_TWICE],
            "figures": drawn,
            "with_reference": bool(references.judged),
            "provenance": provenance({}),
        }
        write_page(page, "paper.html.j2", context)
    print("; ".join(f"{verdict}: {counts[verdict]}" for verdict in VERDICTS))
    print(f"rows that concern hcm: {settled} of {total} reproduced or self-contradicting")
    factor = found.common
    print(f"t_3 factor: {factor.factor:.4g} +- {factor.uncertainty:.2g} N m per printed unit")
    print(f"page: {page}")
