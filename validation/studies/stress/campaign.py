"""Run the cells that are not finished; every verdict is stored as soon as it is there."""

from collections.abc import Sequence
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


def judge_cell(cell: Cell) -> dict[str, Any]:
    """A cell's verdict as a row."""
    return dict(vars(cell.judge(cell.scene)))


def run_cells(
    cells: Sequence[Cell], finished: LineStore, pool: Workers, progress: Progress
) -> None:
    """Judge what is not finished; progress is the share of cells that are done."""
    todo = [cell for cell in cells if finished.load(verdict_inputs(cell)) is None]
    running = {pool.submit(judge_cell, cell): cell for cell in todo}
    for done, future in enumerate(as_completed(running), len(cells) - len(todo) + 1):
        cell = running[future]
        finished.keep(verdict_inputs(cell), future.result())
        progress(done / len(cells), f"{cell.map}, {done} of {len(cells)} cells")
