"""Run the cells that are not finished; every verdict is stored as soon as it is reached.

Judges do not import this module: a verdict depends on its judge's code, not on the caller's.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import as_completed
from typing import Any

from validation.harness.identity import program
from validation.harness.line_store import LineStore
from validation.harness.processes import Workers
from validation.models.adapter import Progress
from validation.studies.stress.stability_map import Cell


def verdict_inputs(cell: Cell) -> dict[str, Any]:
    """What a cell's verdict is made from: its scene, its judge, and the code of both."""
    judge = cell.judge
    return {
        "scene": repr(cell.scene),
        "judge": judge.__qualname__,
        "program": program(judge.__module__, type(cell.scene).__module__),
    }


def run_cells(
    cells: Sequence[Cell], finished: LineStore, pool: Workers, progress: Progress
) -> list[Mapping[str, Any]]:
    """Verdicts of all cells, one row each; cells that are not finished are judged and then stored.

    progress is the share of cells that are done.
    """
    inputs = [verdict_inputs(cell) for cell in cells]
    rows = {n: row for n, of in enumerate(inputs) if (row := finished.load(of)) is not None}
    todo = [n for n in range(len(cells)) if n not in rows]
    running = {pool.submit(cells[n].judge, cells[n].scene): n for n in todo}
    for future in as_completed(running):
        n = running[future]
        rows[n] = vars(future.result())
        finished.keep(inputs[n], rows[n])
        progress(len(rows) / len(cells), f"{cells[n].map}, {len(rows)} of {len(cells)} cells")
    return [rows[n] for n in range(len(cells))]
