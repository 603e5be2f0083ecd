"""The finger's mesh, as all other packages receive it, and the package's array types."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from meshes.errors import MeshError
from meshes.geometry import FingerGeometry

PHALANX = re.compile(r"phalanx_([1-9]\d*)")  # names of the cell sets, by number
Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]


@dataclass(frozen=True)
class FingerMesh:
    """Hexahedra (half model Z >= 0) or quadrilaterals of a finger at rest along -X.

    Parameters
    ----------
    points : node positions, (n_points, dim), m
    cells : nodes of each element, (n_cells, 8 or 4), in VTK's (and gmsh's) order
    node_sets : sorted node numbers by name: ``hinge_w_proximal``, ``hinge_w_distal``,
        ``proximal_face_w``, ``distal_face_w``, ``tip``, ``pole`` and (3D) ``symmetry``; w counts
        phalanges from 1. A hinge holds the mean position by area of its nodes' face: the end face,
        or the edges of a shaft's hole in it.
    facet_sets : nodes of outer facets by name, (k, 4 or 2), outward oriented: ``surface`` (all of
        the last phalanx that can touch), ``tip``
    cell_sets : sorted element numbers by name: ``phalanx_w``, and ``relaxing``: if there is such a
        set, its elements alone have their material's relaxation time
    shape : geometry of the meshed finger, if it is known; flat facets leave some of its volume
        out
    ties : (h, 5 or 3), nodes that hang on their neighbours' sides, each followed by the nodes at
        whose mean it stays, none of which hangs (see `halving`)
    """

    points: Floats
    cells: Ints
    node_sets: Mapping[str, Ints]
    facet_sets: Mapping[str, Ints]
    cell_sets: Mapping[str, Ints]
    shape: FingerGeometry | None = None
    ties: Ints = field(default_factory=lambda: np.empty((0, 1), dtype=np.int64))

    def __post_init__(self) -> None:
        points = np.asarray(self.points, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] not in (2, 3):
            raise MeshError(f"points: of shape {points.shape}; must be (n, 2) or (n, 3)")
        corners, sides = 2 ** points.shape[1], 2 ** (points.shape[1] - 1)
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "cells", _numbers("cells", self.cells, corners))
        for name, width in (("node_sets", None), ("facet_sets", sides), ("cell_sets", None)):
            given = getattr(self, name).items()
            members = {of: _numbers(f"{name} {of}", v, width) for of, v in given}
            object.__setattr__(self, name, MappingProxyType(members))

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle and copy, which do not accept mapping proxies."""
        given = (getattr(self, f.name) for f in fields(self))
        return FingerMesh, tuple(dict(v) if isinstance(v, Mapping) else v for v in given)

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return int(self.points.shape[1])

    @property
    def phalanges(self) -> int:
        """Number of phalanges: of cell sets ``phalanx_w``."""
        return sum(PHALANX.fullmatch(name) is not None for name in self.cell_sets)

    @property
    def relaxing(self) -> Ints:
        """Elements that have their material's relaxation time: the set, or all of them."""
        return self.cell_sets.get("relaxing", np.arange(len(self.cells)))

    @property
    def radii(self) -> Floats:
        """Radii of the phalanges, (P,) m: of the shape, beyond which nodes may stand out, or, where
        it is not known, of the outermost nodes.
        """
        if self.shape is not None:
            return np.array(self.shape.radii)
        height = np.abs(self.points[:, 1])
        cells = (self.cells[self.cell_sets[f"phalanx_{w + 1}"]] for w in range(self.phalanges))
        return np.array([height[own].max() for own in cells])


@dataclass(frozen=True)
class PhalanxMesh:
    """One phalanx while it is built: proximal end at x = 0, along -x, in mm.

    Roles: ``proximal_face``, ``shaft`` (lateral surface), ``symmetry`` (3D), then ``distal_face``
    (flat end) or ``sphere`` (rounded), and ``pole``. An end with a shaft's hole has
    ``proximal_hole`` (``distal_hole``), and ``proximal_edges`` where the hole leaves the end face.

    points : (n, dim)
    cells : (m, 2^dim), in VTK's order
    roles : sorted outer nodes by role
    facets : (k, 2^(dim-1)), all outer ones, outward oriented; empty until they are looked for
    ties : (h, 1 + 2^(dim-1)), hanging nodes, each followed by those at whose mean it stays (an
        edge's two stand twice in 3D)
    """

    points: Floats
    cells: Ints
    roles: Mapping[str, Ints]
    facets: Ints
    ties: Ints


def _numbers(name: str, given: Any, width: int | None = None) -> Ints:
    """Check node or element numbers, in rows of `width`; a mask of truth values is refused."""
    numbers = np.asarray(given)
    if numbers.size and numbers.dtype.kind not in "iu":
        raise MeshError(f"{name}: must be whole numbers, not {numbers.dtype}")
    rows = (width,) if width else ()
    if numbers.size and numbers.shape[1:] != rows:
        wanted = ", ".join(map(str, ("n", *rows)))
        raise MeshError(f"{name}: of shape {numbers.shape}; must be ({wanted})")
    return numbers.astype(np.int64, copy=False)
