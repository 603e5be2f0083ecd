"""A command of the program in the test's own process: its exit code, and its one line of error."""

import pytest

from validation.cli import main


def call(*arguments: str) -> int:
    """The command's exit code."""
    try:
        main(list(arguments))
    except SystemExit as end:
        return int(end.code or 0)
    return 0


def one_line(capsys: pytest.CaptureFixture[str]) -> str:
    """What it said to stderr: one line that names the program."""
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("fingertap: error: ")
    return line
