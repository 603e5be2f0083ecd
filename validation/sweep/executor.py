"""Where a sweep's scenes are solved: in processes here, or on the workers of a Dask cluster.

Both are a `concurrent.futures` executor's ``submit``, which `solve_all` feeds with batches of tasks
and whose rows it keeps as they come. A batch whose worker dies is cut into single scenes; one that
kills its worker by itself is a row that says so. Batches that a lost connection has cancelled are
sent again.
"""

import logging
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any

from validation.errors import RunFailedError, UserError
from validation.harness.console import say
from validation.harness.processes import workers
from validation.harness.provenance import cores
from validation.sweep.runs import CRASHED, Row, SweepTask, check_program, programs, row, solve_tasks

Submit = Callable[..., "Future[list[Row]]"]

AHEAD = 3  # batches that wait, per worker
# A batch has as many scenes, up to MOST_SCENES, as take about BATCH_S to solve.
BATCH_S, MOST_SCENES = 1.0, 200
TRIES = 5  # of a batch that connections lose
CONNECT_S = 30.0
# Of a client whose scheduler has not come back for so long.
GIVEN_UP = ("closing", "closed")
COUNTED_S = 5.0  # between two looks how many workers there are, and whether there is a scheduler


@dataclass(frozen=True)
class Crew:
    """What solves batches.

    submit : of an executor. workers : how many of them there are now. lost : the error, where what
    was submitted will never be solved.
    """

    submit: Submit
    workers: Callable[[], int]
    lost: Callable[[], RunFailedError | None] = lambda: None


@contextmanager
def processes_here(count: int | None) -> Iterator[Crew]:
    """So many processes of this machine, one a core by default."""
    number = count or cores()
    with workers(number) as pool:
        yield Crew(pool.submit, lambda: number)


@contextmanager
def dask_cluster(address: str, models: Sequence[str]) -> Iterator[Crew]:
    """The workers of a Dask cluster that is there.

    Raises UserError: Dask is not installed, nothing answers at the address, or workers have other
        versions.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise UserError(
            f"--dask {address}: needs Dask, which is not installed: pip install 'fingertap[dask]'"
        ) from error
    # Tornado tells a lost connection by tracebacks of its own callbacks, now and then, beside the
    # error that the futures have and `_lost` says.
    logging.getLogger("tornado.application").setLevel(logging.CRITICAL)
    try:
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:  # a wrong address is a ValueError
        raise UserError(
            f"--dask {address}: no scheduler answers ({' '.join(str(error).split())[:100]});"
            " check the address that dask scheduler prints"
        ) from error
    with client:
        _check_workers(client, address, models)
        pool = client.get_executor(pure=False, retries=TRIES)

        def submit(*given: Any) -> Future[list[Row]]:
            try:
                found: Future[list[Row]] = pool.submit(*given)
            except Exception as error:  # of a client that has given up
                raise _lost(address) from error
            return found

        def lost() -> RunFailedError | None:
            return _lost(address) if client.status in GIVEN_UP else None

        try:
            yield Crew(submit, _count_of(client), lost)
        finally:
            with suppress(Exception):  # of a client that has given up
                pool.shutdown(wait=False)


def _lost(address: str) -> RunFailedError:
    return RunFailedError(
        f"--dask {address}: the scheduler was lost; what was finished is kept: the same command"
        " goes on"
    )


def _count_of(client: Any) -> Callable[[], int]:
    """How many workers there are, asked for now and then; while there is no answer, the last."""
    count, asked = len(client.nthreads()), time.monotonic()

    def workers_now() -> int:
        nonlocal count, asked
        if time.monotonic() - asked > COUNTED_S:
            with suppress(Exception):  # a connection that is being made again
                count = len(client.nthreads())
            asked = time.monotonic()
        return count

    return workers_now


def _check_workers(client: Any, address: str, models: Sequence[str]) -> None:
    """Refuse workers that would give other results, before any work is sent.

    One that comes later is refused by `solve_tasks`.
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
        with warnings.catch_warnings(action="ignore"):  # of what decides no bits, or below
            client.get_versions(check=True)
        for model in models:
            for name, there in client.run(programs, model).items():
                check_program(there, programs(model), f"--dask {address}: worker {name}")
    except (ValueError, ImportError, AttributeError) as error:
        raise UserError(
            f"--dask {address}: workers have other versions: {' '.join(str(error).split())[:300]};"
            " install the same there"
        ) from error


def solve_all(
    crew: Crew,
    name: str,
    document: Mapping[str, Any],
    tasks: Sequence[SweepTask],
    keep: Callable[[SweepTask, Row], None],
) -> None:
    """Solve tasks; every row is handed to `keep` as soon as its batch is there.

    Raises RunFailedError: the executor has lost a batch `TRIES` times, or its scheduler.
    """
    wanted = {model: programs(model) for model in {task.model for task in tasks}}
    todo, again = deque(tasks), deque[tuple[tuple[SweepTask, ...], int]]()
    running: dict[Future[list[Row]], tuple[tuple[SweepTask, ...], int]] = {}
    seconds: dict[str, float] = {}

    def batch() -> tuple[tuple[SweepTask, ...], int]:
        if again:
            return again.popleft()
        model = todo[0].model
        # of a model that has not been solved yet nobody knows how long it takes
        most = max(1, min(MOST_SCENES, int(BATCH_S / max(seconds.get(model, BATCH_S), 1e-3))))
        most = max(1, min(most, len(todo) // (2 * crew.workers() or 1)))
        chosen: list[SweepTask] = []
        while todo and len(chosen) < most and todo[0].model == model:
            chosen.append(todo.popleft())
        return tuple(chosen), 1

    try:
        while todo or again or running:
            while (todo or again) and len(running) < AHEAD * max(crew.workers(), 1):
                chosen, tries = batch()
                given = [(task.model, task.overrides) for task in chosen]
                running[crew.submit(solve_tasks, name, document, given, wanted)] = chosen, tries
            ready, _ = wait(running, COUNTED_S, FIRST_COMPLETED)
            if not ready and (error := crew.lost()):
                raise error
            for future in ready:
                chosen, tries = running.pop(future)
                rows = _rows(future, chosen, tries, again)
                for task, found in zip(chosen, rows, strict=bool(rows)):
                    keep(task, found)
                    spent: float = found["spent_s"]
                    seconds[task.model] = 0.7 * seconds.get(task.model, spent) + 0.3 * spent
    finally:
        if crew.lost() is None:
            for future in running:
                future.cancel()


def _rows(
    future: Future[list[Row]], chosen: tuple[SweepTask, ...], tries: int,
    again: deque[tuple[tuple[SweepTask, ...], int]],
) -> list[Row]:  # fmt: skip
    """A batch's rows; none of one that is to be sent again."""
    try:
        return future.result()
    except CancelledError as error:
        if tries == TRIES:
            raise RunFailedError(
                f"the cluster's scheduler was lost {TRIES} times; what was finished is kept: the"
                " same command goes on"
            ) from error
        again.append((chosen, tries + 1))
    except UserError:  # a worker that came later has another program
        raise
    except Exception as error:  # its worker died; the scenes' own errors are rows
        if len(chosen) == 1 and tries > 1:
            return [row(CRASHED, f"its worker died twice: {' '.join(str(error).split())[:200]}")]
        again.extend(((task,), 2) for task in chosen)
    return []
