"""A command of the program in the test's own process or another, and what tests call helpers."""

from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import pytest

from tests.processes import COMMAND, python
from validation.cli import main
from validation.harness.record import RunRecord
from validation.harness.store import Store, key
from validation.models.adapter import Outcome

Make = Callable[..., RunRecord]
Patch = pytest.MonkeyPatch
Capture = pytest.CaptureFixture[str]


@dataclass(frozen=True)
class Ended:
    """How a command ended: its exit code and what it said."""

    code: int
    out: str
    err: str

    @property
    def line(self) -> str:
        """All it said to stderr: one line that names the program."""
        (line,) = self.err.splitlines()
        assert line.startswith("fingertap: error: ")
        return line

    @property
    def refusal(self) -> str:
        """The one line of a command that refused what it was given."""
        assert (self.code, self.out) == (2, "")
        return self.line


Run = Callable[..., Ended]
Use = Callable[..., None]


def call(*arguments: object) -> int:
    """The command's exit code."""
    try:
        main([str(argument) for argument in arguments])
    except SystemExit as end:
        return int(end.code or 0)
    return 0


def call_apart(*arguments: object, **how: Any) -> Ended:
    """How the command ends in a process of its own; `how` as `python` takes it."""
    done = python("-c", COMMAND, *arguments, **how)
    return Ended(done.returncode, done.stdout, done.stderr)


def asking(answer: Any = None) -> tuple[Store, list[str]]:
    """A store that has this answer to everything, and the keys of what it was asked for."""
    asked: list[str] = []

    class Asked(Store):
        def obtain(self, inputs: Any, kind: Any, compute: Any) -> Any:
            asked.append(key(inputs))
            return answer

    return Asked(None), asked


def fake_adapter(run: Callable[..., Outcome]) -> SimpleNamespace:
    """A model that takes every scene and runs as told."""
    return SimpleNamespace(resumable=True, refusal=lambda scene: "", warm_up=lambda: None, run=run)
