"""Restart files: a run that is killed at any moment resumes to the same result, bit for bit."""

import contextlib
import dataclasses
import hashlib
import json
import os
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import llvmlite.binding
import numba
import numpy as np
from numpy.typing import NDArray

import meshes
from reference_fem.results.dataset import versions

Arrays = Mapping[str, NDArray[Any]]

IDENTITY, CHECKSUM = "identity", "checksum"


class RestartError(ValueError):
    """A restart file cannot be used or written; the message is one line meant for users."""


@dataclass(frozen=True)
class Restart:
    """Where a run leaves what it needs to be resumed.

    Parameters
    ----------
    path : an .npz file, replaced as a whole at each writing. It stays when the run ends: the caller
        removes it once the result is kept, so that a kill in between loses nothing.
    resume : whether to continue from the file; without a file there the run starts afresh.
    every_s : wall time between two writings, s; 0 writes after every block of steps.
    """

    path: Path
    resume: bool = False
    every_s: float = 30.0


def identity(**parts: object) -> dict[str, str]:
    """Identity of a run, part by part: SHA-256 of each input and of what decides its bits.

    The same bits need the same code, compiler and number of threads, and arithmetic that rounds
    alike: a run resumed with another BLAS would go on with a step that differs in its last bits,
    and could not be repeated.
    """
    code = hashlib.sha256(repr(versions("numba", "numpy", "scikit-fem")).encode())
    for package in (Path(meshes.__file__).parent, Path(__file__).parents[1]):
        for source in sorted(package.rglob("*.py")):
            code.update(source.read_bytes())
    run = {"program": code.hexdigest(), "processor or BLAS": arithmetic()}
    return run | {name: digest(part) for name, part in parts.items()}


def arithmetic() -> str:
    """SHA-256 of linear algebra's results for fixed numbers, and of the target processor.

    BLAS chooses its kernels by the processor, its number of threads and the environment, and they
    round differently. Their results tell which of them differ in effect; names do not. The
    operations are those behind the stable step, the hinges and the reading of the stress.
    """
    numbers = np.sqrt(np.arange(1.0, 30001.0)) % 1.0  # exact: the same everywhere
    square, long = numbers[:576].reshape(24, 24), numbers.reshape(1000, 30)
    results = (
        np.linalg.norm(numbers),
        numbers @ numbers[::-1].copy(),
        long @ numbers[:30],
        numbers[:1000] @ long,
        *np.linalg.eigh(square + square.T),
        np.linalg.inv(square @ square.T + np.eye(24)),
        np.linalg.pinv(long[:40, :2].copy()),
    )
    processor = numba.config.CPU_NAME or llvmlite.binding.get_host_cpu_name()
    return digest([processor, *map(np.asarray, results)])


def digest(value: object) -> str:
    """SHA-256 of a value made of dataclasses, mappings, sequences, arrays and plain values."""
    if isinstance(value, np.ndarray):
        head = f"{value.dtype.str}{value.shape}".encode()
        return hashlib.sha256(head + np.ascontiguousarray(value).tobytes()).hexdigest()
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        text = repr(sorted((str(key), digest(item)) for key, item in value.items()))
    elif isinstance(value, tuple | list):
        text = repr([digest(item) for item in value])
    else:
        text = repr(value)
    return hashlib.sha256(text.encode()).hexdigest()


class RestartFile:
    """One run's restart file.

    restart : where, and how often. run : the run's identity; a file with another one is refused.
    """

    def __init__(self, restart: Restart, run: Mapping[str, str]) -> None:
        self._restart = restart
        self._run = dict(run)
        self._written: float | None = None
        self.problem = ""

    @property
    def due(self) -> bool:
        """Whether it is time to write: at once the first time."""
        since = self._written
        return since is None or time.perf_counter() - since >= self._restart.every_s

    def write(self, arrays: Arrays) -> None:
        """Replace the file: a reader sees the old one or the new one, whole.

        A disk that fills up later on does not end a long run: the previous file stays, and
        `problem` says why.

        Raises RestartError: if it cannot be written the first time.
        """
        path = self._restart.path
        partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
        content = dict(arrays) | {
            IDENTITY: np.array(json.dumps(self._run)),
            CHECKSUM: np.array(digest(dict(arrays))),
        }
        try:
            with partial.open("wb") as file:
                np.savez(file, allow_pickle=False, **content)
                file.flush()
                os.fsync(file.fileno())
            partial.replace(path)
        except OSError as error:
            self.problem = (
                f"{path}: the restart file cannot be written ({error.strerror or error}); "
                "make room or choose another folder"
            )
            if self._written is None:
                raise RestartError(self.problem) from error
        else:
            self.problem = ""
        finally:  # an interrupt leaves nothing behind either
            with contextlib.suppress(OSError):
                partial.unlink()
        self._written = time.perf_counter()

    def read(self) -> dict[str, NDArray[Any]] | None:
        """The arrays written last; None if the run is to start afresh or nothing was written.

        Raises RestartError: the file is truncated, altered, or of another run.
        """
        path = self._restart.path
        if not self._restart.resume or not path.exists():
            return None
        try:
            with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
                content = {name: file[name] for name in file.files}
            run, checksum = json.loads(str(content.pop(IDENTITY))), str(content.pop(CHECKSUM))
        except Exception as error:  # numpy, zipfile and zlib raise whatever their parsing hits
            reason = " ".join(str(error).split())[:100] or type(error).__name__
            raise self.refused(f"is truncated or not a restart file ({reason})") from error
        if checksum != digest(content):
            raise self.refused("was altered after it was written")
        differing = [name for name in self._run if run.get(name) != self._run[name]]
        if differing:
            raise self.refused(f"belongs to another run: different {', '.join(differing)}")
        return content

    def refused(self, what: str) -> RestartError:
        """The error that refuses this file, and says what to do."""
        return RestartError(
            f"{self._restart.path}: the restart file {what}; delete it or start without resuming"
        )
