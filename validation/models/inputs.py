"""The inputs of a model's run, under which a store holds its result."""

import os
from pathlib import Path
from typing import Any

from validation.harness.files import file_digest
from validation.harness.identity import program
from validation.models import adapter
from validation.scenes.scene import Scene


def scene_inputs(tables: Scene, model: str) -> dict[str, Any]:
    """The tables that a model reads, canonical: defaults filled in, the other models' left out."""
    document: dict[str, Any] = tables.model_dump(mode="json")
    own = adapter(model).settings
    document["solver"] = {}
    if own:  # an accuracy for all solvers applies to this one
        table = getattr(tables.solver, own).model_dump(mode="json")
        document["solver"] = {own: {**table, "accuracy": tables.solver.accuracy_of(own)}}
    mesh = tables.solver.fem.mesh if own == "fem" else None
    return {"tables": document, "mesh_sha256": None if mesh is None else _content(Path(mesh))}


def _content(path: Path) -> str:
    """SHA-256 of a file; empty if it cannot be read, which the solver reports."""
    if not os.path.isfile(path):  # a pipe would never end, a path with a null byte is invalid
        return ""
    try:
        return file_digest(path)
    except OSError:
        return ""


def run_inputs(tables: Scene, model: str, *modules: str, **more: Any) -> dict[str, Any]:
    """Inputs of a run.

    model : hcm, fem3d, fem2d; the code of its adapter and package counts as input.
    modules : further modules whose code makes the result.
    more : other inputs of the result, as JSON values: a start state, wanted times.
    """
    found = adapter(model)
    made_by = program(*found.sources, *modules, without=found.independent_of)
    return {"model": model, "program": made_by, **scene_inputs(tables, model), **more}
