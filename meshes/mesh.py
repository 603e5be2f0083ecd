"""The mesh that everything else receives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from meshes.arrays import Floats, Ints


@dataclass(frozen=True)
class FingerMesh:
    """Hexahedra (half model Z >= 0) or quadrilaterals of a finger at rest along -X.

    Parameters
    ----------
    points
        Node positions, (n_points, dim), m.
    cells
        Nodes of each element, (n_cells, 8 or 4), in VTK's (and gmsh's) order.
    node_sets
        Sorted node numbers by name: ``hinge_w_proximal``, ``hinge_w_distal``, ``proximal_face_w``,
        ``distal_face_w``, ``tip``, ``pole`` and (3D) ``symmetry``; w counts phalanges from 1.
    facet_sets
        Nodes of outer facets by name, (k, 4 or 2), outward oriented: ``surface`` (all of the last
        phalanx that can touch), ``tip``.
    cell_sets
        Sorted element numbers by name: ``phalanx_w``.
    """

    points: Floats
    cells: Ints
    node_sets: Mapping[str, Ints]
    facet_sets: Mapping[str, Ints]
    cell_sets: Mapping[str, Ints]

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return int(self.points.shape[1])

    @property
    def phalanges(self) -> int:
        """Number of phalanges."""
        return len(self.cell_sets)
