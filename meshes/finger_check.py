"""Check that a mesh is a given finger: its parts, place and surface, and that its sets hold what
they are named for. The checks that apply to any mesh are in `check`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from meshes.errors import MeshError
from meshes.geometry import FingerGeometry
from meshes.mesh import FingerMesh, Floats, Ints
from meshes.quality import volumes
from meshes.topology import numbered, outer_facets, sides

PLACE = 1e-4
"""Largest distance of a node from where it belongs, over the radius: coordinates of six digits in a
finger some ten radii long are off by 1e-5."""


def check_finger(mesh: FingerMesh, geometry: FingerGeometry) -> None:
    """Refuse a mesh that is not the finger of `geometry` (in 3D: its half Z >= 0).

    Each phalanx must be one body of its own between its hinges' planes, with all outer facets on
    the finger's surface: then its section is round, of the right diameter, and the only volume
    that it may lack is what chords leave out. The sets must be those that `finger_hexahedra` makes.

    Raises
    ------
    MeshError
        Naming the phalanx or the set, what it is and what the finger requires.
    """
    if mesh.phalanges != geometry.phalanges:
        raise MeshError(f"has {mesh.phalanges} phalanges, the finger has {geometry.phalanges}")
    if len(mesh.ties):
        raise MeshError(
            f"has {len(mesh.ties)} hanging nodes, across which this check does not join elements:"
            " check the mesh without halvings"
        )
    bodies = [_Body.of(mesh, geometry, w) for w in range(geometry.phalanges)]
    owner = np.full(len(mesh.points), -1)
    for body in bodies:
        shared = owner[body.nodes] >= 0
        if shared.any():
            raise MeshError(
                f"cell sets phalanx_{owner[body.nodes][shared][0] + 1} and phalanx_{body.w + 1} "
                f"share {np.count_nonzero(shared)} nodes: each phalanx needs its own, hinges join "
                "them"
            )
        owner[body.nodes] = body.w
        body.check_shape()
    for name, held, wanted, place in _sets(mesh, bodies):
        missing, foreign = np.setdiff1d(wanted, held).size, np.setdiff1d(held, wanted).size
        if missing or foreign:
            raise MeshError(
                f"{name}: lacks {missing} of the {wanted.size} {place}"
                + (f" and holds {foreign} others" if foreign else "")
            )


@dataclass(frozen=True)
class _Body:
    """Phalanx `w` (from 0) of a mesh: its outer facets and which of its surfaces each lies on.

    The surfaces are the proximal plane, the distal plane, the plane of symmetry, the holes and the
    round side (the cylinder, and the tip's sphere); `on` is (surfaces, facets). Nodes of the round
    side may stand out by its facets' largest sagitta, for the whole volume (`Sizing.full_volume`).
    """

    w: int
    points: Floats
    cells: Ints
    nodes: Ints
    facets: Ints
    geometry: FingerGeometry
    distance: Floats
    on: Ints
    sagitta: float

    @classmethod
    def of(cls, mesh: FingerMesh, geometry: FingerGeometry, w: int) -> _Body:
        cells = mesh.cells[mesh.cell_sets[f"phalanx_{w + 1}"]]
        nodes, facets = np.unique(cells), outer_facets(cells)
        radius = geometry.radii[w]
        first, last = _ends(geometry, w)
        x, y = mesh.points[:, 0], mesh.points[:, 1]
        far = np.full_like(x, math.inf)
        hole = geometry.shaft_radius
        rounded = geometry.rounded(w)
        to_hole = far
        if hole is not None:
            axes = [first, last][: geometry.shaft_holes(w)]
            to_hole = np.min([np.abs(np.hypot(x - axis, y) - hole) for axis in axes], axis=0)
        surfaces = np.array(
            [
                np.abs(x - first),
                far if rounded else np.abs(x - last),
                np.abs(mesh.points[:, 2]) if mesh.dim == 3 else far,
                to_hole,
                np.linalg.norm(_arms(mesh.points, geometry, w), axis=1) - radius,
            ]
        )
        one, opposite = np.split(mesh.points[facets], 2, axis=1)
        sagitta = np.linalg.norm(one - opposite, axis=2).max(axis=1) ** 2 / (8.0 * radius)
        distance = np.abs(surfaces[:, facets]).max(axis=2)
        flat = (distance[:-1] <= PLACE * radius).any(axis=0)
        largest = float(sagitta[~flat].max(initial=0.0))
        beyond = surfaces[-1, facets]
        distance[-1] = np.maximum(-beyond, beyond - largest).max(axis=1)
        on = distance <= PLACE * radius
        return cls(w, mesh.points, cells, nodes, facets, geometry, distance, on, largest)

    def check_shape(self) -> None:
        """Refuse a phalanx of several parts, of another size or place, or not round."""
        geometry, radius = self.geometry, self.geometry.radii[self.w]
        name, tolerance = f"phalanx {self.w + 1}", PLACE * radius
        parts = _parts(self.cells)
        if parts > 1:
            raise MeshError(
                f"cell set phalanx_{self.w + 1}: {parts} parts not joined by a facet; a phalanx is "
                "one body"
            )
        x, y = self.points[self.nodes, 0], self.points[self.nodes, 1]
        first, last = _ends(geometry, self.w)
        across = np.linalg.norm(self.points[self.nodes, 1:], axis=1)
        low = float(self.points[self.nodes, 2].min()) if self.points.shape[1] == 3 else 0.0
        stands = self.sagitta * geometry.rounded(self.w)
        middle, thick, out = 0.5 * (y.min() + y.max()), 2.0 * across.max(), self.sagitta
        for what, found, wanted, below, above in (
            ("is {} m long, the finger's length is {}", np.ptp(x), first - last, 0.0, stands),
            ("begins at x = {} m, its hinge in the finger is at {}", x.max(), first, 0.0, 0.0),
            ("lies {} m above the axis y = {}", middle, 0.0, out, out),
            ("begins at z = {} m, a half finger at {}", low, 0.0, 0.0, 0.0),
            ("is {} m thick, the finger's diameter is {}", thick, 2.0 * radius, 0.0, 2.0 * out),
        ):
            if not -tolerance - below <= found - wanted <= tolerance + above:
                said = what.format(f"{found:.4g}", f"{wanted + 0.0:.4g}")
                huge = abs(found) > 100.0 * abs(wanted) > 0.0
                metres = "; coordinates are in metres" * bool(huge)
                raise MeshError(f"{name} {said}{metres}")
        nearest = self.distance.min(axis=0)
        off = np.flatnonzero(~self.on.any(axis=0))
        if off.size:
            worst = off[np.argmax(nearest[off])]
            middle = ", ".join(f"{c:.4g}" for c in self.points[self.facets[worst]].mean(axis=0))
            raise MeshError(
                f"{name} has {off.size} of {len(self.facets)} outer facets off the finger's "
                f"surface, by up to {nearest[worst]:.3g} m around ({middle})"
            )
        self._check_volume(name)

    def _check_volume(self, name: str) -> None:
        """Chords of angle θ keep sin θ/θ of a circle, and more than its cube of a sphere."""
        side = self.facets[self.on[-1] & ~self.on[:-1].any(axis=0)]
        arms = _arms(self.points, self.geometry, self.w)[side]
        arms /= np.linalg.norm(arms, axis=2, keepdims=True)
        cosine = np.einsum("fki,fki->fk", arms, np.roll(arms, 1, axis=1))
        angle = math.acos(np.clip(cosine.min(initial=1.0), -1.0, 1.0))
        exact, hole = _volume(self.geometry, self.w, self.points.shape[1])
        found = float(volumes(self.points, self.cells).sum())
        if not (
            (exact * float(np.sinc(angle / math.pi)) ** 3) * (1 - 3 * PLACE)
            < found
            < (exact + hole) * (1 + 3 * PLACE)
        ):
            unit = "m^3" if self.points.shape[1] == 3 else "m^2"
            raise MeshError(f"{name} fills {found:.4g} {unit}, the finger's {exact:.4g}")


def _ends(geometry: FingerGeometry, w: int) -> tuple[float, float]:
    """X of a phalanx's proximal and distal end, m."""
    ends = (*geometry.hinges, geometry.end)
    return ends[w], ends[w + 1]


def _arms(points: Floats, geometry: FingerGeometry, w: int) -> Floats:
    """Vectors to points from the axis, or from the sphere's centre beyond it, (n, dim) m."""
    arms = points.copy()
    centre = geometry.end + geometry.radii[-1]
    arms[:, 0] = np.minimum(points[:, 0] - centre, 0.0) if geometry.rounded(w) else 0.0
    return arms


def _parts(cells: Ints) -> int:
    """Number of groups of elements that facets join."""
    each = sides(cells)
    (facet,) = numbered(each.reshape(-1, each.shape[2]))
    element = np.repeat(np.arange(len(cells)), each.shape[1])
    link = coo_matrix((np.ones(element.size), (element, facet))).tocsr()
    return int(connected_components(link @ link.T, directed=False)[0])


def _volume(geometry: FingerGeometry, w: int, dim: int) -> tuple[float, float]:
    """A phalanx's volume (3D: of its half; 2D: area) and that of the holes left out of it."""
    radius = geometry.radii[w]
    rounded = geometry.rounded(w)
    length = geometry.lengths[w] - (radius if rounded else 0.0)
    section = 0.5 * math.pi * radius**2 if dim == 3 else 2.0 * radius
    ball = math.pi * radius**3 / 3.0 if dim == 3 else 0.5 * math.pi * radius**2
    hole = 0.0
    if (r := geometry.shaft_radius) is not None:
        # ∫ sqrt(r² - y²) t(y) dy over (-r, r), t the half model's thickness; Gauss-Chebyshev
        turn = math.pi * np.arange(1, 33) / 33
        thickness = np.sqrt(radius**2 - (r * np.cos(turn)) ** 2) if dim == 3 else 1.0
        hole = float(np.sum(math.pi / 33 * np.sin(turn) ** 2 * thickness) * r**2)
        hole *= geometry.shaft_holes(w)
    return section * length + (ball if rounded else 0.0) - hole, hole


def _sets(mesh: FingerMesh, bodies: list[_Body]) -> Iterator[tuple[str, Ints, Ints, str]]:
    """Every set's name, the numbers that it holds, those that it should hold, and what they are."""
    if mesh.dim == 3:
        plane = [body.facets[body.on[2]].ravel() for body in bodies]
        yield _row(mesh, "symmetry", np.concatenate(plane), "on the plane z = 0")
    for body in bodies:
        w, last = body.w + 1, body.w == len(bodies) - 1
        for side, which in enumerate(("proximal", "distal")):
            if which == "distal" and last:
                continue
            at = _ends(body.geometry, body.w)[side] + 0.0
            place = f"of phalanx {w}'s end face at x = {at:.4g} m"
            face = np.unique(body.facets[body.on[side]])
            yield _row(mesh, f"{which}_face_{w}", face, place)
            if body.geometry.shaft_radius is not None:
                rim = np.unique(body.facets[body.on[3]])
                if not rim.size:
                    raise MeshError(
                        f"phalanx {w} has no holes, and the finger's shafts have radius"
                        f" {body.geometry.shaft_radius:g} m"
                    )
                face, place = np.intersect1d(face, rim), f"of the hole's edges {place}"
            yield _row(mesh, f"hinge_{w}_{which}", face, place)
    body = bodies[-1]
    end, radius = body.geometry.end, body.geometry.radii[-1]
    pole = np.zeros(mesh.dim)
    pole[0] = end
    at_pole = np.linalg.norm(mesh.points[body.nodes] - pole, axis=1) <= PLACE * radius
    yield _row(mesh, "pole", body.nodes[at_pole], f"at the tip's end, x = {end:.4g} m")
    touching = body.facets[~body.on[[0, 2, 3]].any(axis=0)]
    near = (mesh.points[touching, 0] <= end + radius * (1.0 + PLACE)).all(axis=1)
    yield _row(mesh, "tip", touching[near], "on the last phalanx's round end")
    for name, facets, where in (
        ("surface", touching, "outer side"),
        ("tip", touching[near], "round end"),
    ):
        held, wanted = numbered(mesh.facet_sets[name], facets)
        place = f"facets of the last phalanx's {where}"
        yield f"facet set {name}", held, np.unique(wanted), place


def _row(mesh: FingerMesh, name: str, wanted: Ints, place: str) -> tuple[str, Ints, Ints, str]:
    return f"node set {name}", mesh.node_sets[name], np.unique(wanted), f"nodes {place}"
