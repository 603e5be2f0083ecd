"""Run many cases of the reduced model on all cores, keeping what figures and ledger need."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from validation.models.adapter import to_record
from validation.models.hcm import translate
from validation.paper.cases import Case
from validation.record import RunRecord
from validation.scenes.load import load_scene

if TYPE_CHECKING:
    from hcm import Posture

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class CaseRun:
    """A case's record and postures: at every located event, and at the wanted times."""

    case: Case
    record: RunRecord
    event_postures: tuple[Posture, ...]
    frames: tuple[Posture, ...]


def solve_case(case: Case) -> CaseRun:
    """Run one case.

    Raises
    ------
    UserError
        The case's overrides do not make a valid scene.
    """
    import hcm

    scene = load_scene(case.scene, case.overrides)
    arguments = translate(scene)
    arguments["settings"] = replace(arguments["settings"], frame_times=case.frame_times)
    result = hcm.simulate(**arguments)
    record = to_record(result, scene, "hcm", case.name, result.statistics.wall_time_s)
    return CaseRun(case, record, result.event_postures, result.frames)


@contextmanager
def workers(count: int) -> Iterator[Executor]:
    """Processes that start afresh, so that none inherits another library's threads."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(count, mp_context=context) as pool:
        yield pool


def solve_cases(cases: Sequence[Case], pool: Executor, progress: Progress) -> Mapping[str, CaseRun]:
    """Run all cases; the result is in the order of the cases, by name."""
    futures = {pool.submit(solve_case, case): case.name for case in cases}
    done = {}
    for future in as_completed(futures):
        done[futures[future]] = future.result()
        progress(len(done) / len(cases), futures[future])
    return {case.name: done[case.name] for case in cases}
