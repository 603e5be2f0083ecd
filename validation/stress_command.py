"""``fingertap stress``: stability maps, every cell checked by what did not produce it."""

import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from itertools import islice
from pathlib import Path
from typing import Any

from validation.console import progress_bar
from validation.errors import RunFailedError
from validation.paper.solve import workers
from validation.storage import output_folder
from validation.stress.cells import ANSWERS, RIGHT, SMALLER, STOPPED, WRONG, judge
from validation.stress.figures import draw_map
from validation.stress.finished import Finished
from validation.stress.maps import Cell, Map, hcm_maps
from validation.tables import write_table

BATCH = 8  # cells a process takes at once: most take less time than handing them over
AHEAD = 4  # batches that wait, per process


def judge_batch(cells: Sequence[Cell]) -> list[dict[str, Any]]:
    """Verdicts of some cells, in order."""
    return [judge(cell.scene, cell.compare).row() for cell in cells]


def _batches(cells: Iterable[Cell]) -> Iterator[list[Cell]]:
    source = iter(cells)
    while batch := list(islice(source, BATCH)):
        yield batch


def run_cells(
    cells: Sequence[Cell],
    finished: Finished,
    pool: Executor,
    progress: Callable[[float, str], None],
) -> None:
    """Run the cells that are not finished; every verdict is kept as soon as it is there."""
    todo = [cell for cell in cells if finished.get(cell) is None]
    done = len(cells) - len(todo)
    batches = _batches(todo)
    running: dict[Future[list[dict[str, Any]]], list[Cell]] = {}

    def submit(count: int) -> None:
        for batch in islice(batches, count):
            running[pool.submit(judge_batch, batch)] = batch

    submit(AHEAD * (os.cpu_count() or 1))
    try:
        while running:
            ready, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in ready:
                batch = running.pop(future)
                for cell, verdict in zip(batch, future.result(), strict=True):
                    finished.add(cell, verdict)
                done += len(batch)
                progress(0.95 * done / len(cells), f"{batch[0].map}, {done} of {len(cells)} cells")
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


def limit(rows: Sequence[Mapping[str, Any]]) -> str:
    """What ended the cells that have no right answer, as the cells themselves say."""
    reasons = Counter(
        str(row["reason"]).partition(" at t =")[0] if row["answer"] == STOPPED else row["answer"]
        for row in rows
        if row["answer"] not in (RIGHT, SMALLER)
    )
    told = [f"{reason} ({count} of {len(rows)})" for reason, count in reasons.most_common()]
    return "limited by " + ", ".join(told) if told else "every cell is right"


def draw(folder: Path, wanted: Map, finished: Finished) -> None:
    """A map's figure, unless it is a list of scenes rather than a plane."""
    if len(wanted.y) == 1:
        return
    answers = {
        (cell.x, cell.y, cell.panel): str(verdict["answer"])
        for cell in wanted.cells()
        if (verdict := finished.get(cell)) is not None
    }
    draw_map(folder / f"{wanted.name}.png", wanted, answers, limit(table_rows(wanted, finished)))


def run_stress(quick: bool, out: Path) -> None:
    """Run all maps of the reduced model, tabulate, draw, and count the answers.

    Raises
    ------
    UserError
        The output folder cannot be written: nothing was run.
    RunFailedError
        A cell is wrong and silent, or a process died; the finished cells are kept.
    """
    import pandas as pd

    folder = output_folder(out / "stress" / ("hcm-quick" if quick else "hcm"))
    finished = Finished(folder / "cells.jsonl")
    maps = hcm_maps(quick)
    cells = [cell for wanted in maps for cell in wanted.cells()]
    with progress_bar("stress") as progress:
        try:
            with workers(os.cpu_count() or 1) as pool:
                run_cells(cells, finished, pool, progress)
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
            write_table(folder, wanted.name, pd.DataFrame(rows), f"Map {wanted.name}: hcm")
            draw(folder, wanted, finished)
            own = Counter(row["answer"] for row in rows)
            counts += own
            summary.append({"map": wanted.name, "cells": len(rows),
                            **{answer: own[answer] for answer in ANSWERS},
                            "what limits it": limit(rows)})  # fmt: skip
        write_table(folder, "summary", pd.DataFrame(summary), "Answers by map: hcm")
    for line in summary:
        told = ", ".join(f"{line[answer]} {answer}" for answer in ANSWERS if line[answer])
        print(f"{line['map']:<28}{line['cells']:>6} cells: {told}")
    print(f"files in {folder}")
    if counts[WRONG]:
        raise RunFailedError(f"{counts[WRONG]} cells are wrong and silent; see {folder}")
