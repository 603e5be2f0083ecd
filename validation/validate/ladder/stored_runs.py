"""The ladder's runs and statics, computed unless a store has them."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from validation.harness.identity import program
from validation.harness.record import RunRecord, plain
from validation.harness.store import Store
from validation.harness.stored_run import keep_run, load_run
from validation.identify.contact import ContactIdentification, identify_contact
from validation.models.adapter import Outcome
from validation.models.impact import Impact
from validation.models.inputs import scene_inputs
from validation.scenes.load import NamedScene, load_scene
from validation.validate.ladder import runs
from validation.validate.ladder.runs import Contact

ARRAYS = ("force_curve_N", "indentation_curve_m", "hertz_curve_m")
VALUES = "values.json"


@dataclass(frozen=True)
class LadderRuns:
    """What `validation.validate.ladder.runs` and the identification give, kept in a store.

    Parameters
    ----------
    store : None computes everything.
    program : what the results depend on beside the scene; see `store_key.program`.
    """

    store: Store | None
    program: Mapping[str, Any]

    def reduced(self, scene: NamedScene, contact: Contact, start: Impact | None) -> RunRecord:
        """See `runs.reduced`."""
        return self._run(
            lambda: runs.reduced(scene, contact, start), scene, "hcm", "", contact, start
        )

    def lumped_solid(
        self,
        scene: NamedScene,
        contact: Contact,
        start: Impact | None,
        edges: tuple[float, float],
        tip: Literal["flat", "hemisphere"] = "flat",
    ) -> RunRecord:
        """See `runs.lumped_solid`."""
        return self._run(
            lambda: runs.lumped_solid(scene, contact, start, edges, tip),
            scene, "fem3d", None, contact, start, edges=list(edges), tip=tip,
        )  # fmt: skip

    def full_contact(
        self, source: str, overrides: Sequence[str], start: Impact | None, variant: str
    ) -> RunRecord:
        """See `runs.full_contact`."""
        return self._run(
            lambda: runs.full_contact(source, overrides, start, variant),
            load_scene(source, overrides), "fem3d", variant, None, start,
        )  # fmt: skip

    def identify(
        self, scene: NamedScene, refinements: tuple[tuple[float, float], ...]
    ) -> ContactIdentification:
        """See `identify_contact`."""
        if self.store is None:
            return identify_contact(scene, refinements)
        # the reduced model's peak and the solid's statics: both models' tables
        tables = [scene_inputs(scene.tables, model) for model in ("hcm", "fem3d")]
        inputs = {"what": "identify contact", "program": dict(self.program), "scene": tables,
                  "refinements": plain(refinements)}  # fmt: skip
        stored = self.store.load(inputs, _read_identification)
        if stored is not None:
            return replace(stored, scene=scene.name)
        found = identify_contact(scene, refinements)
        self.store.keep(inputs, lambda entry: _write_identification(entry, found))
        return found

    def _run(
        self,
        compute: Callable[[], RunRecord],
        scene: NamedScene,
        model: str,
        variant: str | None,
        contact: Contact | None,
        start: Impact | None,
        **more: Any,
    ) -> RunRecord:
        if self.store is None:
            return compute()
        inputs = {
            "what": "ladder",
            "program": dict(self.program),
            "model": model,
            **scene_inputs(scene.tables, model),
            "contact": None if contact is None else asdict(contact),
            "start": None if start is None else asdict(start),
            **more,
        }
        record = load_run(self.store, inputs)
        if record is None:
            record = compute()
            keep_run(self.store, inputs, Outcome(record))
            return record
        name = record.variant if variant is None else variant
        return replace(record, scene=scene.name, variant=name)


def ladder_runs(store: Store | None) -> LadderRuns:
    """The ladder's runs with a store, or with none."""
    return LadderRuns(store, {} if store is None else program(__name__))


def _write_identification(entry: Path, found: ContactIdentification) -> None:
    values = {field.name: getattr(found, field.name) for field in fields(found)}
    values |= {name: values[name].tolist() for name in ARRAYS}
    text = json.dumps(values, default=lambda value: asdict(value))
    (entry / VALUES).write_text(text, encoding="utf-8")


def _read_identification(entry: Path) -> ContactIdentification:
    from pydantic import TypeAdapter

    values = json.loads((entry / VALUES).read_text(encoding="utf-8"))
    values |= {name: np.array(values[name], dtype=np.float64) for name in ARRAYS}
    return TypeAdapter(ContactIdentification).validate_python(values)
