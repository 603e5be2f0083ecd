"""What every command has to answer, whatever it was given."""

import contextlib
import os
import re
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from validation.cli import main

CODES = (0, 1, 2)  # done, a run failed, bad input
LONGEST_S = 60.0  # of processor time; a run of the tries takes 1 s
# a refusal may quote what parsing hit; a run that ends in an exception's name has crashed
CRASH = re.compile(r"(?<!\()\b[A-Z]\w+(?:Error|Exception|Warning)\b")


@dataclass(frozen=True)
class Said:
    """How a command ended; code None: it raised what no command may raise."""

    code: int | None
    out: str
    error: str
    seconds: float = 0.0


@dataclass
class Tried:
    """A try: what was done, how it ended, and in what way that falls short."""

    what: str
    code: int | None = None
    fell: list[str] = field(default_factory=list)
    error: str = ""

    def judge(self, said: Said, out: Path, names: Sequence[str] = ()) -> bool:
        """Note what is wrong with an answer; whether the command did what it was told."""
        self.code, self.error = said.code, said.error[-800:]
        self.fell += [*faults(said, names), *(f"left behind: {name}" for name in left_over(out))]
        return said.code == 0


def left_over(out: Path) -> list[str]:
    """Names of files and folders that are half written."""
    return [path.name for path in out.rglob(".*")]


def faults(said: Said, names: Sequence[str] = ()) -> list[str]:
    """What is wrong with an answer; a refusal has to name one of `names`."""
    lines, refused = said.error.splitlines(), said.code == 2
    errors = [line for line in lines if line.startswith("fingertap: error: ")]
    shown = [*said.out.split("\n"), *said.error.split("\n")]
    found = {
        f"exit code {said.code}": said.code not in CODES,
        "a trace": "Traceback" in said.error or bool(not refused and CRASH.search(said.error)),
        "control characters": not all(line.isprintable() for line in shown),
        "not in the program's words": not all(line.startswith("fingertap: ") for line in lines),
        "an error of a command that is done": said.code == 0 and bool(errors),
        "no error at the end": bool(said.code) and (not errors or lines[-1] != errors[-1]),
        "a refusal in other than one line": refused and len(lines) != 1,
        "a refusal with output": refused and said.out != "",
        "a refusal of nothing that was given": refused
        and bool(names)
        and not any(name in said.error for name in names),
        f"took {said.seconds:.0f} s": said.seconds > LONGEST_S,
    }
    return [what for what, is_so in found.items() if is_so]


@contextlib.contextmanager
def _captured(number: int) -> Iterator[list[str]]:
    """What reaches a file descriptor, of compiled libraries too."""
    kept, text = os.dup(number), [""]
    with tempfile.TemporaryFile() as file:
        os.dup2(file.fileno(), number)
        try:
            yield text
        finally:
            os.dup2(kept, number)
            os.close(kept)
            file.seek(0)
            text[0] = file.read().decode(errors="backslashreplace")


def call(*arguments: str) -> Said:
    """A command in this process, whose standard streams it takes meanwhile."""
    code: int | None = 0
    trace, began = "", time.process_time()
    with _captured(1) as out, _captured(2) as error:
        try:
            main(list(arguments))
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else None
        except BaseException as raised:
            code, trace = None, f"Traceback: {type(raised).__name__}: {raised}"
        sys.stdout.flush()
        sys.stderr.flush()
    return Said(code, out[0], error[0] + trace, time.process_time() - began)
