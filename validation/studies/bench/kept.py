"""Points of a benchmark that was stopped, read back by the next one if that is asked for."""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

from validation.harness.identity import program
from validation.harness.store import Store, json_format
from validation.models.inputs import OTHERS
from validation.studies.bench.measured import Point

POINT = json_format(Point)


class Kept:
    """Points by what they were measured from: the setting, the program, the machine.

    Parameters
    ----------
    folder : where points are kept as soon as they are there.
    resume : whether points of an earlier benchmark count; otherwise all are measured anew.
    """

    def __init__(self, folder: Path, resume: bool) -> None:
        self._store = Store(folder, fresh=not resume)
        self.read_back = 0

    def point(self, model: str, setting: Any, measure: Callable[[], Point], **more: Any) -> Point:
        """The point of a setting, measured unless it is there.

        Parameters
        ----------
        setting : a dataclass of JSON values, of the module that measures it.
        more : what else decides the point, as JSON values: the truth that it is compared with.
        """
        made_by = program(
            f"validation.models.{model}", type(setting).__module__, without=OTHERS[model]
        )
        inputs = {"point": dataclasses.asdict(setting), "model": model, "program": made_by, **more}
        self.read_back += self._store.has(inputs)
        point: Point = self._store.obtain(inputs, POINT, measure)
        return point
