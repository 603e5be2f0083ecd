"""Fields of a solid run as files that ParaView, PyVista and meshio open: VTU steps and a PVD."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from validation.harness.files import atomic, write_text

if TYPE_CHECKING:
    import reference_fem


@dataclass(frozen=True)
class Fields:
    """A mesh and its fields over time.

    points : (n_points, dim), m.
    cells : (n_cells, 8) hexahedra or (n_cells, 4) quadrilaterals, VTK order.
    steps : the reference's snapshots, in the order of time.
    """

    points: NDArray[Any]
    cells: NDArray[Any]
    steps: "tuple[reference_fem.Snapshot, ...]"


def _three(vectors: NDArray[Any]) -> NDArray[Any]:
    """Vectors with three components, as VTK wants them."""
    import numpy as np

    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))


def write_fields(folder: Path, fields: Fields) -> Path:
    """Write ``tap.pvd`` and one VTU per step; returns the PVD's path.

    Raises
    ------
    OSError
        Not all could be written; those that were are removed: nothing names them.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "tap.pvd"
    files = [folder / f"tap_{number:03d}.vtu" for number in range(len(fields.steps))]
    entries = [
        f'    <DataSet timestep="{step.time_s!r}" part="0" file="{file.name}"/>\n'
        for step, file in zip(fields.steps, files, strict=True)
    ]
    try:
        for step, file in zip(fields.steps, files, strict=True):
            _write_step(file, fields, step)
        write_text(
            path,
            '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n'
            + "".join(entries)
            + "  </Collection>\n</VTKFile>\n",
        )
    except OSError:
        for file in files:
            file.unlink(missing_ok=True)
        raise
    return path


def _write_step(path: Path, fields: Fields, step: "reference_fem.Snapshot") -> None:
    """One step's VTU file."""
    import meshio

    kind = "hexahedron" if fields.cells.shape[1] == 8 else "quad"
    mesh = meshio.Mesh(
        _three(fields.points),
        [(kind, fields.cells)],
        point_data={
            "displacement": _three(step.displacement),
            "velocity": _three(step.velocity),
            "contact_pressure_Pa": step.contact_pressure_Pa,
        },
        cell_data={"von_mises_Pa": [step.von_mises_Pa]},
    )
    with atomic(path) as temporary:
        mesh.write(temporary, file_format="vtu")
