"""Thousands of small results in one file, one line of JSON each, as folders would take too long.

A line is written as soon as its result is there, so a command that was stopped continues where it
was. It carries the digest of its inputs and one of itself: a line that is cut short, altered, or
made from other inputs is ignored.
"""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from validation.harness.store import Inputs, key

KEY, DIGEST = "key", "digest"


class LineStore:
    """The results in a file, by their inputs.

    path : of the file, which the first result creates.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._lines: dict[str, str] = {}  # texts, which take half the memory of their values
        if not path.exists():
            return
        for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
            try:
                row = json.loads(line)
                if row[DIGEST] == _digest(row):
                    self._lines[str(row[KEY])] = line
            except (ValueError, KeyError, TypeError, RecursionError):
                continue

    def load(self, inputs: Inputs) -> Mapping[str, Any] | None:
        """The result made from these inputs, None if it is to be computed."""
        line = self._lines.get(key(inputs))
        if line is None:
            return None
        return {k: v for k, v in json.loads(line).items() if k not in (KEY, DIGEST)}

    def keep(self, inputs: Inputs, values: Mapping[str, Any]) -> None:
        """Keep a result made of JSON values; its line is written to the file at once."""
        row = {KEY: key(inputs), **values}
        row[DIGEST] = _digest(row)
        line = self._lines[row[KEY]] = json.dumps(row)
        # a line that a killed run left unfinished must not swallow this one
        with self._path.open("a+b") as file:
            if file.tell():
                file.seek(-1, 2)
                if file.read(1) != b"\n":
                    file.write(b"\n")
            file.write(line.encode() + b"\n")


def _digest(row: Mapping[str, Any]) -> str:
    text = json.dumps({name: row[name] for name in row if name != DIGEST}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]
