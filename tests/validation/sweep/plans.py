"""A plan of cheap scenes, and sweeps of it in the test's own process."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import pytest

from validation.sweep import command
from validation.sweep.executor import Crew

PLAN = """
scene = "soft"
models = ["hcm"]
[set]
"finger.phalanges" = 1
"finger.elements" = 2
"surface.height" = 0.03
"solver.hcm.contact_step" = 1e-5
"solver.hcm.contact_tolerance" = 1e-9
[points]
number = 4
[vary]
"surface.friction" = { low = 0.0, high = 1.2 }
"material.youngs_modulus" = { low = 1e9, high = 1e11, log = true }
"""


def written(folder: Path, text: str = PLAN) -> Path:
    path = folder / "plan.toml"
    path.write_text(text, encoding="utf-8")
    return path


@contextmanager
def threads_here(count: int | None) -> Iterator[Crew]:
    with ThreadPoolExecutor(1) as pool:
        yield Crew(pool.submit, lambda: count or 1)


@pytest.fixture
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """No process is started, no page drawn: what is solved is the same."""
    monkeypatch.setattr(command, "processes_here", threads_here)
    monkeypatch.setattr(command, "compile_in_fresh_process", lambda models, say: None)
    monkeypatch.setattr(command, "write_report", lambda *given: None)
