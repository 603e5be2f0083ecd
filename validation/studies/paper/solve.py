"""Run many cases of the reduced model on all cores, keeping what figures and ledger need."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import replace

from validation.harness.workers import Workers
from validation.models.adapter import to_record
from validation.models.hcm import translate
from validation.scenes.load import load_scene
from validation.studies.paper.cases import Case
from validation.studies.paper.stored_cases import CaseRun, CaseStore

Progress = Callable[[float, str], None]


def solve_case(case: Case, stored: CaseStore | None = None) -> CaseRun:
    """Run one case, and store it if there is a store.

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
    run = CaseRun(case, record, tuple(result.event_postures), tuple(result.frames))
    if stored is not None:
        stored.keep(run)
    return run


def solve_cases(
    cases: Sequence[Case], pool: Workers, progress: Progress, stored: CaseStore | None = None
) -> Mapping[str, CaseRun]:
    """Run all cases that are not stored; the result is in the order of the cases, by name."""
    done: dict[str, CaseRun] = {}
    futures = {}
    for case in cases:
        found = None if stored is None else stored.load(case)
        if found is None:
            futures[pool.submit(solve_case, case, stored)] = case.name
        else:
            done[case.name] = found
    for future in as_completed(futures):
        done[futures[future]] = future.result()
        progress(len(done) / len(cases), futures[future])
    return {case.name: done[case.name] for case in cases}
