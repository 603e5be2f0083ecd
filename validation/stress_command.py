"""``fingertap stress``: stability maps, every cell checked by what did not produce it."""

import os
from collections import Counter
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

from validation.console import progress_bar
from validation.errors import RunFailedError
from validation.storage import output_folder
from validation.stress.campaign import draw, limit, run_cells, table_rows
from validation.stress.collection import all_maps
from validation.stress.finished import Finished
from validation.stress.frame import ANSWERS, WRONG
from validation.tables import write_table
from validation.workers import workers


def run_stress(quick: bool, only: str | None, out: Path) -> None:
    """Run all maps, or those of one solver; tabulate, draw, and count the answers.

    Raises
    ------
    UserError
        The output folder cannot be written: nothing was run.
    RunFailedError
        A cell is wrong and silent, or a process died; the finished cells are kept.
    """
    import pandas as pd

    folder = output_folder(out / "stress" / ("quick" if quick else "full"))
    finished = Finished(folder / "cells.jsonl")
    maps = [wanted for wanted in all_maps(quick) if only in (None, wanted.solver)]
    cells = [cell for wanted in maps for cell in wanted.cells()]
    with progress_bar("stress") as progress:
        try:
            with workers(os.cpu_count() or 1) as pool:
                run_cells(cells, finished, pool, lambda share, text: progress(0.95 * share, text))
        except BrokenProcessPool as error:
            raise RunFailedError(
                f"a process of the campaign died; what was finished is kept in {folder}:"
                " the same command goes on"
            ) from error
        counts: Counter[str] = Counter()
        summary = []
        for wanted in maps:
            progress(0.97, f"tables and figures, {wanted.name}")
            rows = table_rows(wanted, finished)
            caption = f"Map {wanted.name}: {wanted.solver}"
            write_table(folder, wanted.name, pd.DataFrame(rows), caption)
            draw(folder, wanted, finished)
            own = Counter(row["answer"] for row in rows)
            counts += own
            summary.append({"map": wanted.name, "solver": wanted.solver, "cells": len(rows),
                            **{answer: own[answer] for answer in ANSWERS},
                            "what limits it": limit(rows)})  # fmt: skip
        write_table(folder, "summary", pd.DataFrame(summary), "Answers by map")
    for line in summary:
        told = ", ".join(f"{line[answer]} {answer}" for answer in ANSWERS if line[answer])
        print(f"{line['map']:<28}{line['cells']:>6} cells: {told}")
    print(f"files in {folder}")
    if counts[WRONG]:
        raise RunFailedError(f"{counts[WRONG]} cells are wrong and silent; see {folder}")
