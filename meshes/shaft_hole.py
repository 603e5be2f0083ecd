r"""The end of a phalanx at a hinge with a shaft: half of the shaft's hole in its end face.

Two neighbours meet in a plane through the hinge axis; the hole for the shaft, a cylinder about
that axis (along Z), lies half in the one and half in the other. Seen along the hinge axis the end
has, in its lower and its upper half (here the lower), two blocks around the hole and the ring::

      S.oy ---------- oy        x ->  the end face is the line oy - cy - h
       |     ring      |        S: the section where the O-grid of the shaft begins
      S.cy ---------- cy
       |  \     A      |
       | B   m .       |
       |      \   ` .  h
     S.axis -- d        `       h, m, d: on the hole, 0, 45 and 90 degrees from the end face

Across, the blocks A and B repeat in the section's two layers: core (below) and ring (above).
"""

import math

from meshes.blocks import Blocks
from meshes.grading import Division
from meshes.o_grid import CORE_SIDE, HINGE_DEPTH, Point, Station, bulge_centre, section_point
from meshes.plan import PhalanxPlan

SPLINE_POINTS = 7
"""Points inside a curve of the phalanx's surface that is neither a line nor a circle."""


class HoledEnd:
    """The blocks between an end face and the O-grid's first section, laid by the constructor.

    x : of the end face, mm. inwards : direction from it into the phalanx along X, 1 or -1.
    station : points of the section, at ``x + inwards * HINGE_DEPTH * radius``.

    face, hole, shaft, symmetry : tags of the end's faces (curves in 2D) by role.
    edges : curves (points in 2D) of the hole that lie in the end face; the mean of their nodes lies
        on the hinge axis.
    """

    def __init__(
        self,
        blocks: Blocks,
        plan: PhalanxPlan,
        dim: int,
        x: float,
        inwards: float,
        station: Station,
    ) -> None:
        self.blocks, self.plan, self.dim = blocks, plan, dim
        self.x, self.inwards, self.station = x, inwards, station
        self.layers = 3 if dim == 3 else 1
        self.face: list[int] = []
        self.hole: list[int] = []
        self.shaft: list[int] = []
        self.symmetry: list[int] = []
        self.edges: list[int] = []
        deep = self._column(90.0, 1.0)
        for layer, inner in enumerate(("axis", "cz", "oz")[: self.layers]):
            blocks.curve(deep[layer], station[inner], Division(plan.n_hole))
        self._rise(deep)
        for half in "-+":
            self._half(half, deep)

    def _half(self, half: str, deep: list[int]) -> None:
        """Points, curves and blocks of the lower or the upper half."""
        blocks, plan, dim, station = self.blocks, self.plan, self.dim, self.station
        side = -1.0 if half == "-" else 1.0
        mouth, middle = self._column(0.0, side), self._column(45.0, side)
        names = ("cy", "cc", "oc", "oy") if dim == 3 else ("cy", "oy")
        far = {name: station[name + half] for name in names}
        near = {
            name: blocks.point(*section_point(name + half, self.x, plan.radius)) for name in names
        }
        for name in names:
            blocks.curve(near[name], far[name], Division(plan.n_end))
        centre, outwards = blocks.point(self.x, 0.0), Division(plan.n_hole)
        blocks.curve(near["oy"], near["cy"], plan.inwards.evened)
        blocks.curve(mouth[0], near["cy"], outwards)
        blocks.curve(middle[0], far["cy"], outwards)
        self._around(mouth[0], middle[0], (0.0, 45.0), side, 0, plan.n_end)
        self._around(middle[0], deep[0], (45.0, 90.0), side, 0, plan.lower.count)
        if dim == 3:
            bulge = blocks.point(*bulge_centre("cy" + half, self.x, plan.radius))
            blocks.curve(near["cy"], near["cc"], plan.across.evened, bulge)
            blocks.curve(near["oc"], near["cc"], plan.inwards.evened)
            blocks.curve(near["oy"], near["oc"], plan.across.evened, centre)
            blocks.curve(mouth[1], near["cc"], outwards)
            blocks.curve(middle[1], far["cc"], outwards)
            blocks.curve(mouth[2], near["oc"], outwards, centre)
            start = self._on_hole(45.0, side, 2)
            stop = section_point("oc" + half, self.x + self._depth, plan.radius)
            blocks.spline(middle[2], far["oc"], plan.n_hole, self._on_surface(start, stop))
            for layer in (1, 2):
                self._around(mouth[layer], middle[layer], (0.0, 45.0), side, layer, plan.n_end)
                self._around(
                    middle[layer], deep[layer], (45.0, 90.0), side, layer, plan.lower.count
                )
            self._rise(mouth)
            self._rise(middle)
        self._fill(mouth, middle, deep, near, far)

    def _fill(
        self, mouth: list[int], middle: list[int], deep: list[int], near: Station, far: Station
    ) -> None:
        """The half's blocks, and the roles of their faces."""
        blocks, station = self.blocks, self.station
        if self.dim == 2:
            blocks.face((mouth[0], near["cy"], far["cy"], middle[0]))
            blocks.face((middle[0], far["cy"], station["axis"], deep[0]))
            blocks.face((near["cy"], near["oy"], far["oy"], far["cy"]))
            for pairs, role in (
                (((mouth[0], near["cy"]), (near["cy"], near["oy"])), self.face),
                (((mouth[0], middle[0]), (middle[0], deep[0])), self.hole),
                (((near["oy"], far["oy"]),), self.shaft),
            ):
                role += [blocks.find_curve(p, q) for p, q in pairs]
            self.edges.append(mouth[0])
            return
        inner = (station["axis"], station["cz"], station["oz"])
        outside, inside = (near["cy"], near["cc"], near["oc"]), (far["cy"], far["cc"], far["oc"])
        a = [(mouth[i], outside[i], inside[i], middle[i]) for i in range(3)]
        b = [(middle[i], inside[i], inner[i], deep[i]) for i in range(3)]
        for i in (0, 1):
            blocks.hexahedron(a[i], a[i + 1])
            blocks.hexahedron(b[i], b[i + 1])
            j = i + 1
            self.face.append(blocks.face((mouth[i], outside[i], outside[j], mouth[j])))
            self.hole.append(blocks.face((mouth[i], middle[i], middle[j], mouth[j])))
            self.hole.append(blocks.face((middle[i], deep[i], deep[j], middle[j])))
            self.edges.append(blocks.find_curve(mouth[i], mouth[j]))
        ring = [tuple(s[name] for name in ("cy", "oy", "oc", "cc")) for s in (near, far)]
        blocks.hexahedron(*ring)
        self.face.append(blocks.face(ring[0]))
        self.shaft += [
            blocks.face(a[2]),
            blocks.face(b[2]),
            blocks.face((near["oy"], near["oc"], far["oc"], far["oy"])),
        ]
        self.symmetry += [
            blocks.face(a[0]),
            blocks.face(b[0]),
            blocks.face((near["cy"], near["oy"], far["oy"], far["cy"])),
        ]

    @property
    def _depth(self) -> float:
        """From the end face to the section, along X, mm."""
        return self.inwards * HINGE_DEPTH * self.plan.radius

    def _on_hole(self, degrees: float, side: float, layer: int) -> Point:
        """Point of the hole: in the plane of motion, at the core's height, or on the surface."""
        angle, plan = math.radians(degrees), self.plan
        y = side * plan.hole * math.cos(angle)
        z = (0.0, CORE_SIDE * plan.radius, math.sqrt(plan.radius**2 - y**2))[layer]
        return (self.x + self.inwards * plan.hole * math.sin(angle), y, z)

    def _column(self, degrees: float, side: float) -> list[int]:
        """Points of the hole at one angle, in every layer."""
        return [
            self.blocks.point(*self._on_hole(degrees, side, layer)) for layer in range(self.layers)
        ]

    def _around(
        self, p: int, q: int, degrees: tuple[float, float], side: float, layer: int, count: int
    ) -> None:
        """Curve on the hole between two of its points: a circle, or the surface's edge."""
        if layer < 2:
            z = self._on_hole(0.0, side, layer)[2]
            self.blocks.curve(p, q, Division(count), self.blocks.point(self.x, 0.0, z))
            return
        first, last = degrees
        steps = [(k + 1) / (SPLINE_POINTS + 1) for k in range(SPLINE_POINTS)]
        angles = [first + (last - first) * step for step in steps]
        self.blocks.spline(p, q, count, [self._on_hole(angle, side, 2) for angle in angles])

    def _on_surface(self, start: Point, stop: Point) -> list[Point]:
        """Points of the phalanx's round surface between two of its points."""
        points = []
        for k in range(SPLINE_POINTS):
            share = (k + 1) / (SPLINE_POINTS + 1)
            x, y = (start[i] + share * (stop[i] - start[i]) for i in (0, 1))
            points.append((x, y, math.sqrt(self.plan.radius**2 - y**2)))
        return points

    def _rise(self, column: list[int]) -> None:
        """Lines from the plane of motion through the core and the ring."""
        ways = (self.plan.across.evened, self.plan.inwards.evened)
        for p, q, way in zip(column, column[1:], ways, strict=False):
            self.blocks.curve(p, q, way)
