"""Points of a benchmark that was stopped, read back by the next one if that is asked for."""

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from validation.compare.tap_errors import TapErrors
from validation.harness.identity import program
from validation.harness.store import Store
from validation.models.inputs import OTHERS
from validation.studies.bench.measured import Point

NAME = "point.json"


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
        found = self._store.load(inputs, read)
        if found is not None:
            self.read_back += 1
            return found
        point = measure()
        self._store.keep(inputs, lambda entry: write(entry, point))
        return point


def write(entry: Path, point: Point) -> None:
    """Write a point into a folder."""
    (entry / NAME).write_text(json.dumps(dataclasses.asdict(point)), encoding="utf-8")


def read(entry: Path) -> Point:
    """The point that `write` wrote, bit for bit.

    Raises
    ------
    ValueError, TypeError, KeyError
        The file is no point.
    """
    values = json.loads((entry / NAME).read_text(encoding="utf-8"))
    errors = values.pop("errors")
    return Point(**values, errors=None if errors is None else TapErrors(**errors))
