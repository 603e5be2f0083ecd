"""How many edges each block of one phalanx gets, and how they are graded.

Everything is known before gmsh starts, so that absurd requests cost nothing.
"""

import math
from dataclasses import dataclass, replace

from meshes.bounds import check_dim, check_kind
from meshes.errors import MeshError
from meshes.geometry import FingerGeometry
from meshes.grading import Division, Grading, count_even
from meshes.o_grid import CONTACT_DEPTH, CORE_SIDE, HINGE_DEPTH, RING_WIDTH, contact_arc
from meshes.sizing import LYING, Sizing, require_bearable

_MM = 1e3


@dataclass(frozen=True)
class PhalanxPlan:
    """Edges of the blocks of one phalanx; lengths in mm.

    ``across`` spans an eighth of the circumference, from the plane of motion; ``lower`` and
    ``upper``, equal in count, go on from there to the axis' side, on the tip to its pole;
    ``inwards`` spans the O-grid's ring, ``meridian`` the sphere from the cube's edge to its
    equator, ``axial`` the shaft from there to the hinge.

    ``beside`` says that the contact lies between cube and equator, which then is as fine across as
    the cube's edge; ``lies`` that the shaft lies on the surface or points up, and is fine at both
    ends; ``at_hinge`` that the rim at the hinge touches first.

    ``hole`` is the radius of the shaft's hole in the first (``holes`` 1) or in both ends (2; 0:
    plane ends). Then ``axial`` spans the shaft without those ends, ``n_hole`` the way from the hole
    outwards and ``n_end`` that from the end face inwards.

    Cells longer than ``fine`` asks for about the contact are halved, ``halvings`` times at most.
    """

    radius: float
    shaft: float
    rounded: bool
    block_angle: float
    across: Division
    lower: Division
    upper: Division
    inwards: Division
    meridian: Division
    axial: Division
    beside: bool = False
    lies: bool = False
    at_hinge: bool = False
    hole: float = 0.0
    holes: int = 0
    n_hole: int = 0
    n_end: int = 0
    halvings: int = 0
    contact_angle: float = 0.0
    fine: Grading | None = None
    full_volume: bool = False

    def elements(self, dim: int) -> int:
        """Exact number of elements of this phalanx in the (half) model, before any is cut."""
        across, halves = self.across.count, self.lower.count + self.upper.count
        ring = self.inwards.count
        section, cap, layers = halves + 2 * ring, halves * ring, 1
        if dim == 3:
            section = across * halves + ring * (2 * across + halves)
            cap *= across
            layers = across + ring
        end = self.n_hole * (2 * self.n_end + halves) * layers
        end += 2 * ring * self.n_end * (across if dim == 3 else 1)
        total = section * self.axial.count + self.holes * end
        return total + section * self.meridian.count + cap if self.rounded else total


def plan_phalanx(geometry: FingerGeometry, w: int, sizing: Sizing) -> PhalanxPlan:
    """Edges for phalanx `w`, from 0; its ends with a shaft's hole are not refined."""
    radius, length = _MM * geometry.radii[w], _MM * geometry.lengths[w]
    rounded, holes = geometry.rounded(w), geometry.shaft_holes(w)
    if geometry.shaft_radius is None:
        return _plan_plain(radius, length, rounded, sizing)
    least = min(abs(sizing.contact_angle), 0.5 * math.pi - LYING)
    sizing = replace(sizing, contact_angle=math.copysign(least, sizing.contact_angle))
    hole, size = _MM * geometry.shaft_radius, _MM * sizing.section_size
    ends = holes * HINGE_DEPTH * radius
    plan = _plan_plain(radius, length - ends, rounded, sizing)
    return replace(
        plan,
        shaft=plan.shaft + ends,
        hole=hole,
        holes=holes,
        n_hole=count_even(CORE_SIDE * radius - hole, size, least=2),
        n_end=count_even(HINGE_DEPTH * radius, size, least=2),
    )


def _plan_plain(radius: float, length: float, rounded: bool, sizing: Sizing) -> PhalanxPlan:
    """Edges of a phalanx of `radius` and `length` (mm), without the ends that have holes."""
    size, axial_size, tip_size = (
        _MM * s for s in (sizing.section_size, sizing.axial_size, sizing.tip_size)
    )
    n = count_even(0.25 * math.pi * radius, size, least=2)
    shaft = length - radius if rounded else length
    angle, contact = sizing.block_angle, abs(sizing.contact_angle)
    quarter = 0.5 * math.pi
    along_size = min(axial_size, size)
    even = PhalanxPlan(
        radius,
        shaft,
        rounded,
        angle,
        across=Division(n),
        lower=Division(n),
        upper=Division(n),
        inwards=Division(count_even(RING_WIDTH * radius, size)),
        meridian=Division(count_even(radius * (quarter - angle), along_size, least=2)),
        axial=Division(count_even(shaft, axial_size)),
        full_volume=sizing.full_volume,
    )
    if not rounded or tip_size >= size:
        return even
    asked = Grading(tip_size, sizing.growth, _MM * sizing.patch_size, size)
    if sizing.lies:
        graded = _graded_along(even, asked, along_size, axial_size)
        return replace(graded, contact_angle=contact, at_hinge=contact > quarter)
    fine = replace(asked, fine=min(tip_size * 2.0**sizing.halvings, size))
    # Positions along the lower outline, the contact at 0: pole, cube's edge, equator, hinge; the
    # upper outline goes on beyond the pole.
    pole, edge, equator = (radius * (a - contact) for a in (0.0, angle, quarter))
    upper = pole - radius * angle
    n_along = max(n, fine.count(edge, pole), fine.count(upper, pole))
    arc = radius * contact_arc(angle)
    # The ring is as thick at the contact as between the cube's edge and the equator.
    share = max(0.0, contact - angle) / (quarter - angle)
    depth = radius * (CONTACT_DEPTH + share * (1.0 - CORE_SIDE - CONTACT_DEPTH))
    down = replace(fine, even=0.0)
    meridian = replace(fine, coarse=along_size)
    shank = replace(fine, coarse=axial_size)
    return replace(
        even,
        across=fine.divide(0.0, arc, n),
        lower=fine.divide(edge, pole, n_along),
        upper=fine.divide(upper, pole, n_along),
        inwards=down.divide(0.0, depth, even.inwards.count),
        meridian=meridian.divide(edge, equator, even.meridian.count),
        axial=shank.divide(equator, equator + shaft, even.axial.count),
        beside=contact > angle,
        halvings=sizing.halvings,
        contact_angle=contact,
        fine=asked,
    )


def _graded_along(
    even: PhalanxPlan, fine: Grading, along_size: float, axial_size: float
) -> PhalanxPlan:
    """Edges of a shaft that `lies`, symmetric about its middle.

    Cells are not halved, and the upper half of the hinge's section is as fine as the lower one, so
    that its mean stays on the axis.
    """
    arc, depth = 0.25 * math.pi * even.radius, (1.0 - CORE_SIDE) * even.radius
    middle, end = 0.5 * even.shaft, even.radius * (0.5 * math.pi - even.block_angle)
    down, shank = replace(fine, even=0.0), replace(fine, coarse=axial_size)
    meridian = replace(fine, coarse=along_size)
    along = fine.divide(arc, 2.0 * arc, even.lower.count)
    half = shank.divide(0.0, middle, math.ceil(0.5 * even.axial.count))
    near = [0.5 * share for share in half.nodes]
    return replace(
        even,
        across=fine.divide(0.0, arc, even.across.count),
        lower=along,
        upper=along,
        inwards=down.divide(0.0, depth, even.inwards.count),
        meridian=meridian.divide(-end, 0.0, even.meridian.count),
        axial=Division(2 * half.count, (*near, 0.5, *(1.0 - share for share in near[::-1]))),
        lies=True,
        fine=fine,
    )


def plan_finger(geometry: FingerGeometry, sizing: Sizing, dim: int) -> tuple[PhalanxPlan, ...]:
    """Plan every phalanx; the mesh is turned over later if the contact lies on the upper side.

    Raises MeshError: a size exceeds the body, or mesh or tap would be too large: see
        `require_bearable`.
    Raises ValueError: the finger or its sizes have the wrong type, or there is no such `dim`.
    """
    check_kind("geometry", geometry, FingerGeometry)
    check_kind("sizing", sizing, Sizing)
    check_dim(dim)
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
    if geometry.shaft_radius is not None:
        _require_room(geometry)
    plans = tuple(plan_phalanx(geometry, w, sizing) for w in range(geometry.phalanges))
    total = sum(plan.elements(dim) for plan in plans)
    require_bearable(geometry, sizing, total)
    return plans


def _require_room(geometry: FingerGeometry) -> None:
    for w, (length, radius) in enumerate(zip(geometry.lengths, geometry.radii, strict=True)):
        rounded = geometry.rounded(w)
        needed = (geometry.shaft_holes(w) * HINGE_DEPTH + rounded) * radius
        if length <= needed:
            raise MeshError(
                f"phalanx {w + 1} is {length:g} m long, but its ends with shaft holes"
                f"{' and its hemisphere' if rounded else ''} take {needed:g} m: lengthen it or "
                "leave shaft_radius out"
            )


def count_elements(geometry: FingerGeometry, sizing: Sizing, dim: int = 3) -> int:
    """Number of elements that the mesh will have (half model in 3D) before any is halved, without
    building it.

    Raises MeshError: as for building it.
    """
    return sum(plan.elements(dim) for plan in plan_finger(geometry, sizing, dim))
