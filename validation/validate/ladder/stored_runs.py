"""The ladder's runs and statics, computed unless a store has them."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

import numpy as np

from validation.harness.identity import program
from validation.harness.record import RunRecord, plain
from validation.harness.store import NO_STORE, Store, json_format
from validation.harness.stored_run import keep_run, load_run
from validation.identify.contact import ContactIdentification, identify_contact
from validation.models.impact import Impact
from validation.models.inputs import scene_inputs
from validation.scenes.load import NamedScene, load_scene
from validation.validate.ladder import runs
from validation.validate.ladder.runs import Contact

ARRAYS = ("force_curve_N", "indentation_curve_m", "hertz_curve_m")
IDENTIFICATION = json_format(ContactIdentification)


@dataclass(frozen=True)
class LadderRuns:
    """What `validation.validate.ladder.runs` and the identification give, kept in a store."""

    store: Store = NO_STORE

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
        # the reduced model's peak and the solid's statics: both models' tables
        tables = [scene_inputs(scene.tables, model) for model in ("hcm", "fem3d")]
        inputs = {"program": program(identify_contact.__module__), "scene": tables,
                  "refinements": plain(refinements)}  # fmt: skip
        found: ContactIdentification = self.store.obtain(
            inputs, IDENTIFICATION, lambda: identify_contact(scene, refinements)
        )
        curves: dict[str, Any] = {name: np.array(getattr(found, name)) for name in ARRAYS}
        return replace(found, scene=scene.name, **curves)

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
        inputs = {
            "program": program(runs.__name__),
            "model": model,
            **scene_inputs(scene.tables, model),
            "contact": None if contact is None else asdict(contact),
            "start": None if start is None else asdict(start),
            **more,
        }
        record = load_run(self.store, inputs)
        if record is None:
            record = compute()
            keep_run(self.store, inputs, record)
        return replace(
            record, scene=scene.name, variant=record.variant if variant is None else variant
        )
