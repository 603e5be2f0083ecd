"""``fingertap paper``: every number that the paper prints, with a verdict, and its figures."""

from pathlib import Path

from validation.compare.claims import read_claims
from validation.harness.command_line import Fresh
from validation.harness.console import output, progress_bar
from validation.harness.files import exclusive_folder, output_folder
from validation.harness.page import write_page
from validation.harness.processes import workers
from validation.harness.provenance import cores
from validation.harness.record import RunRecord
from validation.harness.store import Store
from validation.harness.tables import write_table
from validation.harness.uncertainty import with_error
from validation.models.adapter import Progress, part
from validation.runs.execute import Job, in_fresh_process
from validation.studies.paper.case_runs import solve_cases
from validation.studies.paper.cases import driven_cases, experiments, undriven_cases
from validation.studies.paper.driven_findings import driven_findings
from validation.studies.paper.figures import DRAWN_TWICE, SCENES, draw_figures
from validation.studies.paper.ledger import by_place, counts, ledger, ledger_table, score
from validation.studies.paper.readings import CaseRuns, duration_ms
from validation.studies.paper.soft_findings import compliance_findings, friction_findings
from validation.studies.paper.torque_factor import IdentifiedTorque, identify_torque
from validation.studies.paper.validation_findings import (
    JUDGED,
    REDUCED,
    VARIANTS,
    References,
    validation_findings,
)


def run_scenes(
    folder: Path, store: Store, model: str, overrides: tuple[str, ...] = (), variant: str = ""
) -> dict[str, RunRecord]:
    """Run a model on both scenes, each in a process of its own; failed runs are left out."""
    records = {}
    for scene in SCENES:
        (record,) = in_fresh_process([Job(scene, model, overrides, variant)], folder, store)
        if record.ok:
            records[scene] = record
    return records


def solve_all(progress: Progress, store: Store) -> tuple[CaseRuns, IdentifiedTorque]:
    """Identify the t_3 factor, then run every case of the reduced model that is not stored."""
    with workers(cores()) as pool:
        progress(0.02, "identifying the t_3 factor")
        found = identify_torque(pool, store)
        factors = {name: fit.factor for name, fit in found.by_numerics.items()}
        common, two = found.common, found.by_case["driven-2"].best_factor
        driven = driven_cases(common.factor, common.uncertainty, two, factors)
        cases = (*driven, *undriven_cases(), *experiments())
        return solve_cases(cases, pool, store, part(progress, 0.2, 0.7)), found


def run_paper(*, out: Path = Path("out"), reference: bool = True, fresh: Fresh = False) -> None:
    """Run, judge, tabulate, draw, and write the page.

    Parameters
    ----------
    out
        Folder for paper/: index.html, ledger.csv, figures.
    reference
        Whether to run the ls-dyna-like reference too; its rows are not judged without it.
    """
    with exclusive_folder(out / "paper") as folder, progress_bar("paper") as progress:
        figures, runs_folder = (output_folder(folder / name) for name in ("figures", "runs"))
        store = Store(out / "store", fresh)
        runs, found = solve_all(progress, store)
        progress(0.7, "time and memory of the reduced model")
        references: References = {REDUCED: run_scenes(runs_folder, store, "hcm")}
        if reference:
            share = part(progress, 0.75, 0.9)
            for i, (name, overrides) in enumerate(VARIANTS.items()):
                share(i / len(VARIANTS), f"reference, {name}")
                references[name] = run_scenes(runs_folder, store, "fem3d", overrides, name)
        judged = references.get(JUDGED, {})
        progress(0.9, "ledger and figures")
        findings = {
            **validation_findings(runs, references),
            **friction_findings(runs),
            **compliance_findings(runs),
            **driven_findings(runs, found),
        }
        rows = ledger(read_claims().values(), findings)
        write_table(folder, "ledger", ledger_table(rows), "Every number that the paper prints")
        drawn = draw_figures(figures, runs, judged)
        settled, total = score(rows)
        page = folder / "index.html"
        context = {
            "rows": rows,
            "counts": counts(rows),
            "places": by_place(rows),
            "settled": settled,
            "total": total,
            "found": found,
            "lasting": [duration_ms(runs[name]) for name in DRAWN_TWICE],
            "figures": drawn,
            "with_reference": bool(judged),
        }
        write_page(page, "paper.html.j2", context)
    output("; ".join(f"{verdict}: {count}" for verdict, count in counts(rows).items()))
    output(f"rows that concern hcm: {settled} of {total} reproduced or self-contradicting")
    factor = found.common
    output(f"t_3 factor: {with_error(factor.factor, factor.uncertainty)} N m per printed unit")
    output(f"page: {page}")
