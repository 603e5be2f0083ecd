"""Finished cells, one JSON line each: a campaign that was stopped goes on where it was."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import validation
from validation.studies.stress.stability_map import ANSWERS, Cell

ROOT = Path(validation.__file__).parents[1]


def digest_of(sources: tuple[str, ...]) -> str:
    """Digest of packages and files, relative to the repository: other programs don't count."""
    digest = hashlib.sha256()
    for source in sources:
        path = ROOT / source
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            digest.update(file.read_bytes())
    return digest.hexdigest()


class Finished:
    """The verdicts of a file of JSON lines, by cell.

    A line that is cut short, altered or of other sources is as if it had never been written.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._sources: dict[tuple[str, ...], str] = {}
        self._rows: dict[str, dict[str, Any]] = {}
        if not path.exists():
            return
        for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
            try:
                row = json.loads(line)
                if row["answer"] in ANSWERS and row["digest"] == _digest(row):
                    self._rows[str(row["key"])] = row
            except (ValueError, KeyError, TypeError):
                continue

    def key(self, cell: Cell) -> str:
        """Identity of a cell: its scene, its judge, and the sources of both."""
        if cell.sources not in self._sources:
            self._sources[cell.sources] = digest_of(cell.sources)
        judge = f"{cell.judge.__module__}.{cell.judge.__qualname__}"
        text = f"{cell.scene!r} {judge} {self._sources[cell.sources]}"
        return hashlib.sha256(text.encode()).hexdigest()[:32]

    def get(self, cell: Cell) -> Mapping[str, Any] | None:
        """The cell's verdict, None if it is to be run."""
        return self._rows.get(self.key(cell))

    def add(self, cell: Cell, verdict: Mapping[str, Any]) -> None:
        """Keep a verdict at once; the line is flushed to the file."""
        row = {"key": self.key(cell), **verdict}
        row["digest"] = _digest(row)
        self._rows[row["key"]] = row
        # a line that a killed run left unfinished must not swallow this one
        with self._path.open("a+b") as file:
            if file.tell():
                file.seek(-1, 2)
                if file.read(1) != b"\n":
                    file.write(b"\n")
            file.write(json.dumps(row).encode() + b"\n")


def _digest(row: Mapping[str, Any]) -> str:
    text = json.dumps({k: v for k, v in row.items() if k != "digest"}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]
