"""Mesh files through meshio: .vtu (ParaView) and .msh (gmsh 4.1).

Sets overlap, so each is a field of its own: ``nodes_NAME`` (0 or 1 per point), ``cells_NAME``
(0 or 1 per element) and ``facets_NAME`` (per element, bit i for its local side i).
meshio's format modules are called directly, because ``meshio.read`` ends the process on bad files.
"""

import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from meshes.bounds import check_kind
from meshes.check import check
from meshes.errors import MeshError
from meshes.mesh import FingerMesh, Floats, Ints
from meshes.topology import numbered, sides

_CELL_TYPES = {"hexahedron": 3, "quad": 2}
# Largest extent in Z of a plane mesh over its largest one: files have single precision.
FLAT = 1e-6


def write(mesh: FingerMesh, path: str | Path) -> None:
    """Write `mesh` to `path`; the suffix (.vtu or .msh) chooses the format.

    The file appears whole or not at all.

    Raises
    ------
    MeshError
        If the mesh has hanging nodes, the suffix is unknown or the file cannot be written.
    """
    import meshio

    check_kind("mesh", mesh, FingerMesh)
    if mesh.ties.size:
        raise MeshError(f"{path}: a file cannot hold hanging nodes; mesh with halvings = 0")
    path = Path(path)
    module = _format(path)
    points = np.zeros((len(mesh.points), 3))
    points[:, : mesh.dim] = mesh.points
    point_data = {f"nodes_{k}": _mask(v, len(points)) for k, v in mesh.node_sets.items()}
    cell_data = {f"cells_{k}": [_mask(v, len(mesh.cells))] for k, v in mesh.cell_sets.items()}
    cell_data |= {f"facets_{k}": [_side_bits(mesh, v)] for k, v in mesh.facet_sets.items()}
    kind = "hexahedron" if mesh.dim == 3 else "quad"
    content = meshio.Mesh(points, [(kind, mesh.cells)], point_data, cell_data)
    # a name of its own: another process may write the same file
    partial = path.with_name(f".{path.stem}-{os.urandom(4).hex()}{path.suffix}")
    try:
        version = {"fmt_version": "4.1"} if path.suffix == ".msh" else {}
        module.write(partial, content, binary=True, **version)
        os.replace(partial, path)
    except OSError as error:
        raise MeshError(f"{path}: cannot write ({error.strerror or error})") from error
    finally:
        with suppress(OSError):
            partial.unlink()


def read(path: str | Path) -> FingerMesh:
    """Read and check a mesh that `write` wrote, or another program in the same form.

    Raises
    ------
    MeshError
        One line that names the file and what is wrong: unreadable or truncated, missing sets,
        inverted or degenerate elements, coordinates that are not finite.
    """
    path = Path(path)
    module = _format(path)
    if not os.path.isfile(path):  # also if the name is too long or has a null byte
        what = "is a folder; give a file" if os.path.isdir(path) else "no such file"
        raise MeshError(f"{path}: {what}")
    try:
        content = module.read(path)
    except Exception as error:  # meshio's readers raise whatever their parsing runs into
        reason = " ".join(str(error).split())[:100] or type(error).__name__
        text = "; meshio reads no fields of a .msh in ASCII: save it as binary, or as .vtu"
        remedy = text if path.suffix == ".msh" and _is_ascii(path) else ""
        raise MeshError(f"{path}: unreadable or truncated ({reason}){remedy}") from error
    try:
        mesh = _from_content(content)
        check(mesh)
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from error
    return mesh


def _format(path: Path) -> ModuleType:
    import meshio

    modules: dict[str, ModuleType] = {".vtu": meshio.vtu, ".msh": meshio.gmsh}
    if path.suffix not in modules:
        raise MeshError(f"{path}: suffix {path.suffix!r} is unknown; use .vtu or .msh")
    return modules[path.suffix]


def _is_ascii(path: Path) -> bool:
    """Whether the header of a .msh, ``$MeshFormat``, version, 0 or 1, size, says so."""
    with path.open("rb") as file:
        return file.read(40).split()[2:3] == [b"0"]


def _from_content(content: Any) -> FingerMesh:
    """Build the mesh, its sets from fields, in the order of the mesh that was written."""
    if [block.type for block in content.cells] not in ([kind] for kind in _CELL_TYPES):
        found = ", ".join(sorted({block.type for block in content.cells})) or "nothing"
        raise MeshError(f"holds {found}: need one block of hexahedra or of quadrilaterals")
    (block,) = content.cells
    dim = _CELL_TYPES[block.type]
    points: Floats = np.ascontiguousarray(content.points[:, :dim], dtype=np.float64)
    beside = content.points[:, dim:]
    if beside.size and np.ptp(beside) > FLAT * np.ptp(points):
        raise MeshError("holds quadrilaterals that are not in a plane of constant Z")
    cells: Ints = np.ascontiguousarray(block.data, dtype=np.int64)
    cell_data = {name: data[0] for name, data in content.cell_data.items()}
    node_sets = {
        name: np.flatnonzero(flags) for name, flags in _fields(content.point_data, "nodes_")
    }
    cell_sets = {name: np.flatnonzero(flags) for name, flags in _fields(cell_data, "cells_")}
    facet_sets = {}
    for name, bits in _fields(cell_data, "facets_"):
        chosen = (bits[:, None] >> np.arange(2 * dim)) & 1
        facet_sets[name] = sides(cells)[chosen.astype(bool)]
    return FingerMesh(points, cells, node_sets, facet_sets, cell_sets)


def _fields(data: Mapping[str, Any], prefix: str) -> list[tuple[str, Ints]]:
    """Integer fields whose name starts with `prefix` (.msh stores them as floats)."""
    fields = []
    for key, values in data.items():
        if key.startswith(prefix):
            flat = np.asarray(values, dtype=np.float64).reshape(-1)
            if not np.isfinite(flat).all():
                raise MeshError(f"field {key} holds values that are not finite")
            fields.append((key.removeprefix(prefix), np.rint(flat).astype(np.int64)))
    return fields


def _mask(members: Ints, size: int) -> Ints:
    mask = np.zeros(size, dtype=np.int64)
    mask[members] = 1
    return mask


def _side_bits(mesh: FingerMesh, facets: Ints) -> Ints:
    """Bit i of each element is set if its local side i is among `facets`, (n_cells,)."""
    own, wanted = numbered(sides(mesh.cells).reshape(-1, facets.shape[1]), facets)
    found = np.isin(own, wanted).reshape(len(mesh.cells), -1)
    return np.asarray(found @ (1 << np.arange(2 * mesh.dim)), dtype=np.int64)
