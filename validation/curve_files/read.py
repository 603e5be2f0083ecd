"""A file of curves as a reference: which format it has, and its record."""

import os
from dataclasses import dataclass, replace
from pathlib import Path

from validation.curve_files.contract import read_sidecar
from validation.curve_files.curves import curves_of
from validation.curve_files.solver_output import DAT, RCFORC, read_solver_output
from validation.curve_files.table import read_table
from validation.errors import UserError
from validation.harness.quantities import ESTIMATED
from validation.harness.record import RunRecord
from validation.models.curves import beyond_friction, record_of
from validation.scenes.load import NamedScene, file_name, read_text


@dataclass(frozen=True)
class Reference:
    """A record made from a file, and what was done to it in lines."""

    record: RunRecord
    notes: tuple[str, ...]


def is_curve_file(source: str) -> bool:
    """Whether a reference's name is a file's."""
    name = os.path.basename(source)
    return os.path.isfile(source) or name.endswith((".csv", ".dat")) or name.startswith("rcforc")


def read_reference(source: str, scene: NamedScene) -> Reference:
    """The curves in a file as a reference of the scene; their model is called as the file.

    ``*.dat`` is CalculiX's, a file with LS-DYNA's lines is an rcforc, all others are CSV.

    Raises UserError: the file, or the one beside it, is refused.
    """
    path = Path(source)
    if not os.path.isfile(source):
        raise UserError(f"--reference {source}: is not a file; check the path")
    text, sidecar = read_text(path, source, largest=500_000_000), read_sidecar(path)
    if sidecar.scene not in (None, scene.name):
        raise UserError(f"{source}.toml: scene = {sidecar.scene!r}, not {scene.name}")
    if path.suffix == ".dat" and not DAT.search(text):
        raise UserError(f"{source}: has no contact output; print it by *CONTACT PRINT with CF")
    read = read_solver_output if DAT.search(text) or RCFORC.search(text) else read_table
    curves, notes = curves_of(read(text, source, sidecar), source, sidecar)
    notes += beyond_friction(curves, scene.tables.surface.friction)
    name = file_name(path.name)
    record = record_of(curves, scene, name)
    known = [key for key in ESTIMATED if record.summary.get(key) is not None]
    if unknown := sidecar.uncertainty.model_fields_set - set(known):
        raise UserError(
            f"{source}.toml: uncertainty.{min(unknown)}: the data has no such number; state it"
            f" under [scalars], or leave this out; it has {', '.join(known)}"
        )
    # what it doubts is among the notes, with what to do
    record = replace(record, message="", provenance={**record.provenance, "data": {name: notes}})
    return Reference(record, tuple(f"{name}: {note}" for note in notes))
