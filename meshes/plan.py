"""How many elements each block of one phalanx gets, and how they are graded.

Everything is known before gmsh starts, so that absurd requests cost nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from scipy.optimize import brentq

from meshes.geometry import FingerGeometry
from meshes.mesh import MeshError
from meshes.o_grid import CONTACT_DEPTH, CORE_SIDE, HINGE_DEPTH, RING_WIDTH, contact_arc
from meshes.sizing import Sizing, require_bearable

_MM = 1e3


@dataclass(frozen=True)
class PhalanxPlan:
    """Block counts and gradings of one phalanx; lengths in mm.

    ``n`` edges span an eighth of the circumference, ``n_radial`` the O-grid's ring, ``n_axial``
    the shaft and ``n_meridian`` the sphere from its equator to the cube's edge. Gradings are
    ratios of neighbouring edges (1: even) at the contact point, named after the direction in
    which they run away from it; ``axial`` runs from the equator to the hinge.

    ``hole`` is the radius of the shaft's hole in the first (``holes`` 1) or in both ends (2; 0:
    plane ends). Then ``n_axial`` spans the shaft without those ends, ``n_hole`` the way from the
    hole outwards and ``n_end`` that from the end face inwards.
    """

    radius: float
    shaft: float
    rounded: bool
    block_angle: float
    n: int
    n_radial: int
    n_axial: int
    n_meridian: int
    across: float = 1.0
    to_pole: float = 1.0
    to_equator: float = 1.0
    inwards: float = 1.0
    axial: float = 1.0
    hole: float = 0.0
    holes: int = 0
    n_hole: int = 0
    n_end: int = 0

    def elements(self, dim: int) -> int:
        """Exact number of elements of this phalanx in the (half) model."""
        if dim == 3:
            section = 2 * self.n**2 + 4 * self.n * self.n_radial
            cap = 2 * self.n**2 * self.n_radial
        else:
            section = 2 * self.n + 2 * self.n_radial
            cap = 2 * self.n * self.n_radial
        across = self.n + self.n_radial if dim == 3 else 1
        end = 2 * self.n_hole * (self.n_end + self.n) * across
        end += 2 * self.n_radial * self.n_end * (self.n if dim == 3 else 1)
        total = section * self.n_axial + self.holes * end
        if not self.rounded:
            return total
        return total + section * self.n_meridian + cap


def plan_phalanx(
    radius: float,
    length: float,
    rounded: bool,
    sizing: Sizing,
    hole: float = 0.0,
    holes: int = 0,
) -> PhalanxPlan:
    """Counts and gradings for one phalanx of `radius` and `length` (mm).

    `hole` is the radius of the shaft's hole (mm) in `holes` of its ends.
    """
    ends = holes * HINGE_DEPTH * radius
    plan = _plan_plain(radius, length - ends, rounded, sizing)
    if not holes:
        return plan
    size = _MM * sizing.section_size
    return replace(
        plan,
        shaft=plan.shaft + ends,
        hole=hole,
        holes=holes,
        n_hole=count_even(CORE_SIDE * radius - hole, size, least=2),
        n_end=count_even(HINGE_DEPTH * radius, size, least=2),
    )


def _plan_plain(radius: float, length: float, rounded: bool, sizing: Sizing) -> PhalanxPlan:
    """Counts and gradings without the ends that have holes."""
    size, axial_size, tip_size = (
        _MM * s for s in (sizing.section_size, sizing.axial_size, sizing.tip_size)
    )
    n = count_even(0.25 * math.pi * radius, size, least=2)
    n_radial = count_even(RING_WIDTH * radius, size)
    shaft = length - radius if rounded else length
    n_axial = count_even(shaft, axial_size)
    angle = sizing.block_angle
    meridian = radius * (0.5 * math.pi - angle)
    n_meridian = count_even(meridian, min(axial_size, size), least=2) if rounded else 0
    even = PhalanxPlan(radius, shaft, rounded, angle, n, n_radial, n_axial, n_meridian)
    if not rounded or tip_size >= size:
        return even
    growth = sizing.growth
    to_pole = radius * angle
    across = radius * contact_arc(angle)
    depth = radius * CONTACT_DEPTH
    n = max(n, *(count_graded(side, tip_size, growth) for side in (across, to_pole)))
    n_radial = max(n_radial, count_graded(depth, tip_size, growth))
    n_meridian = max(n_meridian, count_graded(meridian, tip_size, growth))
    to_equator = progression(meridian, tip_size, n_meridian)
    # The shaft goes on with the edge that the sphere ends with at its equator.
    last = min(tip_size * to_equator ** (n_meridian - 1), axial_size)
    n_axial = max(n_axial, _count_up_to(shaft, last, axial_size, growth))
    return replace(
        even,
        n=n,
        n_radial=n_radial,
        n_axial=n_axial,
        n_meridian=n_meridian,
        across=progression(across, tip_size, n),
        to_pole=progression(to_pole, tip_size, n),
        to_equator=to_equator,
        inwards=progression(depth, tip_size, n_radial),
        axial=progression(shaft, last, n_axial),
    )


def plan_finger(geometry: FingerGeometry, sizing: Sizing, dim: int) -> tuple[PhalanxPlan, ...]:
    """Plan every phalanx.

    Raises
    ------
    MeshError
        If a size exceeds the body, or mesh or tap would be too large: see `require_bearable`.
    """
    for w, (length, diameter) in enumerate(
        zip(geometry.lengths, geometry.diameters, strict=True), start=1
    ):
        for key, limit, what in (
            ("section_size", diameter, "diameter"),
            ("tip_size", diameter, "diameter"),
            ("axial_size", length, "length"),
        ):
            if getattr(sizing, key) > limit:
                raise MeshError(
                    f"{key} = {getattr(sizing, key):g} m is larger than the {what} of phalanx "
                    f"{w} ({limit:g} m): give a smaller size"
                )
    last = geometry.phalanges - 1
    hole = _MM * (geometry.shaft_radius or 0.0)
    if hole:
        _require_room(geometry)
    plans = tuple(
        plan_phalanx(
            _MM * geometry.radii[w],
            _MM * geometry.lengths[w],
            w == last and geometry.tip == "hemisphere",
            sizing,
            hole,
            _holed_ends(geometry, w) if hole else 0,
        )
        for w in range(geometry.phalanges)
    )
    total = sum(plan.elements(dim) for plan in plans)
    require_bearable(geometry, sizing, total)
    return plans


def _holed_ends(geometry: FingerGeometry, w: int) -> int:
    """How many ends of phalanx w (from 0) are at a hinge: the last one's far end is free."""
    return 1 if w == geometry.phalanges - 1 else 2


def _require_room(geometry: FingerGeometry) -> None:
    for w, (length, radius) in enumerate(zip(geometry.lengths, geometry.radii, strict=True)):
        rounded = w == geometry.phalanges - 1 and geometry.tip == "hemisphere"
        needed = (_holed_ends(geometry, w) * HINGE_DEPTH + rounded) * radius
        if length <= needed:
            raise MeshError(
                f"phalanx {w + 1} is {length:g} m long, but its ends with holes for shafts"
                f"{' and its hemisphere' if rounded else ''} take {needed:g} m: lengthen it or "
                "leave shaft_radius out"
            )


def count_elements(geometry: FingerGeometry, sizing: Sizing, dim: int = 3) -> int:
    """Number of elements that the mesh will have (half model in 3D), without building it.

    Raises
    ------
    MeshError
        As for building it.
    """
    return sum(plan.elements(dim) for plan in plan_finger(geometry, sizing, dim))


def count_even(length: float, size: float, least: int = 1) -> int:
    """Number of even edges of about `size` on a curve of `length`, at least `least`."""
    return max(least, round(length / size))


def count_graded(length: float, size: float, growth: float) -> int:
    """Fewest edges h, hg, hg^2, ... with h <= `size` and g = `growth` that fill `length`.

    The sum of n edges is ``h (g^n - 1)/(g - 1)``.
    """
    return math.ceil(math.log1p(length * (growth - 1.0) / size) / math.log(growth) - 1e-9)


def progression(length: float, size: float, count: int) -> float:
    """Ratio q >= 1 of neighbouring edges so that `count` edges starting at `size` fill `length`.

    Solves ``size (q^n - 1)/(q - 1) = length``; 1 if even edges are already as short as `size`.
    """
    if count < 2 or length / count <= size:
        return 1.0

    def excess(q: float) -> float:
        return size * math.fsum(q**k for k in range(count)) - length

    # The last edge alone is shorter than the curve, which bounds q.
    largest = (length / size) ** (1.0 / (count - 1))
    return float(brentq(excess, 1.0, largest, xtol=1e-14, rtol=1e-14))


def _count_up_to(length: float, first: float, largest: float, growth: float) -> int:
    """Edges that grow from `first` to `largest` by at most `growth`, then stay, to fill `length`.

    gmsh's progression has no plateau; the same number of edges with a gentler growth ends
    slightly above `largest`.
    """
    rising = math.log(largest / first) / math.log(growth) if largest > first else 0.0
    ramp = (largest - first) / math.log(growth)
    if ramp >= length:
        return count_graded(length, first, growth)
    return math.ceil(rising + (length - ramp) / largest - 1e-9)
