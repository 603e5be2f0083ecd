"""The ladder's runs and statics, computed unless a store has them."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any, Concatenate, ParamSpec

from validation.errors import UserError
from validation.harness.identity import program
from validation.harness.record import RunRecord, plain
from validation.harness.store import NO_STORE, Store
from validation.harness.stored_run import keep_run, load_run
from validation.identify.contact import ContactIdentification, identify_contact
from validation.models.impact import Impact
from validation.models.inputs import scene_inputs
from validation.scenes.load import NamedScene
from validation.validate.ladder import runs
from validation.validate.ladder.runs import Contact

P = ParamSpec("P")


@dataclass(frozen=True)
class LadderRuns:
    """Results of `validation.validate.ladder.runs` and of the identification, kept in a store."""

    store: Store = NO_STORE

    def obtain(
        self,
        simulate: Callable[Concatenate[NamedScene, P], RunRecord],
        scene: NamedScene,
        *given: P.args,
        **named: P.kwargs,
    ) -> RunRecord:
        """The record of ``simulate(scene, *given, **named)``, a function of the module `runs`.

        Raises UserError: a solid refuses the scene.
        """
        inputs = {
            "program": program(runs.__name__),
            "simulate": simulate.__name__,
            **scene_inputs(scene.tables, "hcm" if simulate is runs.reduced else "fem3d"),
            "given": [_json(value) for value in given],
            "named": {name: _json(value) for name, value in named.items()},
        }
        record = load_run(self.store, inputs)
        if record is None:
            try:
                record = simulate(scene, *given, **named)
            except ValueError as error:  # what a solid or its mesh refuses
                raise UserError(str(error)) from error
            keep_run(self.store, inputs, record)
        return replace(record, scene=scene.name)

    def identify(
        self, scene: NamedScene, refinements: tuple[tuple[float, float], ...]
    ) -> ContactIdentification:
        """The result of `identify_contact`, kept in the store."""
        # it depends on the reduced model's peak and the solid's statics: both models' tables
        tables = [scene_inputs(scene.tables, model) for model in ("hcm", "fem3d")]
        inputs = {"program": program(identify_contact.__module__), "scene": tables,
                  "refinements": plain(refinements)}  # fmt: skip
        found = self.store.obtain(
            inputs, ContactIdentification, lambda: identify_contact(scene, refinements)
        )
        return replace(found, scene=scene.name)


def _json(value: Any) -> Any:
    return plain(asdict(value) if isinstance(value, Contact | Impact) else value)
