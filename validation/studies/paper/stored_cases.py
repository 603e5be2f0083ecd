"""Cases of the reduced model in a store: records with their postures."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from validation.harness.record import RunRecord, plain
from validation.harness.store import Inputs, Store
from validation.harness.stored_run import read_record, relabelled, write_record
from validation.models.inputs import run_inputs
from validation.scenes.load import load_scene
from validation.studies.paper.cases import Case

if TYPE_CHECKING:
    from hcm import Posture

POSTURES = "postures.json"
SOLVER = "validation.studies.paper.solve"  # the module that solves cases; it imports this one


@dataclass(frozen=True)
class CaseRun:
    """A case's record and postures: at every located event, and at the wanted times."""

    case: Case
    record: RunRecord
    event_postures: tuple[Posture, ...]
    frames: tuple[Posture, ...]


def load_case(store: Store, case: Case) -> CaseRun | None:
    """The case's result if it is stored.

    Raises
    ------
    UserError
        The case's overrides do not make a valid scene.
    """
    return store.load(_inputs(case), lambda entry: _read(entry, case))


def keep_case(store: Store, run: CaseRun) -> None:
    """Store a case that came to its own end; a flight that stops at the touch is one."""
    if run.record.status != "INTERRUPTED":
        store.keep(_inputs(run.case), lambda entry: _write(entry, run))


def _inputs(case: Case) -> Inputs:
    tables = load_scene(case.scene, case.overrides).tables
    return run_inputs(tables, "hcm", SOLVER, frame_times=list(case.frame_times))


def _write(entry: Path, run: CaseRun) -> None:
    write_record(entry, run.record)
    held = {"events": run.event_postures, "frames": run.frames}
    text = json.dumps({name: [_members(one) for one in several] for name, several in held.items()})
    (entry / POSTURES).write_text(text, encoding="utf-8")


def _members(posture: Posture) -> dict[str, Any]:
    return {field.name: plain(getattr(posture, field.name)) for field in fields(posture)}


def _read(entry: Path, case: Case) -> CaseRun:
    held = json.loads((entry / POSTURES).read_text(encoding="utf-8"))
    events, frames = (tuple(map(_posture, held[name])) for name in ("events", "frames"))
    document = load_scene(case.scene, case.overrides).document
    record = relabelled(read_record(entry), case.scene, case.name, document)
    return CaseRun(case, record, events, frames)


def _posture(members: Mapping[str, Any]) -> Posture:
    from hcm import Posture

    def value(member: Any) -> Any:
        if not isinstance(member, list):
            return float(member)
        return tuple(np.array(block, dtype=np.float64) for block in member)

    return Posture(**{name: value(member) for name, member in members.items()})
