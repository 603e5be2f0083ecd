"""Where a sweep's scenes are solved: in processes here, or on the workers of a Dask cluster.

Both offer the ``submit`` of a `concurrent.futures` executor, to which `solve_all` gives batches of
tasks and whose rows it keeps as they arrive. A batch whose worker dies is split into single scenes;
a scene that kills its worker on its own gets a row that says so. Batches cancelled by a lost
connection are sent again.
"""

import logging
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any, NamedTuple

from validation.errors import RunFailedError, UserError, in_one_line
from validation.harness.console import say
from validation.harness.processes import workers
from validation.harness.provenance import cores
from validation.sweep.runs import (
    CRASHED,
    INTERRUPTED,
    Row,
    SweepTask,
    check_program,
    programs,
    row,
    solve_tasks,
)

Submit = Callable[..., "Future[list[Row]]"]

AHEAD = 3  # batches submitted at a time, per worker
# A batch has as many scenes, up to MOST_SCENES, as take about BATCH_S to solve.
BATCH_S, MOST_SCENES = 1.0, 200
TRIES = 5  # attempts at a batch that lost connections cancel
CONNECT_S = 30.0
# Statuses of a client that has given up waiting for its scheduler.
GIVEN_UP = ("closing", "closed")
COUNTED_S = 5.0  # between two checks of the number of workers and of the scheduler


@dataclass(frozen=True)
class Crew:
    """The workers that solve batches.

    submit : an executor's method. workers : returns their present number. lost : returns an error
    if what was submitted will never be solved, else None.
    """

    submit: Submit
    workers: Callable[[], int]
    lost: Callable[[], RunFailedError | None] = lambda: None


class Batch(NamedTuple):
    """Tasks of one model that a worker solves together.

    cuts, deaths : how often the scheduler was lost, and a worker died, while they were solved
    """

    tasks: tuple[SweepTask, ...]
    cuts: int = 0
    deaths: int = 0


@contextmanager
def processes_here(count: int | None) -> Iterator[Crew]:
    """`count` processes on this machine; None: one per core."""
    number = count or cores()
    with workers(number) as pool:
        yield Crew(pool.submit, lambda: number)


@contextmanager
def dask_cluster(address: str, models: Sequence[str]) -> Iterator[Crew]:
    """The workers of a running Dask cluster.

    Raises UserError: Dask is not installed, nothing answers at the address, or workers have other
        versions or several threads.
    """
    try:
        from distributed import Client
        from distributed.comm import normalize_address, resolve_address
    except ImportError as error:
        raise UserError(
            f"--dask {address}: needs Dask, which is not installed: pip install 'fingertap[dask]'"
        ) from error
    # Both sometimes log a lost connection as tracebacks of their own callbacks, beside the error
    # that the futures carry and `_lost` reports.
    for name in ("tornado.application", "distributed"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        # a client that refuses an address takes a minute to end
        resolve_address(normalize_address(address))
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:  # a wrong address is a ValueError
        raise UserError(
            f"--dask {address}: no scheduler answers ({in_one_line(error, 100)});"
            " check the address that dask scheduler prints"
        ) from error
    with client:
        _check_workers(client, address, models)
        pool = client.get_executor(pure=False, retries=TRIES)

        def submit(*given: Any) -> Future[list[Row]]:
            try:
                return pool.submit(*given)
            except Exception as error:  # the client has given up
                raise _lost(address) from error

        def lost() -> RunFailedError | None:
            return _lost(address) if client.status in GIVEN_UP else None

        try:
            yield Crew(submit, _count_of(client, address), lost)
        finally:
            with suppress(Exception):  # the client may have given up
                pool.shutdown(wait=False)


def _lost(address: str) -> RunFailedError:
    return RunFailedError(
        f"--dask {address}: the scheduler was lost; what was finished is kept: the same command"
        " goes on"
    )


def _count_of(client: Any, address: str) -> Callable[[], int]:
    """A function that returns the number of workers, or the last known one without an answer.

    It says once when the last worker is gone.
    """
    count, asked = len(client.nthreads()), time.monotonic()

    def workers_now() -> int:
        nonlocal count, asked
        if time.monotonic() - asked > COUNTED_S:
            before = count
            with suppress(Exception):  # the connection is being restored
                count = len(client.nthreads())
            if before > count == 0:
                say(f"{address}: has no workers left; waiting for others")
            asked = time.monotonic()
        return count

    return workers_now


def _check_workers(client: Any, address: str, models: Sequence[str]) -> None:
    """Refuse workers that would give other results, before any work is sent.

    A worker that joins later is refused by `solve_tasks`.
    """
    if not client.nthreads():
        say(f"{address}: has no workers yet; waiting for the first")
        client.wait_for_workers(1)
    if busy := {name: n for name, n in client.nthreads().items() if n != 1}:
        name, threads = next(iter(busy.items()))
        raise UserError(
            f"--dask {address}: worker {name} has {threads} threads: must have 1, for compiled"
            " loops of two runs can't share a process; start workers with --nthreads 1"
        )
    try:
        with warnings.catch_warnings(action="ignore"):  # what matters is checked below
            client.get_versions(check=True)
        for model in models:
            for name, there in client.run(programs, model).items():
                check_program(there, programs(model), f"--dask {address}: worker {name}")
    except (ValueError, ImportError, AttributeError) as error:
        raise UserError(
            f"--dask {address}: workers have other versions: {in_one_line(error, 300)};"
            " install the same there"
        ) from error


def solve_all(
    crew: Crew,
    name: str,
    document: Mapping[str, Any],
    tasks: Sequence[SweepTask],
    keep: Callable[[SweepTask, Row], None],
) -> None:
    """Solve tasks; every row is handed to `keep` as soon as its batch is finished.

    Raises RunFailedError: the executor has lost a batch `TRIES` times, or its scheduler.
    """
    wanted = {model: programs(model) for model in {task.model for task in tasks}}
    todo, again = deque(tasks), deque[Batch]()
    running: dict[Future[list[Row]], Batch] = {}
    seconds: dict[str, float] = {}

    def next_batch() -> Batch:
        if again:
            return again.popleft()
        model = todo[0].model
        # one scene for a model whose time is not known yet
        most = max(1, min(MOST_SCENES, int(BATCH_S / max(seconds.get(model, BATCH_S), 1e-3))))
        most = max(1, min(most, len(todo) // (2 * crew.workers() or 1)))
        chosen: list[SweepTask] = []
        while todo and len(chosen) < most and todo[0].model == model:
            chosen.append(todo.popleft())
        return Batch(tuple(chosen))

    try:
        while todo or again or running:
            most = AHEAD * max(crew.workers(), 1)
            while (todo or again) and len(running) < most:
                batch = next_batch()
                running[crew.submit(solve_tasks, name, document, batch.tasks, wanted)] = batch
            ready, _ = wait(running, COUNTED_S, FIRST_COMPLETED)
            if not ready and (error := crew.lost()):
                raise error
            for future in sorted(ready, key=_is_cut):  # what is whole is kept before one raises
                batch = running.pop(future)
                rows = _rows(future, batch, again)
                for task, found in zip(batch.tasks, rows, strict=bool(rows)):
                    keep(task, found)
                    spent: float = found["spent_s"]
                    seconds[task.model] = 0.7 * seconds.get(task.model, spent) + 0.3 * spent
    finally:
        if crew.lost() is None:
            for future in running:
                future.cancel()


def _is_cut(future: Future[list[Row]]) -> bool:
    """Whether a batch has not got all its rows."""
    if future.cancelled() or future.exception() is not None:
        return True
    return any(found["status"] == INTERRUPTED for found in future.result())


def _rows(future: Future[list[Row]], batch: Batch, again: deque[Batch]) -> list[Row]:
    """A batch's rows; none if the batch has to be sent again."""
    try:
        return future.result()
    except CancelledError as error:
        if batch.cuts + 1 == TRIES:
            raise RunFailedError(
                f"the cluster's scheduler was lost {TRIES} times; what was finished is kept: the"
                " same command goes on"
            ) from error
        again.append(batch._replace(cuts=batch.cuts + 1))
    except UserError:  # a worker that joined later has another program
        raise
    except Exception as error:  # its worker died; the scenes' own errors are rows
        if len(batch.tasks) == 1 and batch.deaths:
            why = f"{type(error).__name__}: {in_one_line(error, 200)}"
            return [row(CRASHED, f"its worker gave no rows twice: {why}")]
        again.extend(Batch((task,), batch.cuts, 1) for task in batch.tasks)
    return []
