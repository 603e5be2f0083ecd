"""Stored results, found again by their inputs.

A store is a folder with one folder per result, named by the SHA-256 of the result's inputs: scene
and settings, and the `identity.program` that made it. Other inputs give another name, so that a
changed run is never answered by an old result.

- An entry is written beside the others under a temporary name and renamed: it is there as a whole
  or not at all, even if others write to the same store. A kill leaves at most a temporary folder,
  which a later run removes.
- `manifest.json` holds the inputs and the SHA-256 of every file. An entry that is truncated,
  altered or unreadable is reported in one line, removed, and computed again.
- Entries are data: JSON, arrays without objects, VTU. Nothing in them is executed, and no path in
  them is followed: the files of an entry are those in its folder.
"""

import dataclasses
import errno
import hashlib
import json
import os
import shutil
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from validation.errors import in_one_line, reason
from validation.harness.console import say
from validation.harness.files import file_digest

Value = TypeVar("Value")
Inputs = Mapping[str, Any]

MANIFEST, VALUES = "manifest.json", "values.json"
TEMPORARY = ".partial-"
# Errors of the system as it is now, which say nothing of the entry.
PASSING = (errno.EMFILE, errno.ENFILE, errno.ENOMEM, errno.EIO, errno.EACCES, errno.EINTR)
ABANDONED_S = 3600.0  # writing an entry takes less than an hour


class DamagedError(Exception):
    """An entry is not what was written; the message says how."""


def _write_values(value: Any, folder: Path) -> None:
    def plain(part: Any) -> Any:
        return part.tolist() if isinstance(part, np.ndarray) else dataclasses.asdict(part)

    (folder / VALUES).write_text(json.dumps(value, default=plain), encoding="utf-8")


def _read_values(kind: type[Value], folder: Path) -> Value:
    from pydantic import TypeAdapter

    return TypeAdapter(kind).validate_json((folder / VALUES).read_bytes())


@dataclass(frozen=True)
class Store:
    """A folder of results.

    folder : created when the first result is kept; None keeps nothing.
    fresh : find nothing; what is computed again replaces what was there.
    """

    folder: Path | None
    fresh: bool = False

    def has(self, inputs: Inputs) -> bool:
        """Whether there is an entry, which may turn out to be damaged."""
        if self.folder is None or self.fresh:
            return False
        return (self.folder / key(inputs)).is_dir()

    def find(self, inputs: Inputs, kind: type[Value]) -> Value | None:
        """The numbers and texts stored for these inputs, None if they have to be computed.

        kind : their type: a dataclass or a JSON type; an array is read back as a list.
        """
        return self.load(inputs, partial(_read_values, kind))

    def obtain(self, inputs: Inputs, kind: type[Value], compute: Callable[[], Value]) -> Value:
        """The result of `find`, or else of `compute`, which is kept as one file of JSON."""
        found = self.find(inputs, kind)
        if found is None:
            found = compute()
            self.keep(inputs, partial(_write_values, found))
        return found

    def load(self, inputs: Inputs, read: Callable[[Path], Value]) -> Value | None:
        """The result stored for these inputs, None if it has to be computed.

        inputs : JSON values.
        read : reads the entry's folder, after its files are verified.
        """
        if self.folder is None or not self.has(inputs):
            return None
        entry = self.folder / key(inputs)
        this = _folder_id(entry)
        try:
            _verify(entry)
            return read(entry)
        except Exception as error:  # JSON, NumPy and the like raise whatever parsing hits
            # if the folder has changed meanwhile, another process is replacing it
            if this is not None and _folder_id(entry) == this:
                why = in_one_line(error, 100) or type(error).__name__
                say(f"stored result {entry}: {why}; it is computed again")
                if not (isinstance(error, MemoryError) or getattr(error, "errno", None) in PASSING):
                    _discard(entry)
        return None

    def keep(self, inputs: Inputs, write: Callable[[Path], None]) -> bool:
        """Keep a result; return whether it was. A full or read-only disk is reported, not raised.

        write : writes the result's files into the folder passed to it.
        """
        if self.folder is None:
            return False
        entry = self.folder / key(inputs)
        if entry.exists() and not self.fresh:
            return True
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            _sweep(self.folder)
            unfinished = _out_of_sight(self.folder)
            try:
                # not `tempfile`, whose folders are private: the user's umask decides the mode
                unfinished.mkdir()
                write(unfinished)
                manifest = {"inputs": inputs, "files": _digests(unfinished)}
                (unfinished / MANIFEST).write_text(json.dumps(manifest, indent=1), encoding="utf-8")
                _discard(entry)
                try:
                    unfinished.rename(entry)
                except OSError as error:
                    if error.errno in (errno.ENOTEMPTY, errno.EEXIST):  # the second: XFS
                        return True  # another process was quicker
                    raise
            finally:
                shutil.rmtree(unfinished, ignore_errors=True)
        except OSError as error:
            say(f"{self.folder}: a result cannot be stored ({reason(error)})")
            return False
        return True


NO_STORE = Store(None)


def _out_of_sight(folder: Path) -> Path:
    """An unused name in a store, which no entry can have."""
    return folder / f"{TEMPORARY}{os.urandom(8).hex()}"


def _discard(entry: Path) -> None:
    """Remove an entry; it is renamed first, so that no one finds half of it."""
    away = _out_of_sight(entry.parent)
    try:
        entry.rename(away)
    except OSError:
        return  # not there, or no permission to remove it
    shutil.rmtree(away, ignore_errors=True)


def _sweep(folder: Path) -> None:
    """Remove what killed processes left."""
    for path in folder.glob(f"{TEMPORARY}*"):
        try:
            if time.time() - path.stat().st_mtime > ABANDONED_S:
                shutil.rmtree(path, ignore_errors=True)
        except OSError:
            continue  # another process removed it


def key(inputs: Inputs) -> str:
    """Name of the entry made from these inputs: SHA-256 of their canonical JSON."""
    text = json.dumps(inputs, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def _folder_id(entry: Path) -> tuple[int, int] | None:
    """Identity of the folder that has this name now, if any; an inode alone may be reused."""
    try:
        found = entry.stat()
    except OSError:
        return None
    return found.st_ino, found.st_mtime_ns


def _digests(folder: Path) -> dict[str, str]:
    """SHA-256 of every file below a folder but the manifest.

    Raises DamagedError: something is not a plain file or folder: a link could lead anywhere.
    """
    found = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if path.is_symlink() or not (path.is_file() or path.is_dir()):
            raise DamagedError(f"{name} is a link or not a file")
        if path.is_file() and name != MANIFEST:
            found[name] = file_digest(path)
    return found


def _verify(entry: Path) -> None:
    """Raise `DamagedError` unless the entry is what was written under this name."""
    if entry.is_symlink():
        raise DamagedError("is a link")
    files = _digests(entry)
    try:
        manifest = json.loads((entry / MANIFEST).read_text(encoding="utf-8"))
        named, listed = key(manifest["inputs"]), dict(manifest["files"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DamagedError(f"{MANIFEST} is missing, truncated or altered") from error
    if named != entry.name:
        raise DamagedError(f"{MANIFEST} was altered")
    for name in sorted({*files, *listed}):
        if files.get(name) != listed.get(name):
            raise DamagedError(f"{name} is missing, truncated or altered")
