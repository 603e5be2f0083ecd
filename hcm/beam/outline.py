"""The parts of the finger that may not reach the surface Y = -H: all but the tip, which may touch.

A section of radius R at a point r of the centreline is perpendicular to r' and reaches down to

    y - R |r'_x|/|r'|.

The lumped contact acts where the centreline ends and has no radius (paper, section 2.2.2): a tip
that points phi below the horizontal touches while a round end would reach R (1 - sin phi) deeper.
The last phalanx is therefore measured by its centreline, which may be nowhere below both the
surface and its own tip (a straight one touches with another part if phi < 0), and by the section at
its hinge. On the other phalanges every section counts, and on the last one too if it ends in a
sphere, which must then be its lowest part.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hcm.arrays import Floats
from hcm.beam.chain import Chain
from hcm.beam.element import polynomials, shape_of
from hcm.compiled import ByKind, entry, kernel
from hcm.parameters import Finger

# Parts into which an element is divided if its bound is below the surface: a curvature of 10/m
# puts a point between two sections of a 4 mm element 0.3 um below both.
PARTS = 8
# Depth, over H, that may be mere round-off.
PASSED = 1e-9


class Outline(NamedTuple):
    """Radii of the finger, m.

    radius : (N,) by which each element is measured, 0 on a last phalanx without a sphere. root :
    the last phalanx's first element. root_radius : of the section at its hinge. tip_radius : of
    the sphere at its end. height : H.
    """

    radius: Floats
    root: int
    root_radius: float
    tip_radius: float
    height: float


def build_outline(finger: Finger, height: float, tip_radius: float = 0.0) -> Outline:
    """The radii by which the finger is measured above the surface Y = -height."""
    *inner, last = finger.phalanges
    radius = np.array(
        [r for p in inner for r in [p.diameter / 2] * p.elements] + [tip_radius] * last.elements
    )
    return Outline(radius, radius.size - last.elements, last.diameter / 2, tip_radius, height)


@kernel
def lowest_point(
    q: Floats, a: int, length: float, radius: float, parts: int
) -> tuple[float, float]:
    """Height of the lowest point of the element at place `a` and X of its section, m, looked for at
    the ends of its `parts`; at its first section alone if `parts` is 0.
    """
    ax, bx, dx, ay, by, dy = polynomials(shape_of(q[a : a + 8], length))
    lowest, place = math.inf, 0.0
    for i in range(parts + 1):
        t = 2.0 * i / max(parts, 1) - 1.0
        rx, ry = ax + t * (bx + t * dx), ay + t * (by + t * dy)
        one, two, three = t + 1.0, 0.5 * (t * t - 1.0), (t * t * t + 1.0) / 3.0
        y = q[a + 1] + 0.5 * length * (one * ay + two * by + three * dy)
        level = y - radius * abs(rx) / math.hypot(rx, ry)
        if level < lowest:
            lowest = level
            place = q[a] + 0.5 * length * (one * ax + two * bx + three * dx)
    return lowest, place


@entry
def depth(q: Floats, chain: Chain, outline: Outline) -> tuple[float, int, float]:
    """How far, m, the finger at q (n,) lies below the surface where it has no contact (0: nowhere),
    in which element (-1) and at which section's X, m.
    """
    height = outline.height
    deepest, element, place = PASSED * height, -1, 0.0
    for e in range(outline.radius.size):
        a, length, radius = chain.first[e], chain.length[e], outline.radius[e]
        if e == outline.root:
            level, x = lowest_point(q, a, length, outline.root_radius, 0)
            if -height - level > deepest:
                deepest, element, place = -height - level, e, x
        floor = -height if e < outline.root else min(-height, q[chain.tip + 1] - outline.tip_radius)
        # a cubic lies within its control polygon
        third = length / 3.0
        first, last = q[a + 1], q[a + 5]
        bound = min(min(first, first + third * q[a + 3]), min(last - third * q[a + 7], last))
        if bound - radius < floor - deepest:
            level, x = lowest_point(q, a, length, radius, PARTS)
            if floor - level > deepest:
                deepest, element, place = floor - level, e, x
    return deepest if element >= 0 else 0.0, element, place


depth_by_kind = ByKind(depth)
