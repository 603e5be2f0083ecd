"""Where a number comes from: the scene as TOML, versions, machine."""

import importlib.util
import os
import platform
from datetime import UTC, datetime
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import tomli_w

PACKAGES = ("fingertap", "numpy", "scipy", "numba", "scikit-fem", "gmsh", "meshio")


@cache  # what is installed does not change while a program runs
def version(package: str) -> str:
    """A distribution's version, or "source tree" if it is not installed."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "source tree"


def installed(package: str) -> bool:
    """Whether there is a Python package of this name; it is not loaded."""
    return importlib.util.find_spec(package) is not None


def cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@cache
def processor() -> str:
    """The processor's name and how many cores this process may use."""
    name = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                name = line.partition(":")[2].strip()
                break
    return f"{name}, {cores()} cores"


def now() -> str:
    """Date and time, UTC."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def provenance(document: dict[str, Any]) -> dict[str, Any]:
    """Scene, versions, machine and date of a run."""
    return {
        "scene_toml": tomli_w.dumps(document),
        "created": now(),
        "versions": {package: version(package) for package in PACKAGES},
        "python": platform.python_version(),
        "platform": platform.platform(),
        "processor": processor(),
    }
