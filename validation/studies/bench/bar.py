"""The reference and other programs on one bar, one after the other: updates/s and displacement.

A program that is not installed is left out; one that fails gets a row that says how.
"""

import subprocess
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numba

from validation.errors import RunFailedError
from validation.harness.provenance import version
from validation.models.adapter import Progress
from validation.peers import own_bar
from validation.peers.bar import TIMEOUT_S, Bar, BarRun
from validation.peers.bar_programs import PROGRAMS, BarProgram

BAR = Bar((100, 25, 24), 60, 2)
QUICK_BAR = Bar((40, 10, 10), 60, 2)
OWN = "fingertap"


@dataclass(frozen=True)
class BarRow:
    """One code and element with its run, or why there is none."""

    code: str
    version: str
    licence: str
    element: str
    bar: Bar
    ran: BarRun | None
    status: str = "COMPLETED"

    @property
    def updates_per_s(self) -> float:
        """Element updates per second of whole steps; 0 for a program that failed."""
        return 0.0 if self.ran is None else self.bar.elements / self.ran.seconds_per_step


def measure_program(program: BarProgram, bar: Bar, element: str) -> BarRow:
    """Run a program; returns its row, which says how it failed if it did."""
    bar = program.taken(bar)
    head = (program.name, program.version, program.licence, element, bar)
    try:
        return BarRow(*head, program.run_bar(bar, element))
    except subprocess.TimeoutExpired:
        return BarRow(*head, None, f"stopped after {TIMEOUT_S:g} s")
    except (RunFailedError, RuntimeError, OSError, ValueError) as error:
        return BarRow(*head, None, f"failed: {error}")


def measure_bar(bar: Bar, progress: Progress) -> list[BarRow]:
    """Run the reference, every installed program, and the reference again: its best time counts.

    All use as many threads as the bar asks for and numba may use; where a program can't, the
    reference is also measured on the program's.
    """
    bar = replace(bar, threads=min(bar.threads, numba.config.NUMBA_NUM_THREADS))
    cases = [(program, e) for program in PROGRAMS if program.present for e in program.elements]

    bars = dict.fromkeys([bar, *(program.taken(bar) for program, _ in cases)])
    own = list(product(bars, own_bar.POINTS))

    def own_runs() -> list[BarRun]:
        return [own_bar.run_bar(*one) for one in own]

    progress(0.0, "the bar in the reference")
    first, rows = own_runs(), list[BarRow]()
    for number, (program, element) in enumerate(cases):
        progress(0.1 + 0.8 * number / len(cases), f"the bar in {program.name}, {element}")
        rows.append(measure_program(program, bar, element))
    progress(0.9, "the bar in the reference")
    ours = [
        BarRow(OWN, version("fingertap"), "BSD-3-Clause", element, of,
               min(runs, key=lambda ran: ran.seconds_per_step))
        for (of, element), *runs in zip(own, first, own_runs(), strict=True)
    ]  # fmt: skip
    return ours + rows


def table(rows: list[BarRow]) -> list[dict[str, Any]]:
    """One row per code and element, with how many times as fast the reference is.

    ``hex8_sri_over_it`` compares with the reference's 8-point hexahedron, ``same_points_over_it``
    with its hexahedron of as many points, both on as many threads.
    """
    own = [(row.updates_per_s, row.bar.threads, row.ran) for row in rows if row.code == OWN]
    speed = {(threads, ran.points): its for its, threads, ran in own if ran}
    end = next(ran.end_m for *_, ran in own if ran)
    found = []
    for row in rows:
        threads = row.bar.threads
        line: dict[str, Any] = {
            "code": row.code, "version": row.version, "licence": row.licence,
            "element": row.element, "elements": row.bar.elements, "threads": threads,
            "status": row.status,
        }  # fmt: skip
        if (ran := row.ran) is not None:
            line |= {
                "points": ran.points,
                "million_updates_per_s": row.updates_per_s / 1e6,
                "hex8_sri_over_it": speed[threads, 8] / row.updates_per_s,
                "same_points_over_it": speed[threads, ran.points] / row.updates_per_s,
                "end_displacement_um": ran.end_m * 1e6,
                "off_exact": ran.end_m / row.bar.exact_end_m - 1.0,
                "off_fingertap": ran.end_m / end - 1.0,
                "step_us": ran.step_s * 1e6,
                "runs": ran.runs,
            }
        found.append(line)
    return found
