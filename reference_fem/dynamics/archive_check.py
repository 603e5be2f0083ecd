"""Whether the arrays of a restart file are those of this run: names, types, shapes, finite numbers.

A checksum shows that a file is what was written, not that a run wrote it.
"""

from collections.abc import Mapping
from dataclasses import fields

import numpy as np

from reference_fem.contact.law import COLUMNS
from reference_fem.dynamics.coarse_flight import CoarseFlight
from reference_fem.dynamics.recorder import SINGLE, THINNED, Fields
from reference_fem.dynamics.restart import Arrays
from reference_fem.dynamics.state import LoopState, State, Tap, pack
from reference_fem.model import Model
from reference_fem.results.result import Sample

# Parts of the tap in a loop state: it has none of these, or all.
_OF_A_TAP = ("tap.first_touch_s", "tap.last_touch_s", "tap.tip_velocity")


def check_archive(model: Model, archive: Arrays, flight: CoarseFlight | None) -> None:
    """Check the arrays that a loop state and a recorder are to be made from.

    A state in a coarse flight is on the flight's mesh, with nothing recorded yet.

    Raises ValueError: names the array and what is wrong.
    """
    if flight is not None and archive.get("coarse", False):
        model = flight.model
    whole, points = model.points.shape, model.points.shape[:1]
    memory = model.contact.new_memory(np.zeros(whole), 0.0)
    angles = np.zeros(model.couples.joints.size)
    state = State(0, 0.0, np.zeros(whole), np.zeros(whole), memory, 0.0, 0.0, 0.0, angles, 0.0)
    touched = any(name in archive for name in _OF_A_TAP)
    left_out = ("origin_energy_J", *(() if touched else _OF_A_TAP))
    for name, array in pack(LoopState(state, 0.0, Tap(0.0, 0.0, False, (0.0, 0.0)))).items():
        if name in archive or name not in left_out:
            _check(archive, name, array.shape, array.dtype.kind)
    samples = {f.name: () for f in fields(Sample)} | {
        "tip_position_m": (2,),
        "tip_velocity_m_per_s": (2,),
        "hinge_reactions_N": (model.hinges.size, 2),
    }
    shown = {f.name: () for f in fields(Fields)} | {
        "displacement": whole,
        "velocity": whole,
        "pressure": points,
    }
    shapes = {Sample: samples, Fields: shown}
    for group, kind in THINNED.items():
        _check(archive, f"{group}.counts", (2,), "i")
        if archive[f"{group}.counts"].min() < 0 or archive[f"{group}.counts"][0] == 0:
            raise ValueError(f"{group}.counts are not a stride and a count")
        _check_group(archive, group, shapes[kind])
    for group, kind in SINGLE.items():
        _check_group(archive, group, shapes[kind], most=1)
    if "log" in archive or "log.time" in archive:
        _check_rows(archive, {"log": (COLUMNS,), "log.time": ()})


def _check_group(
    archive: Arrays, group: str, shapes: Mapping[str, tuple[int, ...]], most: int | None = None
) -> None:
    """Check the columns of a recorder's items; without items there are no columns."""
    if any(f"{group}.{name}" in archive for name in shapes):
        _check_rows(archive, {f"{group}.{name}": shape for name, shape in shapes.items()}, most)


def _check_rows(
    archive: Arrays, shapes: Mapping[str, tuple[int, ...]], most: int | None = None
) -> None:
    """Check columns of one length, each row of its shape."""
    first = archive.get(next(iter(shapes)))
    count = 0 if first is None or first.ndim == 0 else len(first)
    if most is not None and count > most:
        raise ValueError(f"{next(iter(shapes))} has {count} rows for at most {most}")
    for name, shape in shapes.items():
        # samples of a run that diverges, and the gap in flight, need not be finite
        _check(archive, name, (count, *shape), finite=False)


def _check(
    archive: Arrays, name: str, shape: tuple[int, ...], kind: str = "f", finite: bool = True
) -> None:
    """Check that an array is there, of this shape and kind of type, and finite if it must be."""
    if name not in archive:
        raise ValueError(f"{name} is missing")
    array = archive[name]
    if array.shape != shape or array.dtype.kind != kind:
        raise ValueError(f"{name} is {array.dtype}{array.shape} instead of {kind}{shape}")
    if finite and kind == "f" and not np.isfinite(array).all():
        raise ValueError(f"{name} is not finite")
