"""Jobs in worker processes: answers, errors, and processes that die."""

import os
import signal
import struct
import sys
import threading
import time
from concurrent.futures import Future

import pytest

from validation.errors import RunFailedError, UserError
from validation.harness.processes import CrashedError, call_isolated, workers


def _die() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def _refuse(value: float) -> None:
    raise UserError(f"scene.height = {value}: must be above 0")


def _lock() -> object:
    return threading.Lock()


def _one_of_two_dies() -> None:
    with workers(2) as pool:
        pool.submit(time.sleep, 120)
        pool.submit(_die).result()


def _fail_over_work(jobs: list[Future[None]]) -> None:
    with workers(1) as pool:
        jobs += [pool.submit(time.sleep, 120) for _ in range(5)]
        raise UserError("enough")


def test_answers_come_from_processes_that_are_used_again() -> None:
    with workers(2) as pool:
        answers = [pool.submit(divmod, number, 3) for number in range(20)]
        assert [answer.result() for answer in answers] == [divmod(n, 3) for n in range(20)]
        numbers = {pool.submit(os.getpid).result() for _ in range(10)}
    assert 1 <= len(numbers) <= 2
    assert os.getpid() not in numbers


def test_an_error_comes_back_as_it_was_raised_and_the_next_job_is_done() -> None:
    with workers(1) as pool:
        refused = pool.submit(_refuse, -1.0)
        with pytest.raises(UserError, match=r"height = -1\.0: must be above 0") as caught:
            refused.result()
        assert "in _refuse" in caught.value.__notes__[0]
        assert pool.submit(abs, -2).result() == 2


def test_an_answer_that_cannot_be_sent_says_so() -> None:
    with workers(1) as pool:
        with pytest.raises(TypeError, match="pickle"):
            pool.submit(_lock).result()
        assert pool.submit(abs, -2).result() == 2


def test_a_process_that_dies_is_told_and_ends_the_others() -> None:
    began = time.monotonic()
    with pytest.raises(RunFailedError, match="worker process died"):
        _one_of_two_dies()
    assert time.monotonic() - began < 60  # the other would have taken twice that


def test_a_job_after_a_death_starts_another_process() -> None:
    with workers(1) as pool:
        with pytest.raises(RunFailedError, match="worker process died"):
            pool.submit(os._exit, 3).result()
        assert pool.submit(abs, -2).result() == 2


def test_a_dead_process_leaves_no_open_pipe() -> None:
    """After some 330 deaths healthy jobs failed for too many open files."""
    open_files = []
    with workers(1) as pool:
        for _ in range(4):
            with pytest.raises(RunFailedError, match="worker process died"):
                pool.submit(_die).result()
            open_files.append(len(os.listdir("/proc/self/fd")))
    assert open_files[0] == open_files[-1]


def _die_in_an_answer() -> None:
    """Begin an answer of 1000 bytes on the pipe of `processes._answer`, and die."""
    pipe = sys._getframe(1).f_locals["pipe"]
    os.write(pipe.fileno(), struct.pack("!i", 1000) + b"begun")
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_process_that_dies_in_its_answer_has_crashed() -> None:
    with pytest.raises(CrashedError, match="signal 9"):
        call_isolated(_die_in_an_answer)


def test_what_waits_is_dropped_when_the_command_fails() -> None:
    jobs: list[Future[None]] = []
    with pytest.raises(UserError, match="enough"):
        _fail_over_work(jobs)
    assert all(job.done() for job in jobs)
    assert sum(job.cancelled() for job in jobs) >= 4
