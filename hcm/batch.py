"""Many scenes over all cores: a scene belongs to one thread, from its start to its end.

The compiled loop lets go of the interpreter while it runs (`hcm.loop.advance`), and takes a scene's
steps without returning to Python, so that threads share out the cores. What Python does for a scene
before and after, some 0.4 ms, threads do by turns: beyond a dozen cores use processes, each with
its part of the scenes.
"""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, fields, replace
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from hcm.accuracy import simulate_within
from hcm.chosen import check_accuracy
from hcm.dataset import unit_of
from hcm.estimate import NAMES
from hcm.model import Scene
from hcm.parameters import Finger, ParameterError
from hcm.result import Summary
from hcm.simulate import simulate

if TYPE_CHECKING:
    import xarray

# Scenes that a thread takes at once, and such parts that may wait, per thread.
PART, AHEAD = 8, 8
# Statuses of a scene without a run: it was refused, or its solver raised what it should not have.
REFUSED, FAILED = "REFUSED", "FAILED"


@dataclass(frozen=True)
class Outcome:
    """A scene's result without its history.

    status : name of the run's `Status`, REFUSED or FAILED. message, summary, errors, cautions : of
    `TapResult`; the summary is None where there was no run. steps : accepted ones. wall_time_s :
    of the run, without the estimates of its errors.
    """

    status: str
    message: str
    summary: Summary | None = None
    errors: Mapping[str, float | tuple[float, float]] = field(default_factory=dict)
    cautions: tuple[str, ...] = ()
    steps: int = 0
    wall_time_s: float = 0.0


def vary(scene: Scene, columns: Mapping[str, Sequence[Any]]) -> Iterator[Scene | ParameterError]:
    """Scenes like `scene`, one a row of the columns; in its place why a row is refused.

    Parameters
    ----------
    columns : by dotted fields, ``surface.friction``; those of ``phalanx`` hold for all phalanges.

    Raises
    ------
    ParameterError
        A column has no such field, or not as many rows as the others.
    """
    parts = {f.name for f in fields(Scene)} - {"finger", "start"} | {"phalanx"}
    size = {len(column) for column in columns.values()}
    for name in columns:
        part, _, of = name.partition(".")
        owner = scene.finger.phalanges[0] if part == "phalanx" else getattr(scene, part, None)
        if part not in parts or of not in {f.name for f in fields(owner)}:  # type: ignore[arg-type]
            raise ParameterError(f"column {name!r}: must be a field of {', '.join(sorted(parts))}")
    if len(size) > 1:
        raise ParameterError(f"columns have {sorted(size)} rows: must be of one length")
    for row in zip(*columns.values(), strict=True):
        changes: dict[str, dict[str, Any]] = {}
        for name, value in zip(columns, row, strict=True):
            part, _, of = name.partition(".")
            changes.setdefault(part, {})[of] = value.item() if hasattr(value, "item") else value
        try:
            given = {
                part: replace(getattr(scene, part), **changed)
                for part, changed in changes.items()
                if part != "phalanx"
            }
            if phalanx := changes.get("phalanx"):
                given["finger"] = Finger(
                    tuple(replace(p, **phalanx) for p in scene.finger.phalanges)
                )
            yield replace(scene, **given)
        except ParameterError as error:
            yield error


def simulate_each(
    scenes: Iterable[Scene | ParameterError],
    threads: int | None = None,
    accuracy: float | None = None,
) -> Iterator[Outcome]:
    """Outcomes in the order of the scenes, each to the bits that `simulate` alone gives.

    Scenes are asked for as they are needed, and nothing is kept of those that are done: memory does
    not grow with their number.

    Parameters
    ----------
    scenes : a `ParameterError` in the place of one is a scene that is refused.
    threads : that share them out; None: one a core that this process may use.
    accuracy : chooses each scene's settings (`simulate_within`); None leaves its own.

    Raises
    ------
    ParameterError
        The accuracy is none that settings are known for.
    """
    if accuracy is not None:
        check_accuracy(accuracy)
    count = threads or len(os.sched_getaffinity(0))
    given, stop = iter(scenes), threading.Event()
    waiting: deque[Future[list[Outcome]]] = deque()
    with ThreadPoolExecutor(count, "taps") as pool:
        try:
            while part := tuple(islice(given, PART)):
                waiting.append(pool.submit(_taps, part, stop, accuracy))
                if len(waiting) >= AHEAD * count:
                    yield from waiting.popleft().result()
            while waiting:
                yield from waiting.popleft().result()
        finally:  # an interrupt too: runs end within a call of the loop
            stop.set()
            for future in waiting:
                future.cancel()


def simulate_many(
    scenes: Iterable[Scene | ParameterError],
    threads: int | None = None,
    accuracy: float | None = None,
) -> xarray.Dataset:
    """`simulate_each` as one table over a dimension ``scene``, units in the attributes.

    Numbers that a scene has not are NaN, counts 0. Estimated errors, where a scene's settings ask
    for them, are ``error_`` and the number's name.
    """
    return table(list(simulate_each(scenes, threads, accuracy)))


def _taps(
    scenes: Sequence[Scene | ParameterError], stop: threading.Event, accuracy: float | None
) -> list[Outcome]:
    return [_tap(scene, stop, accuracy) for scene in scenes if not stop.is_set()]


def _tap(scene: Scene | ParameterError, stop: threading.Event, accuracy: float | None) -> Outcome:
    def watch(fraction: float, doing: str) -> None:
        del fraction, doing
        if stop.is_set():
            raise KeyboardInterrupt

    try:
        if isinstance(scene, ParameterError):
            raise scene
        if accuracy is None:
            result = simulate(**scene.arguments(), progress=watch)
        else:
            result = simulate_within(accuracy, scene, progress=watch)
    except ParameterError as error:
        return Outcome(REFUSED, str(error))
    except Exception as error:  # of one scene, of which the others know nothing
        return Outcome(FAILED, f"{type(error).__name__}: {error}")
    statistics = result.statistics
    return Outcome(
        result.status.name,
        result.message,
        result.summary,
        result.errors,
        result.cautions,
        statistics.steps,
        statistics.wall_time_s,
    )


def table(outcomes: Sequence[Outcome]) -> xarray.Dataset:
    """Outcomes as `simulate_many` gives them."""
    import xarray

    def column(name: str, values: list[Any]) -> tuple[tuple[str, ...], Any, dict[str, str]]:
        pair = "velocity" in name
        nothing: Any = (np.nan, np.nan) if pair else np.nan
        array = np.array([nothing if value is None else value for value in values])
        array = array.reshape(len(values), 2) if pair else array
        return ("scene", "axis")[: array.ndim], array, {"units": unit_of(name)}

    columns: dict[str, Any] = {
        "status": ("scene", np.array([o.status for o in outcomes], dtype=str)),
        "message": ("scene", np.array([o.message for o in outcomes], dtype=str)),
        "cautions": ("scene", np.array(["; ".join(o.cautions) for o in outcomes], dtype=str)),
    }
    for f in fields(Summary):
        columns[f.name] = column(f.name, [getattr(o.summary, f.name, None) for o in outcomes])
    for name in NAMES:
        columns[f"error_{name}"] = column(name, [o.errors.get(name) for o in outcomes])
    for name in ("steps", "wall_time_s"):
        columns[name] = column(name, [getattr(o, name) for o in outcomes])
    return xarray.Dataset(columns, coords={"axis": ["x", "y"]})
