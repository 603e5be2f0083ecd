"""Keeps what a run of unknown length has to show, in bounded memory."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from reference_fem.arrays import Array
from reference_fem.contact.law import GAP, NORMAL, TANGENTIAL
from reference_fem.dynamics.energy import Sample
from reference_fem.dynamics.state import State
from reference_fem.dynamics.step import Block
from reference_fem.model import Model
from reference_fem.result import ForceRecord, History, Snapshot

T = TypeVar("T")


class Thinned(Generic[T]):
    """Every stride-th of what is offered; the stride doubles when `most` items are held.

    Equally spaced at any time, whatever the length: between most/2 and most items once there
    have been that many.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._stride = 1
        self._offered = 0
        self.items: list[T] = []

    def offer(self, item: T) -> None:
        """Keep the item if its turn has come."""
        if self._offered % self._stride == 0:
            if len(self.items) == self._most:
                del self.items[1::2]
                self._stride *= 2
            if self._offered % self._stride == 0:
                self.items.append(item)
        self._offered += 1

    def archive(self) -> tuple[int, int]:
        """What its items do not say: stride, and how many were offered."""
        return self._stride, self._offered

    def restore(self, archive: Iterable[int], items: Sequence[T]) -> None:
        """Continue as the one that `archive` and `items` are from."""
        self._stride, self._offered = (int(number) for number in archive)
        self.items = list(items)


Fields = tuple[float, Array, Array, Array]

# Shapes of a history without samples, where they are not (0,).
_EMPTY = {
    "tip_position_m": (0, 2),
    "tip_velocity_m_per_s": (0, 2),
    "hinge_reactions_N": (0, 0, 2),
}


class Recorder:
    """Samples, forces and fields of one run, in flight and in the contact window."""

    def __init__(self, max_samples: int, snapshots: int) -> None:
        self._flight: Thinned[Sample] = Thinned(max_samples)
        self._window: Thinned[Sample] = Thinned(max_samples)
        self._fields: Thinned[Fields] = Thinned(snapshots)
        self._last: Sample | None = None
        self._logs: list[Array] = []
        self._times: list[Array] = []
        self._peak: tuple[float, Fields] | None = None
        self._latest_fields: Fields | None = None

    def add(self, model: Model, state: State, block: Block, taken: Sample) -> None:
        """Record `state`, the block that started there and its audit."""
        self._last = taken
        (self._window if block.searched else self._flight).offer(taken)
        # States are never written to again, so holding them is no copy.
        shown = (state.time_s, state.displacement, block.velocity, block.pressure)
        self._latest_fields = shown
        if not block.searched:
            return
        self._fields.offer(shown)
        if taken.normal_force_N > 0.0 and (
            self._peak is None or taken.normal_force_N > self._peak[0]
        ):
            self._peak = (taken.normal_force_N, shown)
        steps = np.arange(len(block.log), dtype=np.float64)
        times: Array = state.time_s + model.step_s * steps
        self._times.append(times)
        full = block.log.copy()
        full *= model.copies
        full[:, GAP] = block.log[:, GAP]
        self._logs.append(full)

    def forces(self) -> ForceRecord:
        """Contact of every step of the window."""
        if not self._logs:
            return ForceRecord(*(np.empty(0) for _ in range(4)))
        log = np.concatenate(self._logs)
        time = np.concatenate(self._times)
        good = np.isfinite(log).all(axis=1)
        log, time = log[good], time[good]
        columns = (np.ascontiguousarray(log[:, c]) for c in (NORMAL, TANGENTIAL, GAP))
        return ForceRecord(time, *columns)

    def history(self) -> History:
        """The samples as arrays."""
        samples = [*self._flight.items, *self._window.items]
        if self._last is not None and (not samples or samples[-1] is not self._last):
            samples.append(self._last)
        if not samples:
            empty = {name: np.empty(shape) for name, shape in _EMPTY.items()}
            return History(**{f.name: empty.get(f.name, np.empty(0)) for f in fields(Sample)})
        samples.sort(key=lambda item: item.time_s)
        return History(
            **{
                f.name: np.array([getattr(item, f.name) for item in samples])
                for f in fields(Sample)
            }
        )

    def snapshots(self, model: Model) -> tuple[Snapshot, ...]:
        """Equally spaced fields, the last ones, and those at peak."""
        held = list(self._fields.items)
        if self._latest_fields is not None and (not held or held[-1][0] != self._latest_fields[0]):
            held.append(self._latest_fields)
        chosen = [(entry, False) for entry in held]
        if self._peak is not None:
            peak = self._peak[1]
            chosen = [(f, flag) for f, flag in chosen if f[0] != peak[0]] + [(peak, True)]
        chosen.sort(key=lambda entry: entry[0][0])
        return tuple(
            Snapshot(time, u, v, model.kernel.von_mises(u), pressure, at_peak)
            for (time, u, v, pressure), at_peak in chosen
        )

    def archive(self) -> dict[str, NDArray[Any]]:
        """All that it holds as arrays, for a restart file; each sample and field once."""
        samples = _unique([*self._flight.items, *self._window.items, self._last])
        held = _unique(
            [
                *self._fields.items,
                self._latest_fields,
                None if self._peak is None else self._peak[1],
            ]
        )
        arrays: dict[str, NDArray[Any]] = {
            f"sample.{f.name}": np.array([getattr(item, f.name) for item in samples])
            for f in fields(Sample)
        }
        for number in range(len(held[0]) if held else 0):
            arrays[f"field.{number}"] = np.array([item[number] for item in held])
        for name, thinned, table in (
            ("flight", self._flight, samples),
            ("window", self._window, samples),
            ("fields", self._fields, held),
        ):
            arrays[f"{name}.items"] = _places(thinned.items, table)
            arrays[f"{name}.archive"] = np.array(thinned.archive())
        arrays["last"] = _places([self._last], samples)
        arrays["latest"] = _places([self._latest_fields], held)
        if self._peak is not None:
            arrays["peak"] = _places([self._peak[1]], held)
            arrays["peak.force"] = np.array(self._peak[0])
        if self._logs:
            arrays["log"] = np.concatenate(self._logs)
            arrays["log.time"] = np.concatenate(self._times)
        return arrays

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Continue as the recorder that `arrays` are from."""
        columns = {f.name: arrays[f"sample.{f.name}"] for f in fields(Sample)}
        count = len(next(iter(columns.values())))
        samples = [
            Sample(**{name: _entry(column, i) for name, column in columns.items()})
            for i in range(count)
        ]
        parts = [arrays[f"field.{n}"] for n in range(sum(k.startswith("field.") for k in arrays))]
        held: list[Any] = [
            (float(parts[0][i]), *(part[i] for part in parts[1:]))
            for i in range(len(parts[0]) if parts else 0)
        ]
        for name, thinned, table in (
            ("flight", self._flight, samples),
            ("window", self._window, samples),
            ("fields", self._fields, held),
        ):
            chosen: list[Any] = [table[i] for i in arrays[f"{name}.items"]]
            thinned.restore(arrays[f"{name}.archive"], chosen)
        self._last = next((samples[i] for i in arrays["last"]), None)
        self._latest_fields = next((held[i] for i in arrays["latest"]), None)
        if "peak" in arrays:
            self._peak = (float(arrays["peak.force"]), held[int(arrays["peak"][0])])
        if "log" in arrays:
            self._logs, self._times = [arrays["log"]], [arrays["log.time"]]


def _unique(items: Sequence[T | None]) -> list[T]:
    """The objects among `items`, each once, in order."""
    return list({id(item): item for item in items if item is not None}.values())


def _places(items: Sequence[object], table: Sequence[object]) -> NDArray[np.int64]:
    """Where the objects among `items` stand in `table`."""
    place = {id(item): number for number, item in enumerate(table)}
    return np.array([place[id(item)] for item in items if item is not None], dtype=np.int64)


def _entry(column: NDArray[Any], row: int) -> Any:
    """One sample's value: a number, a vector or an array."""
    if column.ndim == 1:
        return float(column[row])
    return tuple(column[row].tolist()) if column.ndim == 2 else column[row]
