"""Solve many scenes on all cores, each scene in one process from its start to its end.

Processes, not threads: the Python work before and after a scene's steps takes a third of the time
of a tap held to 1e-3, and threads would do it one after the other. The processes are forked from
this one after it has solved a first scene, so that they begin with its compiled kernels.
"""

from __future__ import annotations

import os
import signal
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field, fields
from itertools import islice
from multiprocessing import connection, get_context, parent_process
from threading import Thread
from typing import TYPE_CHECKING, Any

import numba
import numpy as np
from threadpoolctl import threadpool_limits

from hcm.accuracy.chosen import check_accuracy
from hcm.accuracy.simulate_within import simulate_within
from hcm.bounds import Bound, check_kind
from hcm.estimates.error_cautions import TITLES
from hcm.model import Scene
from hcm.parameters import ParameterError
from hcm.results.dataset import unit_of
from hcm.results.result import Errors, Summary
from hcm.results.status import Status
from hcm.simulate import simulate_scene

if TYPE_CHECKING:
    import xarray

# Scenes in a part, which one process takes at once, and parts that may wait per process.
PART, AHEAD = 8, 8
_FORKED = get_context("fork")
# In a worker process: a number that is not 0 when its results are no longer wanted. It is shared
# without a lock, such as an event has: who is killed while he holds one stops all others for ever.
_stop: Any = None
# Statuses of a scene without a run: it was refused, or its solver raised an unexpected exception.
REFUSED, FAILED = "REFUSED", "FAILED"


Part = tuple[Scene | ParameterError, ...]


@dataclass(frozen=True)
class Outcome:
    """A scene's result without its history.

    status : name of the run's `Status`, REFUSED or FAILED. message, summary, errors, cautions : as
    in `TapResult`; the summary is None if there was no run. steps : accepted steps. wall_time_s :
    time of the run, without its error estimates; both None if there was no run.
    """

    status: str
    message: str
    summary: Summary | None = None
    errors: Errors = field(default_factory=dict)
    cautions: tuple[str, ...] = ()
    steps: int | None = None
    wall_time_s: float | None = None


def simulate_each(
    scenes: Iterable[Scene | ParameterError],
    workers: int | None = None,
    accuracy: float | None = None,
) -> Iterator[Outcome]:
    """Outcomes in the order of the scenes, bit for bit as `simulate` gives them.

    Scenes are drawn as they are needed, and nothing is kept of those that are done: memory does not
    grow with their number. What a killed process has not finished is solved again; a scene whose
    own process is killed is FAILED.

    Parameters
    ----------
    scenes : a `ParameterError` instead of a scene gives an outcome that is REFUSED.
    workers : number of processes; None: one for each core that this process may use.
    accuracy : chooses each scene's settings (`simulate_within`); None keeps its own.

    Raises
    ------
    ParameterError
        `scenes` cannot be iterated over, no settings are known for the accuracy, or `workers` is
        not a whole number of at least 1.
    """
    if not isinstance(scenes, Iterable):
        raise ParameterError(f"scenes = {scenes!r}: must be a list of them, or a generator")
    if accuracy is not None:
        check_accuracy(accuracy)
    if workers is not None and not (some := Bound(integer=True, at_least=1)).holds(workers):
        raise ParameterError(f"workers = {workers!r}: must be {some.allowed()}")
    count = workers or numba.config.NUMBA_DEFAULT_NUM_THREADS
    return _outcomes(iter(scenes), count, accuracy)


def _outcomes(
    given: Iterator[Scene | ParameterError], count: int, accuracy: float | None
) -> Iterator[Outcome]:
    stop = _FORKED.RawValue("b")
    for scene in islice(given, 1):
        with threadpool_limits(1, user_api="blas"):  # as in the workers: other threads, other bits
            first = _tap(scene, accuracy)
        if first.status == Status.INTERRUPTED.name:  # here an interrupt is the caller's
            raise KeyboardInterrupt
        yield first
    waiting: deque[tuple[Part, Future[list[Outcome]]]] = deque()
    pool = _pool(count, stop)
    try:
        while True:
            while len(waiting) < AHEAD * count and (part := tuple(islice(given, PART))):
                waiting.append((part, _submitted(pool, part, accuracy)))
            if not waiting:
                break
            part, future = waiting.popleft()
            try:
                outcomes = future.result()
            except BrokenProcessPool:  # one of its processes was killed: what is not done is lost
                pool.shutdown()
                outcomes = [_alone(scene, accuracy, stop) for scene in part]
                pool = _pool(count, stop)
                lost, waiting = waiting, deque()
                for part, one in lost:
                    whole = one.done() and one.exception() is None
                    waiting.append((part, one if whole else _submitted(pool, part, accuracy)))
            yield from outcomes
    finally:  # on an interrupt too: runs end within a call of the loop
        stop.value = 1
        for _, future in waiting:
            future.cancel()
        pool.shutdown()


def _pool(count: int, stop: Any) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(count, _FORKED, _begin, (stop,))


def _submitted(
    pool: ProcessPoolExecutor, part: Part, accuracy: float | None
) -> Future[list[Outcome]]:
    """A part's outcomes; of a pool that is broken, a future that says so."""
    try:
        return pool.submit(_taps, part, accuracy)
    except BrokenProcessPool as broken:
        future = Future[list[Outcome]]()
        future.set_exception(broken)
        return future


def _alone(scene: Scene | ParameterError, accuracy: float | None, stop: Any) -> Outcome:
    """A scene's outcome from a process of its own, whose end by a kill is that of this scene."""
    with _pool(1, stop) as pool:
        try:
            return pool.submit(_tap, scene, accuracy).result()
        except BrokenProcessPool:
            why = "its process was killed twice (if for lack of memory, ask for fewer workers)"
            return Outcome(FAILED, why)
        except BaseException:
            stop.value = 1
            raise


def _begin(stop: Any) -> None:
    """Set up a worker: `stop` ends its runs between calls of the loop; it dies with its parent.

    A modal flight's eigenproblems have one thread each, as each core has its own scene.
    """
    global _stop
    _stop = stop
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threadpool_limits(1, user_api="blas")
    Thread(target=_outlive, daemon=True).start()


def _outlive() -> None:
    if parent := parent_process():
        connection.wait([parent.sentinel])
    os._exit(1)


def simulate_many(
    scenes: Iterable[Scene | ParameterError],
    workers: int | None = None,
    accuracy: float | None = None,
) -> xarray.Dataset:
    """`simulate_each` as one table over a dimension ``scene``, units in the attributes.

    Numbers that a scene does not have are NaN. Estimated errors, if a scene's settings ask for
    them, have the number's name and ``_error``.
    """
    return table(list(simulate_each(scenes, workers, accuracy)))


def _taps(scenes: Part, accuracy: float | None) -> list[Outcome]:
    return [_tap(scene, accuracy) for scene in scenes if not _stop.value]


def _watch(fraction: float, doing: str) -> None:
    del fraction, doing
    if _stop is not None and _stop.value:
        raise KeyboardInterrupt


def _tap(scene: Scene | ParameterError, accuracy: float | None) -> Outcome:
    try:
        if isinstance(scene, ParameterError):
            raise scene
        check_kind("scene", scene, Scene)
        if accuracy is None:
            result = simulate_scene(scene, progress=_watch)
        else:
            result = simulate_within(accuracy, scene, progress=_watch)
    except ParameterError as error:
        return Outcome(REFUSED, str(error))
    except Exception as error:  # one scene's failure must not stop the others
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
    """Convert outcomes to the dataset that `simulate_many` returns."""
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
    for name in TITLES:
        columns[f"{name}_error"] = column(name, [o.errors.get(name) for o in outcomes])
    for name in ("steps", "wall_time_s"):
        columns[name] = column(name, [getattr(o, name) for o in outcomes])
    return xarray.Dataset(columns, coords={"axis": ["x", "y"]})
