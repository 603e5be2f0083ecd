"""The finger's outer shape: a chain of round phalanges along -X, the first hinge at the origin."""

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from meshes.bounds import Bound, check_fields
from meshes.errors import MeshError

LARGEST_SHAFT = 0.45
"""Largest radius of a shaft over that of its phalanx: the hole stays inside the O-grid's core."""

METRES = Bound("m", above=0)


@dataclass(frozen=True)
class FingerGeometry:
    """Lengths and diameters of the phalanges, first (at the fixed hinge) to last.

    Parameters
    ----------
    lengths : length of each phalanx in m. The last one includes its hemispherical end.
    diameters : diameter of each phalanx in m
    tip : ``"hemisphere"``: the last phalanx ends in a half-sphere of radius d/2; ``"flat"``: it
        ends in a plane.
    shaft_radius : radius of the shafts at the hinges, m, each in a hole about the hinge axis that
        lies half in the one phalanx's end and half in its neighbour's; at most `LARGEST_SHAFT` of
        the smallest phalanx's radius. None: no holes, the ends are plane.

    Raises
    ------
    MeshError
        If a length or diameter is not a positive finite number, the tuples differ in
        length, or the last phalanx is too short to hold its hemisphere.
    """

    lengths: Annotated[tuple[float, ...], METRES]
    diameters: Annotated[tuple[float, ...], METRES]
    tip: Literal["hemisphere", "flat"] = "hemisphere"
    shaft_radius: Annotated[float | None, METRES] = None

    def __post_init__(self) -> None:
        check_fields(self, MeshError)
        if len(self.lengths) == 0:
            raise MeshError("lengths is empty: give at least one phalanx")
        if len(self.lengths) != len(self.diameters):
            raise MeshError(
                f"{len(self.lengths)} lengths but {len(self.diameters)} diameters: "
                "give one of each per phalanx"
            )
        if self.shaft_radius is not None and self.shaft_radius > LARGEST_SHAFT * min(self.radii):
            raise MeshError(
                f"shaft_radius = {self.shaft_radius:g} m: must be at most {LARGEST_SHAFT:g} of "
                f"the smallest phalanx's radius ({min(self.radii):g} m), or its end is only "
                "a thin wall"
            )
        if self.tip == "hemisphere" and self.lengths[-1] <= self.radii[-1]:
            raise MeshError(
                f"the last phalanx is {self.lengths[-1]:g} m long, but its hemispherical end "
                f"alone takes {self.radii[-1]:g} m (d/2): lengthen it or make it thinner"
            )

    @property
    def radii(self) -> tuple[float, ...]:
        """Half the diameters, m."""
        return tuple(0.5 * d for d in self.diameters)

    @property
    def phalanges(self) -> int:
        """Number of phalanges."""
        return len(self.lengths)

    def rounded(self, w: int) -> bool:
        """Whether phalanx `w`, from 0, ends in the hemisphere."""
        return self.tip == "hemisphere" and w == self.phalanges - 1

    def shaft_holes(self, w: int) -> int:
        """How many ends of phalanx `w` have a hole: those at a hinge, if there are shafts."""
        if self.shaft_radius is None:
            return 0
        return 1 if w == self.phalanges - 1 else 2

    @property
    def hinges(self) -> tuple[float, ...]:
        """X of each phalanx's proximal hinge axis, m: 0, -L1, -(L1 + L2), ..."""
        return tuple(-math.fsum(self.lengths[:w]) for w in range(self.phalanges))

    @property
    def end(self) -> float:
        """X of the finger's free end, m."""
        return -math.fsum(self.lengths)
