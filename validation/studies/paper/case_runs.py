"""Cases of the reduced model: solved on all cores, stored with their postures, read back."""

from collections.abc import Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import hcm
from hcm.results.posture import Postures
from validation.harness.processes import Workers
from validation.harness.record import RunRecord
from validation.harness.store import NO_STORE, Inputs, Store
from validation.harness.stored_run import read_record, relabelled, write_record
from validation.models.adapter import Progress, to_record
from validation.models.hcm import hcm_scene
from validation.models.inputs import run_inputs
from validation.scenes.load import load_scene

EVENTS, FRAMES = "event_postures.npz", "frames.npz"


@dataclass(frozen=True)
class Case:
    """One run of the reduced model: a built-in scene, overrides, and times of wanted postures."""

    name: str
    scene: str
    overrides: tuple[str, ...] = ()
    frame_times: tuple[float, ...] = ()


@dataclass(frozen=True)
class CaseRun:
    """A case's record and postures: at every located event, and at the wanted times."""

    case: Case
    record: RunRecord
    event_postures: Sequence[hcm.Posture]
    frames: Sequence[hcm.Posture]


def solve_case(case: Case, store: Store = NO_STORE) -> CaseRun:
    """Run one case and store it."""
    scene = load_scene(case.scene, case.overrides)
    given = hcm_scene(scene, estimate=True)
    settings = replace(given.settings, frame_times=case.frame_times)
    result = hcm.simulate_scene(replace(given, settings=settings))
    record = to_record(result, scene, "hcm", case.name)
    run = CaseRun(case, record, result.event_postures, result.frames)
    keep_case(store, run)
    return run


def solve_cases(
    cases: Sequence[Case],
    pool: Workers,
    store: Store = NO_STORE,
    progress: Progress = lambda share, what: None,
) -> Mapping[str, CaseRun]:
    """Run all cases that are not stored; the result is in the order of the cases, by name."""
    done = {case.name: run for case in cases if (run := load_case(store, case)) is not None}
    waiting = [case for case in cases if case.name not in done]
    futures = {pool.submit(solve_case, case, store): case.name for case in waiting}
    for future in as_completed(futures):
        done[futures[future]] = future.result()
        progress(len(done) / len(cases), futures[future])
    return {case.name: done[case.name] for case in cases}


def load_case(store: Store, case: Case) -> CaseRun | None:
    """The case's result if it is stored."""
    return store.load(_inputs(case), lambda entry: _read(entry, case))


def keep_case(store: Store, run: CaseRun) -> None:
    """Store a case unless it was interrupted; a flight that stops at the touch is complete."""
    if run.record.status != "INTERRUPTED":
        store.keep(_inputs(run.case), lambda entry: _write(entry, run))


def _inputs(case: Case) -> Inputs:
    tables = load_scene(case.scene, case.overrides).tables
    return run_inputs(tables, "hcm", __name__, frame_times=list(case.frame_times))


def _write(entry: Path, run: CaseRun) -> None:
    write_record(entry, run.record)
    for name, kept in ((EVENTS, run.event_postures), (FRAMES, run.frames)):
        np.savez(entry / name, **{k: v for k, v in vars(kept).items() if v is not None})


def _read(entry: Path, case: Case) -> CaseRun:
    def postures(name: str) -> Postures:
        with np.load(entry / name, allow_pickle=False) as file:
            held: dict[str, Any] = {key: file[key] for key in file.files}
        return Postures(**{**held, "times_s": tuple(held["times_s"].tolist())})

    document = load_scene(case.scene, case.overrides).document
    record = relabelled(read_record(entry), case.scene, case.name, document)
    return CaseRun(case, record, postures(EVENTS), postures(FRAMES))
