"""What a result is made from: scene, program, versions, machine. All of it, or it has no name.

The same bits and the same time need the same inputs, source, libraries, processor and threads.
"""

import hashlib
import importlib.util
import os
import platform
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from validation.harness.provenance import processor, version
from validation.scenes.tables import Scene

VALIDATION = Path(__file__).parents[1]
# Of this package: what turns tables into a model's arguments and its result into a record.
TRANSLATION = tuple(
    VALIDATION / name
    for name in (
        "models", "scenes", "runs/execute.py", "harness/fields.py", "harness/record.py",
        "harness/files.py", "harness/store.py", "harness/identity.py", "harness/stored_run.py",
    )
)  # fmt: skip
SOURCES = {
    "hcm": ("hcm",),
    "fem3d": ("reference_fem", "meshes"),
    "fem2d": ("reference_fem", "meshes"),
}
LIBRARIES = {
    "hcm": ("numpy", "scipy", "numba", "llvmlite"),
    "fem3d": ("numpy", "scipy", "numba", "llvmlite", "gmsh", "scikit-fem", "meshio"),
}
LIBRARIES["fem2d"] = LIBRARIES["fem3d"]
NO_MEANING = ("NUMBA_CACHE_DIR", "NUMBA_CACHE_LOCATOR_CLASSES", "NUMBA_COLOR_SCHEME")


def source_digest(paths: Iterable[Path]) -> str:
    """SHA-256 of the Python files and TOML tables at and below the paths, names included."""
    digest = hashlib.sha256()
    for root in paths:
        files = (
            (p for p in root.rglob("*") if p.suffix in (".py", ".toml"))
            if root.is_dir()
            else (root,)
        )
        for path in sorted(files):
            digest.update(path.relative_to(root.parent).as_posix().encode())
            digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def _package(name: str) -> Path:
    """A package's folder, found without importing it."""
    spec = importlib.util.find_spec(name)
    assert spec is not None
    assert spec.origin is not None
    return Path(spec.origin).parent


def program(*models: str, files: Iterable[Path] = ()) -> dict[str, Any]:
    """Source, versions and machine that results of these models depend on.

    Parameters
    ----------
    models : hcm, fem3d, fem2d.
    files : further sources that take part in the result.
    """
    packages = sorted({package for model in models for package in SOURCES[model]})
    libraries = sorted({library for model in models for library in LIBRARIES[model]})
    settings = {
        k: v for k, v in os.environ.items() if k.startswith("NUMBA_") and k not in NO_MEANING
    }
    return {
        "source": source_digest([*map(_package, packages), *TRANSLATION, *files]),
        "versions": {library: version(library) for library in libraries},
        "python": platform.python_version(),
        "machine": [platform.machine(), platform.system(), processor()],
        "numba": settings,
    }


def scene_inputs(tables: Scene, model: str) -> dict[str, Any]:
    """The tables that a model reads, canonical: defaults filled in, the other models' left out."""
    document: dict[str, Any] = tables.model_dump(mode="json")
    own = "hcm" if model == "hcm" else "fem"
    document["solver"] = {own: document["solver"][own]}
    mesh = tables.solver.fem.mesh if own == "fem" else None
    return {"tables": document, "mesh_sha256": None if mesh is None else _content(Path(mesh))}


def _content(path: Path) -> str:
    """SHA-256 of a file; of nothing where it cannot be read, which the solver then says."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return ""


def run_inputs(tables: Scene, model: str, of: Mapping[str, Any], **more: Any) -> dict[str, Any]:
    """Inputs of a run.

    Parameters
    ----------
    of : the model's `program`.
    more : what else the result depends on, as JSON values: a start state, wanted times.
    """
    return {"model": model, "program": dict(of), **scene_inputs(tables, model), **more}
