"""One phalanx as a block structure, in its own coordinates: proximal end at x = 0, along -x."""

from collections.abc import Callable
from operator import attrgetter

import numpy as np

from meshes.blocks import Blocks, gmsh_session
from meshes.grading import Division
from meshes.mesh import PhalanxMesh
from meshes.o_grid import HINGE_DEPTH, Station, bulge_centre, names, section_point, tip_point
from meshes.plan import PhalanxPlan
from meshes.shaft_hole import HoledEnd


def mesh_phalanx(plan: PhalanxPlan, dim: int) -> PhalanxMesh:
    """One phalanx in hexahedra (`dim` 3, half model z >= 0) or quadrilaterals (2), as gmsh has it.

    Elements may be wound the wrong way round, nodes lie on surfaces up to rounding.
    """
    with gmsh_session("fingertap-phalanx") as gmsh:
        blocks = Blocks(gmsh)
        builder = _Builder(blocks, plan, dim)
        faces = builder.build()
        points, cells = blocks.generate(dim)
        roles = {role: blocks.nodes_on(dim - 1, tags) for role, tags in faces.items()}
        roles |= {role: blocks.nodes_on(dim - 2, tags) for role, tags in builder.edges.items()}
        if builder.pole:
            roles["pole"] = blocks.nodes_on(0, [builder.pole])
    none = np.empty((0, 1 + 2 ** (dim - 1)), dtype=np.int64)
    return PhalanxMesh(points[:, :dim].copy(), cells, roles, facets=none[:, 1:], ties=none)


Ease = Callable[[Division], Division]
"""How much of the contact's gradings a section keeps: all, half or nothing."""


_halfway: Ease = attrgetter("halfway")
_even: Ease = attrgetter("evened")


def _graded(division: Division) -> Division:
    return division


class _Builder:
    """The stations of one phalanx and the blocks between them."""

    def __init__(self, blocks: Blocks, plan: PhalanxPlan, dim: int) -> None:
        self.blocks = blocks
        self.plan = plan
        self.dim = dim
        self.pole = 0
        self.edges: dict[str, list[int]] = {}

    def build(self) -> dict[str, list[int]]:
        """Lay the blocks; return the tags of the faces (curves in 2D) of each role."""
        plan = self.plan
        depth = HINGE_DEPTH * plan.radius
        near = _graded if plan.lies else _even
        hinge = self._section(-depth if plan.holes else 0.0, near, near)
        end = -plan.shaft + (depth if plan.holes == 2 else 0.0)
        lower = _graded if plan.beside or plan.lies else _halfway
        far = self._section(end, lower, _even)
        for name in names(self.dim):
            self.blocks.curve(far[name], hinge[name], plan.axial)
        self._fill(hinge, far)
        roles = {"shaft": self._lateral(hinge, far)}
        symmetry = self._symmetry(hinge, far)
        self._close("proximal", hinge, 0.0 if plan.holes else None, roles, symmetry)
        if plan.rounded:
            roles["sphere"], more = self._tip(far)
            symmetry += more
        else:
            self._close("distal", far, -plan.shaft if plan.holes == 2 else None, roles, symmetry)
        if self.dim == 3:
            roles["symmetry"] = symmetry
        return roles

    def _close(
        self,
        which: str,
        section: Station,
        holed_at: float | None,
        roles: dict[str, list[int]],
        symmetry: list[int],
    ) -> None:
        """Make the section an end, or lay the blocks up to an end with a hole at `holed_at`."""
        if holed_at is None:
            roles[f"{which}_face"] = [self._face(corners) for corners in _quads(section, self.dim)]
            if which == "distal":
                self.pole = section["axis"]
            return
        inwards = -1.0 if which == "proximal" else 1.0
        end = HoledEnd(self.blocks, self.plan, self.dim, holed_at, inwards, section)
        roles[f"{which}_face"], roles[f"{which}_hole"] = end.face, end.hole
        roles["shaft"] += end.shaft
        symmetry += end.symmetry
        self.edges[f"{which}_edges"] = end.edges

    def _section(self, x: float, lower: Ease, upper: Ease) -> Station:
        """Points and curves of the plane section at `x`, its halves graded by `lower`, `upper`."""
        points = {
            name: self.blocks.point(*section_point(name, x, self.plan.radius))
            for name in names(self.dim)
        }
        self._divide(points, lower, upper, points["axis"], bulged_at=x)
        return points

    def _divide(
        self,
        station: Station,
        lower: Ease,
        upper: Ease,
        centre: int,
        bulged_at: float | None = None,
    ) -> None:
        """Curves of a station, its outer ones about `centre`; the core's are half way to even.

        `bulged_at` is the x of a plane section, whose core is bounded by arcs. The tip's station
        has a core of straight lines, and curves from its outer points to the pole.
        """
        blocks, plan = self.blocks, self.plan
        tip = bulged_at is None
        axis = station["axis"]
        inwards = lower(plan.inwards)
        for half, ease, along in (("-", lower, plan.lower), ("+", upper, plan.upper)):
            across, along = ease(plan.across), ease(along)
            cy, oy = station["cy" + half], station["oy" + half]
            blocks.curve(oy, cy, inwards)
            blocks.curve(cy, axis, along.halfway)
            if tip:
                blocks.curve(oy, self.pole, along, centre)
            if self.dim == 2:
                continue
            cc, oc = station["cc" + half], station["oc" + half]
            bulge_y, bulge_z = (
                None
                if bulged_at is None
                else blocks.point(*bulge_centre(side, bulged_at, plan.radius))
                for side in ("cy" + half, "cz")
            )
            blocks.curve(oc, cc, inwards)
            blocks.curve(cy, cc, across.halfway, bulge_y)
            blocks.curve(oy, oc, across, centre)
            blocks.curve(cc, station["cz"], along.halfway, bulge_z)
            blocks.curve(oc, station["oz"], along, centre)
        if self.dim == 3:
            blocks.curve(station["oz"], station["cz"], inwards)
            blocks.curve(axis, station["cz"], lower(plan.across).halfway)
            if tip:
                blocks.curve(self.pole, station["oz"], lower(plan.across), centre)

    def _tip(self, equator: Station) -> tuple[list[int], list[int]]:
        """Bend the section to the cube's end and close it with the cap.

        Returns the spherical faces and the faces on the symmetry plane.
        """
        blocks, plan = self.blocks, self.plan
        centre = equator["axis"]
        x = -plan.shaft
        end = {
            name: blocks.point(*tip_point(name, x, plan.radius, plan.block_angle))
            for name in names(self.dim)
        }
        self.pole = blocks.point(x - plan.radius, 0.0)
        for name in names(self.dim):
            way = plan.meridian if name.endswith("-") else plan.meridian.evened
            if name.startswith("o"):
                blocks.curve(end[name], equator[name], way, centre)
            else:
                blocks.curve(end[name], equator[name], way.halfway)
        ease = _even if plan.lies else _graded
        blocks.curve(self.pole, end["axis"], ease(plan.inwards))
        self._divide(end, ease, ease, centre)
        sphere = self._lateral(equator, end, centre)
        symmetry = self._symmetry(equator, end)
        for half in "-+":
            if self.dim == 2:
                sphere.append(blocks.find_curve(self.pole, end["oy" + half]))
                blocks.face((end["axis"], end["cy" + half], end["oy" + half], self.pole))
                continue
            inner = _core(end, half)
            outer = (self.pole, end["oy" + half], end["oc" + half], end["oz"])
            sphere.append(blocks.face(outer, centre))
            symmetry.append(blocks.face((inner[0], inner[1], outer[1], outer[0])))
            blocks.hexahedron(inner, outer)
        self._fill(equator, end)
        return sphere, symmetry

    def _fill(self, start: Station, end: Station) -> None:
        """Blocks between two stations."""
        for corners in zip(_quads(start, self.dim), _quads(end, self.dim), strict=True):
            if self.dim == 3:
                self.blocks.hexahedron(*corners)
            else:
                (a, b), (c, d) = corners
                self.blocks.face((a, b, d, c))

    def _face(self, corners: tuple[int, ...]) -> int:
        if self.dim == 3:
            return self.blocks.face(corners)
        return self.blocks.find_curve(corners[0], corners[1])

    def _lateral(self, start: Station, end: Station, centre: int | None = None) -> list[int]:
        """Outer faces between two stations, on the sphere about `centre` if given."""
        if self.dim == 2:
            return [self.blocks.find_curve(start[oy], end[oy]) for oy in ("oy-", "oy+")]
        pairs = [
            pair for half in "-+" for pair in (("oy" + half, "oc" + half), ("oc" + half, "oz"))
        ]
        return [self.blocks.face((start[a], start[b], end[b], end[a]), centre) for a, b in pairs]

    def _symmetry(self, start: Station, end: Station) -> list[int]:
        if self.dim == 2:
            return []
        pairs = [
            pair for half in "-+" for pair in (("axis", "cy" + half), ("cy" + half, "oy" + half))
        ]
        return [self.blocks.face((start[a], start[b], end[b], end[a])) for a, b in pairs]


def _core(station: Station, half: str) -> tuple[int, ...]:
    """Corners of the core's quadrilateral in one half."""
    wanted = ("axis", "cy" + half, "cc" + half, "cz")
    return tuple(station[name] for name in wanted if name in station)


def _quads(station: Station, dim: int) -> list[tuple[int, ...]]:
    """Corners of the section's quadrilaterals (lines in 2D), core before ring."""
    quads: list[tuple[int, ...]] = []
    for half in "-+":
        cy, oy = station["cy" + half], station["oy" + half]
        if dim == 2:
            quads += [(station["axis"], cy), (cy, oy)]
            continue
        cc, oc = station["cc" + half], station["oc" + half]
        quads += [_core(station, half), (cy, oy, oc, cc), (cc, oc, station["oz"], station["cz"])]
    return quads
