"""``fingertap stress``: stability maps, with every cell checked independently of its solver."""

import csv
from pathlib import Path
from typing import Literal

from validation.errors import RunFailedError, UserError
from validation.harness.command_line import Flag
from validation.harness.console import output, progress_bar
from validation.harness.files import exclusive_folder
from validation.harness.processes import call_isolated
from validation.harness.tables import table_of, write_table
from validation.models.adapter import part
from validation.models.hcm import Kernels, warm_up_choices, warm_up_kernels
from validation.runs.execute import compile_in_fresh_process
from validation.studies.campaign import Case, run_cases
from validation.studies.stress.hcm.maps import hcm_maps
from validation.studies.stress.reference.maps import reference_maps
from validation.studies.stress.report import table_rows, write_map, write_stress_page
from validation.studies.stress.stability_map import Answer, Map


def all_maps(quick: bool) -> tuple[Map, ...]:
    """The maps of all solvers; `quick` has coarser axes."""
    return (*hcm_maps(quick), *reference_maps(quick))


def stored_peers(out: Path, name: str) -> list[dict[str, str]]:
    """A table that ``--peers`` left, empty if it never ran."""
    path = out / "stress" / f"{name}.csv"
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def run_peers(out: Path) -> None:
    """Run hard cells by other solvers too, naming those that are absent; tabulate the results."""
    from validation.studies.stress.hcm.hard_cells import peers_table
    from validation.studies.stress.reference.calculix_cells import ABSENT, calculix_table

    with exclusive_folder(out / "stress") as folder:
        with progress_bar("stress --peers") as progress:
            rows = peers_table(part(progress, 0.0, 0.6))
            reference = calculix_table(part(progress, 0.6, 1.0))
        tables = {
            "peers": (rows, "Ten hard cells, the same equations"),
            "peers-reference": (reference, "Hard cells of the reference, CalculiX' automatic step"),
        }
        for name, (found, caption) in tables.items():
            if not found:
                output(ABSENT)
                continue
            output(write_table(folder, name, table_of(found), caption))
    output(f"files in {folder}")


def run_stress(
    *,
    quick: Flag = False,
    only: Literal["hcm", "reference", "fuzz"] | None = None,
    peers: Flag = False,
    out: Path = Path("out"),
) -> None:
    """Run all maps, or those of one solver; tabulate, draw, and count the answers.

    Parameters
    ----------
    quick
        Coarser maps and fewer random scenes: three minutes.
    only
        The maps of one model, or the random scenes.
    peers
        Instead, hard cells by SciPy and Exudyn (extra bench) beside hcm, and by CalculiX
        (apt-get install calculix-ccx) beside the reference; missing programs are named.
    out
        Folder for stress/full/ (quick/): index.html, a CSV and a figure per map, summary.csv.
    """
    if peers:
        if quick or only:
            ignored = "--quick" if quick else f"--only {only}"
            raise UserError(f"--peers {ignored}: hard cells are ten, of both models; leave one out")
        run_peers(out)
        return
    maps = [wanted for wanted in all_maps(quick) if only in (None, wanted.solver)]
    cases = [Case(of.name, scene, of.judge) for of in maps for _, scene in of.cells()]
    wanted_folder = out / "stress" / ("quick" if quick else "full")
    with exclusive_folder(wanted_folder) as folder, progress_bar("stress") as progress:
        # a cell's time is one of its checks, and must not include compilation
        progress(0.0, "loading compiled code, compiling it the first time")
        compile_in_fresh_process(("hcm", "fem3d", "fem2d"))
        if only != "reference":
            call_isolated(warm_up_choices)
            call_isolated(warm_up_kernels, Kernels(refined=True))
        verdicts = iter(run_cases(cases, folder / "cells.jsonl", part(progress, 0.0, 0.95)))
        summary = []
        for wanted in maps:
            progress(0.97, f"tables and figures, {wanted.name}")
            summary.append(write_map(folder, wanted, table_rows(wanted, verdicts)))
        write_table(folder, "summary", table_of(summary), "Answers by map")
        found = [stored_peers(out, name) for name in ("peers", "peers-reference")]
        write_stress_page(folder, summary, *found)
    for line in summary:
        answers = ", ".join(f"{line[answer]} {answer}" for answer in Answer if line[answer])
        output(f"{line['map']:<28}{line['cells']:>6} cells: {answers}")
    output(f"files in {folder}")
    if wrong := sum(line[Answer.WRONG] for line in summary):
        raise RunFailedError(f"{wrong} cells are wrong and silent; see {folder}")
