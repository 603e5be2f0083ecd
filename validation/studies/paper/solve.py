"""Run many cases of the reduced model on all cores, keeping what figures and ledger need."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import replace

from validation.harness.processes import Workers
from validation.harness.store import NO_STORE, Store
from validation.models.adapter import to_record
from validation.models.hcm import translate
from validation.scenes.load import load_scene
from validation.studies.paper.cases import Case
from validation.studies.paper.stored_cases import CaseRun, keep_case, load_case

Progress = Callable[[float, str], None]


def solve_case(case: Case, store: Store = NO_STORE) -> CaseRun:
    """Run one case and store it.

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
    keep_case(store, run)
    return run


def solve_cases(
    cases: Sequence[Case], pool: Workers, progress: Progress, store: Store = NO_STORE
) -> Mapping[str, CaseRun]:
    """Run all cases that are not stored; the result is in the order of the cases, by name."""
    done: dict[str, CaseRun] = {}
    futures = {}
    for case in cases:
        found = load_case(store, case)
        if found is None:
            futures[pool.submit(solve_case, case, store)] = case.name
        else:
            done[case.name] = found
    for future in as_completed(futures):
        done[futures[future]] = future.result()
        progress(len(done) / len(cases), futures[future])
    return {case.name: done[case.name] for case in cases}
