"""Run the cells that are not finished; every verdict is stored as soon as it is there."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from itertools import islice
from pathlib import Path
from typing import Any

from validation.harness.workers import Workers
from validation.studies.stress.figures import draw_map
from validation.studies.stress.finished import Finished
from validation.studies.stress.limits import limit
from validation.studies.stress.stability_map import Cell, Map

AHEAD = 4  # cells that wait, per process


def judge_cell(cell: Cell) -> dict[str, Any]:
    """A cell's verdict as a row."""
    return cell.judge(cell.scene).row()


def run_cells(
    cells: Sequence[Cell],
    finished: Finished,
    pool: Workers,
    progress: Callable[[float, str], None],
) -> None:
    """Judge what is not finished; progress is the share of cells that are done."""
    todo = [cell for cell in cells if finished.get(cell) is None]
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
                finished.add(cell, future.result())
                done += 1
                progress(done / len(cells), f"{cell.map}, {done} of {len(cells)} cells")
                submit(1)
    finally:
        for future in running:
            future.cancel()


def table_rows(wanted: Map, finished: Finished) -> list[dict[str, Any]]:
    """One row per finished cell of a map."""
    rows = []
    for cell in wanted.cells():
        verdict = finished.get(cell)
        if verdict is not None:
            where = {wanted.x_name: cell.x, wanted.y_name: cell.y}
            if wanted.panel_name:
                where[wanted.panel_name] = cell.panel
            kept = {k: v for k, v in verdict.items() if k not in ("key", "digest")}
            rows.append({**where, **kept})
    return rows


def draw(folder: Path, wanted: Map, finished: Finished) -> None:
    """A map's figure, unless it is a list of scenes rather than a plane."""
    if len(wanted.y) == 1:
        return
    answers = {
        (cell.x, cell.y, cell.panel): str(verdict["answer"])
        for cell in wanted.cells()
        if (verdict := finished.get(cell)) is not None
    }
    draw_map(
        folder / f"{wanted.name}.png", wanted, answers, limit(wanted, table_rows(wanted, finished))
    )
