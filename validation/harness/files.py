"""Files and folders of results; a file is written whole or not at all, by a temporary name."""

import contextlib
import fcntl
import hashlib
import json
import os
import re
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from validation.errors import UserError, reason
from validation.harness.record import plain

if TYPE_CHECKING:
    import xarray

LONGEST_NAME = 150  # file systems allow 255 bytes; temporary names and endings need some of them


@contextlib.contextmanager
def atomic(path: Path) -> Iterator[Path]:
    """A temporary path beside ``path`` that takes its place if the block succeeds."""
    temporary = path.with_name(f".{path.name}.{os.urandom(4).hex()}{path.suffix}")
    try:
        # not `tempfile`, whose files are private: the user's umask decides a result's mode
        temporary.touch(exist_ok=False)
        yield temporary
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def exclusive_folder(folder: Path) -> Iterator[Path]:
    """The `output_folder`, locked against other commands until the process ends at the latest.

    Do not nest it on one folder: a process holds a lock only once.

    Raises UserError: the folder cannot be written, or another command is at work there.
    """
    path = output_folder(folder) / ".in_use"
    with _locked(path):
        try:
            yield folder
        finally:
            with contextlib.suppress(OSError):
                path.unlink()


def _locked(path: Path) -> TextIO:
    """A lock's file, held by this process until it is closed."""
    while True:
        file = path.open("a")
        try:
            # of the process: unlike `flock`, not of workers, which may outlive it for a moment
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except (BlockingIOError, PermissionError):
            file.close()
            raise UserError(
                f"{path.parent}: another command is writing its results there; wait for it to end,"
                " or give another --out"
            ) from None
        except OSError:  # a file system without locks
            pass
        # its last owner may have removed the file, and another process may hold a new one
        with contextlib.suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(file.fileno()), path.stat()):
                return file
        file.close()


def write_text(path: Path, text: str) -> None:
    """Write text atomically."""
    with atomic(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_dataset(path: Path, dataset: "xarray.Dataset") -> None:
    """Write netCDF atomically, made in memory: HDF5 crashes the process on a disk that fills up."""
    content = dataset.to_netcdf(engine="h5netcdf")
    with atomic(path) as temporary:
        temporary.write_bytes(content)


def json_text(value: Mapping[str, Any]) -> str:
    """JSON in lines; what is not finite becomes null."""
    return json.dumps(plain(value), indent=2, allow_nan=False)


def write_json(path: Path, value: Mapping[str, Any]) -> None:
    """Write `json_text` atomically."""
    write_text(path, json_text(value) + "\n")


def remove(folder: Path, *patterns: str) -> None:
    """Remove a folder's files of these names, which may have wildcards: an earlier result's."""
    for pattern in patterns:
        for old in folder.glob(pattern):
            old.unlink(missing_ok=True)


def file_digest(path: Path) -> str:
    """SHA-256 of a file's content."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def output_folder(path: Path) -> Path:
    """Create the folder and prove that it can be written to, before any work is done.

    Raises UserError: the folder cannot be created or written.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path):
            pass
    except (OSError, ValueError) as error:  # a path with a null byte is a ValueError
        raise UserError(
            f"--out {path}: cannot write there ({reason(error)}); "
            "choose a folder that you may write to"
        ) from error
    return path


def safe_name(name: str) -> str:
    """A file name that stays inside its folder, whatever the scene's name, and is not too long.

    Different names stay different: a name that has to be altered gets a digest of the original.
    """
    safe = re.sub(r"[^A-Za-z0-9._=-]+", "_", name).strip(".") or "run"
    if safe == name and len(safe) <= LONGEST_NAME:
        return safe
    digest = hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()[:8]
    return f"{safe[:LONGEST_NAME]}-{digest}"
