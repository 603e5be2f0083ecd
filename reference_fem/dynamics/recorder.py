"""Records a run of unknown length in bounded memory."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Generic, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from reference_fem.arrays import Array
from reference_fem.contact.law import GAP, NORMAL, TANGENTIAL
from reference_fem.dynamics.state import State
from reference_fem.dynamics.step import Block
from reference_fem.model import Model
from reference_fem.results.result import ForceRecord, History, Sample, Snapshot
from reference_fem.settings import Settings

T = TypeVar("T")


class Thinned(Generic[T]):
    """Keeps every stride-th item offered; the stride doubles when `most` items are held.

    Items are equally spaced at any time, whatever the length: between most/2 and most of them once
    that many were offered.
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

    def counts(self) -> tuple[int, int]:
        """What its items do not tell: the stride, and how many were offered."""
        return self._stride, self._offered

    def restore(self, counts: Iterable[int], items: list[T]) -> None:
        """Continue from another one's `counts` and `items`."""
        self._stride, self._offered = (int(number) for number in counts)
        self.items = items


@dataclass(frozen=True)
class Fields:
    """What a `Snapshot` is made from, and the normal force on the full body, N."""

    time_s: float
    displacement: Array
    velocity: Array
    pressure: Array
    normal_force_N: float


# Kinds of items by group: those that are thinned, and those of which there is none or one (the last
# sample, the last fields and those at peak force).
THINNED: dict[str, type] = {"flight": Sample, "tap": Sample, "window": Sample, "fields": Fields}
SINGLE: dict[str, type] = {"last": Sample, "latest": Fields, "peak": Fields}
# Shapes of a history without samples, where they are not (0,).
_EMPTY = {"tip_position_m": (0, 2), "tip_velocity_m_per_s": (0, 2), "hinge_reactions_N": (0, 0, 2)}


class Recorder:
    """Samples, forces and fields of one run: in flight, in the contact window up to the end of the
    first tap, and beyond it.
    """

    def __init__(self, settings: Settings) -> None:
        most = {Sample: settings.max_samples, Fields: settings.snapshots}
        self._thinned = {group: Thinned[Any](most[kind]) for group, kind in THINNED.items()}
        self._single: dict[str, list[Any]] = {group: [] for group in SINGLE}
        self._logs: list[Array] = []
        self._times: list[Array] = []

    def add(self, model: Model, state: State, block: Block, taken: Sample, tapped: bool) -> None:
        """Record `state`, the block that started there and its audit.

        tapped : whether the first tap is over, whose peak's fields are kept.
        """
        self._single["last"] = [taken]
        window = "window" if tapped else "tap"
        self._thinned[window if block.searched else "flight"].offer(taken)
        force = taken.normal_force_N
        # States are never written to again, so they can be held without a copy.
        shown = Fields(state.time_s, state.displacement, block.velocity, block.pressure, force)
        self._single["latest"] = [shown]
        if not block.searched:
            return
        self._thinned["fields"].offer(shown)
        largest = max((peak.normal_force_N for peak in self._single["peak"]), default=0.0)
        if force > largest and not tapped:
            self._single["peak"] = [shown]
        steps = np.arange(len(block.log), dtype=np.float64)
        times: Array = state.time_s + model.step_s * steps
        self._times.append(times)
        full = block.log.copy()
        full *= model.symmetry_factor
        full[:, GAP] = block.log[:, GAP]
        self._logs.append(full)

    def holds(self, state: State) -> bool:
        """Whether the block from a state on is recorded, or in part."""
        return any(last.time_s >= state.time_s for last in self._single["last"])

    def forces(self) -> ForceRecord:
        """Contact at every step of the window."""
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
        samples = [s for group in ("flight", "tap", "window") for s in self._thinned[group].items]
        if not samples:
            return History(**{f.name: np.empty(_EMPTY.get(f.name, 0)) for f in fields(History)})
        times = {sample.time_s for sample in samples}
        samples += [last for last in self._single["last"] if last.time_s not in times]
        samples.sort(key=lambda item: item.time_s)
        return History(**_columns(samples))

    def snapshots(self, model: Model) -> tuple[Snapshot, ...]:
        """Equally spaced fields, the last ones, and those at peak."""
        latest, at_peak = self._single["latest"], self._single["peak"]
        shown = {f.time_s: f for f in (*self._thinned["fields"].items, *latest, *at_peak)}
        peaks = [peak.time_s for peak in at_peak]
        return tuple(
            Snapshot(
                time_s=time_s,
                displacement=f.displacement,
                velocity=f.velocity,
                von_mises_Pa=model.kernel.von_mises(f.displacement, f.velocity),
                contact_pressure_Pa=f.pressure,
                at_peak=time_s in peaks,
            )
            for time_s, f in sorted(shown.items())
        )

    def archive(self) -> dict[str, NDArray[Any]]:
        """All that it holds as arrays, for a restart file."""
        thinned = {group: kept.items for group, kept in self._thinned.items()}
        arrays: dict[str, NDArray[Any]] = {
            f"{group}.{name}": column
            for group, items in (thinned | self._single).items()
            for name, column in (_columns(items) if items else {}).items()
        }
        for group, kept in self._thinned.items():
            arrays[f"{group}.counts"] = np.array(kept.counts())
        if self._logs:
            arrays["log"] = np.concatenate(self._logs)
            arrays["log.time"] = np.concatenate(self._times)
        return arrays

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Continue from the `archive` of another recorder."""
        for group, kept in self._thinned.items():
            kept.restore(arrays[f"{group}.counts"], _rows(THINNED[group], arrays, group))
        self._single = {group: _rows(kind, arrays, group) for group, kind in SINGLE.items()}
        if "log" in arrays:
            self._logs, self._times = [arrays["log"]], [arrays["log.time"]]


def _columns(items: Sequence[Sample | Fields]) -> dict[str, NDArray[Any]]:
    """The fields of one or more items, one array per field."""
    names = (f.name for f in fields(items[0]))
    return {name: np.array([getattr(item, name) for item in items]) for name in names}


def _rows(kind: type[T], arrays: Mapping[str, NDArray[Any]], group: str) -> list[T]:
    """The items that a group of arrays was made from; none where there is no such group."""
    if f"{group}.time_s" not in arrays:
        return []
    columns = {f.name: arrays[f"{group}.{f.name}"] for f in fields(cast(Any, kind))}
    return [
        kind(**{name: c[i].item() if c.ndim == 1 else c[i] for name, c in columns.items()})
        for i in range(len(columns["time_s"]))
    ]
