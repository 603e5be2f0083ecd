"""Python in a process of its own, with the packages of this checkout."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
COMMAND = "from validation.cli import main; main()"


def _popen(arguments: tuple[object, ...], env: dict[str, str] | None, popen: Any) -> dict[str, Any]:
    return {
        "args": [sys.executable, *map(str, arguments)],
        "env": {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_NUM_THREADS": "1", **(env or {})},
        "text": True,
    } | popen


def python(
    *arguments: object, env: dict[str, str] | None = None, timeout: float = 120.0, **popen: Any
) -> "subprocess.CompletedProcess[str]":
    """It ends, and what it said is kept."""
    return subprocess.run(
        **_popen(arguments, env, popen), capture_output=True, timeout=timeout, check=False
    )


def printed(*arguments: object, **how: Any) -> str:
    """What it prints; it must end well."""
    done = python(*arguments, **how)
    done.check_returncode()
    return done.stdout


def started(
    *arguments: object, env: dict[str, str] | None = None, **popen: Any
) -> "subprocess.Popen[str]":
    """It goes on by itself."""
    return subprocess.Popen(**_popen(arguments, env, popen))
