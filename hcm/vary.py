"""Scenes that differ in some of their numbers, from columns of values."""

from collections.abc import Iterator, Mapping, Sequence, Set, Sized
from dataclasses import fields, replace
from typing import Any

import numpy as np

from hcm.bounds import check_kind
from hcm.model import Scene
from hcm.parameters import Finger, ParameterError

NO_COLUMN = Mapping, Set, str, bytes, bytearray  # sized, but without a value per scene


def vary(scene: Scene, columns: Mapping[str, Sequence[Any]]) -> Iterator[Scene | ParameterError]:
    """Scenes like `scene`, one for each row of the columns, or the errors that refuse rows.

    Parameters
    ----------
    columns : values by dotted field (``surface.friction``); ``phalanx`` means all phalanges.

    Raises
    ------
    ParameterError
        `scene` is none, there are no columns, or one is not a list, names no field or is of
        another length.
    """
    check_kind("scene", scene, Scene)
    check_kind("columns", columns, Mapping)
    parts = {f.name for f in fields(Scene)} - {"finger", "start"} | {"phalanx"}
    columns = {
        name: np.asanyarray(column).tolist() if hasattr(column, "__array__") else column
        for name, column in columns.items()
    }
    for name, column in columns.items():
        if not isinstance(column, Sized) or isinstance(column, NO_COLUMN):
            raise ParameterError(f"column {name!r}: must be a list, one value a scene")
        part, _, of = str(name).partition(".")
        owner = scene.finger.phalanges[0] if part == "phalanx" else getattr(scene, part, None)
        if part not in parts or of not in {f.name for f in fields(owner)}:  # type: ignore[arg-type]
            raise ParameterError(f"column {name!r}: must be a field of {', '.join(sorted(parts))}")
    size = {len(column) for column in columns.values()}
    if not size:
        raise ParameterError("columns = {}: must hold one column or more")
    if len(size) > 1:
        raise ParameterError(f"columns have {sorted(size)} rows: must be of one length")
    return _varied(scene, columns)


def _varied(scene: Scene, columns: Mapping[str, Sequence[Any]]) -> Iterator[Scene | ParameterError]:
    for row in zip(*columns.values(), strict=True):
        changes: dict[str, dict[str, Any]] = {}
        for name, value in zip(columns, row, strict=True):
            part, _, of = name.partition(".")
            plain = value.tolist() if hasattr(value, "tolist") else value
            changes.setdefault(part, {})[of] = tuple(plain) if isinstance(plain, list) else plain
        try:
            phalanx = changes.pop("phalanx", None)
            given = {part: replace(getattr(scene, part), **of) for part, of in changes.items()}
            if phalanx:
                links = tuple(replace(p, **phalanx) for p in scene.finger.phalanges)
                given["finger"] = Finger(links)
            yield replace(scene, **given)
        except ParameterError as error:
            yield error
