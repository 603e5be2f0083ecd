"""Memory of what a run holds: every array once, however many names it has."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass

import numpy as np


def array_bytes(*holders: object) -> int:
    """Bytes of all arrays in dataclasses, tuples and mappings, e.g. a `Model` and a `State`.

    Views count once, with the array that they look into. Workspaces count in full, though pages of
    them that are never touched take no memory.
    """
    owners: dict[int, np.ndarray] = {}
    for holder in holders:
        for array in _arrays(holder):
            while isinstance(array.base, np.ndarray):
                array = array.base
            owners[id(array)] = array
    return sum(array.nbytes for array in owners.values())


def _arrays(holder: object) -> Iterator[np.ndarray]:
    if isinstance(holder, np.ndarray):
        yield holder
    elif is_dataclass(holder) and not isinstance(holder, type):
        for field in fields(holder):
            yield from _arrays(getattr(holder, field.name))
    elif isinstance(holder, Mapping):
        for item in holder.values():
            yield from _arrays(item)
    elif isinstance(holder, tuple | list):
        for item in holder:
            yield from _arrays(item)
