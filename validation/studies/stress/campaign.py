"""Run the cells that are not finished; every verdict is stored as soon as it is there."""

import os
from collections.abc import Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from itertools import islice
from typing import Any

from validation.harness.identity import program
from validation.harness.line_store import LineStore
from validation.harness.processes import Workers
from validation.models.adapter import Progress
from validation.studies.stress.stability_map import Cell

AHEAD = 4  # cells that wait, per process


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
    done = len(cells) - len(todo)
    waiting = iter(todo)
    running: dict[Future[dict[str, Any]], Cell] = {}

    def submit(count: int) -> None:
        for cell in islice(waiting, count):
            running[pool.submit(judge_cell, cell)] = cell

    submit(AHEAD * (os.cpu_count() or 1))
    try:
        while running:
            ready, _ = wait(running, return_when=FIRST_COMPLETED)
            # what has succeeded is kept before a failure is raised
            for future in sorted(ready, key=lambda job: job.exception() is not None):
                cell = running.pop(future)
                finished.keep(verdict_inputs(cell), future.result())
                done += 1
                progress(done / len(cells), f"{cell.map}, {done} of {len(cells)} cells")
                submit(1)
    finally:
        for future in running:
            future.cancel()
