"""Judge many scenes over all cores; every verdict is stored as soon as it is there.

Judges do not import it: a verdict depends on the code of its judge, not on who asked for it.
"""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from validation.harness.identity import program
from validation.harness.line_store import LineStore
from validation.harness.processes import workers
from validation.harness.provenance import cores
from validation.models.adapter import Progress


@dataclass(frozen=True)
class Case:
    """A scene and who judges it, whose result has JSON values; label : for its progress."""

    label: str
    scene: Any
    judge: Callable[[Any], Any]


def verdict_inputs(case: Case) -> dict[str, Any]:
    """What a case's verdict is made from: its scene, its judge, and the code of both."""
    judge = case.judge
    return {
        "scene": repr(case.scene),
        "judge": judge.__qualname__,
        "program": program(judge.__module__, type(case.scene).__module__),
    }


def run_cases(cases: Sequence[Case], path: Path, progress: Progress) -> list[Mapping[str, Any]]:
    """Verdicts of all cases, a row each; those that the file lacks are judged, and kept at once.

    path : of a `LineStore`. progress : of the share of cases that are done.
    """
    finished = LineStore(path)
    inputs = [verdict_inputs(case) for case in cases]
    rows = {n: row for n, of in enumerate(inputs) if (row := finished.load(of)) is not None}
    todo = [n for n in range(len(cases)) if n not in rows]
    with workers(cores()) as pool:
        running = {pool.submit(cases[n].judge, cases[n].scene): n for n in todo}
        for future in as_completed(running):
            n = running[future]
            rows[n] = vars(future.result())
            finished.keep(inputs[n], rows[n])
            progress(len(rows) / len(cases), f"{cases[n].label}, {len(rows)} of {len(cases)}")
    return [rows[n] for n in range(len(cases))]
