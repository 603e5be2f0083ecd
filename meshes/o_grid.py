r"""The O-grid: corner points of the blocks on the shaft's section and on the tip.

Seen along the axis, the half section Z >= 0 has six blocks in two mirrored halves (lower,
Y <= 0, and upper); one half::

      z
      |  oz --.
      |  |  ring  `oc          core: axis, cy, cc, cz       (an eighth-turn square, bulged)
      |  cz --- cc  \          ring: cy-oy-oc-cc and cc-oc-oz-cz
      |  | core | ring |
      | axis -- cy -- oy -> -y (lower) or +y (upper)

The tip repeats the same points, bent to the inner cube's end (core) and to the sphere (ring);
the cap closes it between the core's end and the sphere around the pole. In 2D the section is its
trace on Z = 0: the points axis, cy and oy.

The fractions of the radius below are a compromise that keeps the smallest characteristic length
(volume over largest face) within some 5 % of the best that was found for the `ls-dyna-like`
preset, at a smallest scaled Jacobian of 0.66 and an aspect ratio below 2.5. A few sweeps of
Laplacian smoothing afterwards made that length smaller, not larger.
"""

import math

CORE_SIDE = 0.70
"""Distance of the core's mid-sides (cy, cz) from the axis, over the radius."""
CORE_CORNER = 0.82
"""Distance of the core's corners (cc) from the axis, over the radius."""
TIP_AXIS = 0.70
"""Depth of the inner cube's end on the axis, measured from the equator, over the radius."""
TIP_SIDE = 0.80
"""Distance of the inner cube's mid-edges from the sphere's centre, over the radius."""
TIP_CORNER = 0.84
"""Distance of the inner cube's corners from the sphere's centre, over the radius."""
RING_WIDTH = 1.0 - 0.25 * (CORE_SIDE + CORE_CORNER + TIP_SIDE + TIP_CORNER)
"""Mean width of the ring over the radius."""
CONTACT_DEPTH = 1.0 - TIP_SIDE
"""Width of the ring under the contact point over the radius."""
HINGE_DEPTH = CORE_SIDE
"""Length of the blocks around a shaft's hole, from the end face along the axis, over the radius."""

Point = tuple[float, float, float]
Station = dict[str, int]
"""Tags of a station's points by their names."""


def names(dim: int) -> tuple[str, ...]:
    """Names of the points of one station (a section, or the tip's inner end)."""
    if dim == 2:
        return ("axis", "cy-", "oy-", "cy+", "oy+")
    return ("axis", "cz", "oz", "cy-", "cc-", "oy-", "oc-", "cy+", "cc+", "oy+", "oc+")


def section_point(name: str, x: float, radius: float) -> Point:
    """Point of the shaft's section at `x` (mm)."""
    side = -1.0 if name.endswith("-") else 1.0
    diagonal = math.sqrt(0.5)
    y, z = {
        "axis": (0.0, 0.0),
        "cy": (CORE_SIDE * side, 0.0),
        "cz": (0.0, CORE_SIDE),
        "cc": (CORE_CORNER * diagonal * side, CORE_CORNER * diagonal),
        "oy": (side, 0.0),
        "oz": (0.0, 1.0),
        "oc": (diagonal * side, diagonal),
    }[name.rstrip("+-")]
    return (x, radius * y, radius * z)


def tip_point(name: str, x: float, radius: float, angle: float) -> Point:
    """Point of the tip's station; the sphere's centre lies at `x` on the axis (mm).

    The cube's mid-edges lie `angle` (rad) off the axis; its corners where the two great circles
    through neighbouring mid-edges meet, direction ``(-1, -+tan, tan)``.
    """
    side = -1.0 if name.endswith("-") else 1.0
    slope = math.tan(angle)
    kind = name.rstrip("+-")
    direction = {
        "axis": (-1.0, 0.0, 0.0),
        "y": (-1.0, slope * side, 0.0),
        "z": (-1.0, 0.0, slope),
        "c": (-1.0, slope * side, slope),
    }["axis" if kind == "axis" else kind[1]]
    if kind == "axis":
        distance = TIP_AXIS
    elif kind.startswith("o"):
        distance = 1.0
    else:
        distance = TIP_CORNER if kind == "cc" else TIP_SIDE
    scale = radius * distance / math.hypot(*direction)
    return (x + scale * direction[0], scale * direction[1], scale * direction[2])


def contact_arc(angle: float) -> float:
    """Angle (rad) of the arc from the contact point to the cube's corner, seen from the centre.

    Between the directions ``(-1, -tan, 0)`` and ``(-1, -tan, tan)``.
    """
    return math.atan(math.sin(angle))


def bulge_centre(name: str, x: float, radius: float) -> Point:
    """Centre of the arc that bounds the core through the mid-side `name` (cy-, cy+ or cz).

    The arc passes through the mid-side at distance b and the two corners at (a, +-a); its radius
    is ``((b - a)^2 + a^2) / (2 (b - a))``.
    """
    a, b = CORE_CORNER * math.sqrt(0.5), CORE_SIDE
    arc = ((b - a) ** 2 + a**2) / (2.0 * (b - a))
    offset = radius * (b - arc)
    if name == "cz":
        return (x, 0.0, offset)
    return (x, -offset if name.endswith("-") else offset, 0.0)
