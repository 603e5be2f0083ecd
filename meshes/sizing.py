"""Element sizes of the finger, their presets, and what a mesh of such sizes will cost."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Annotated, Self

from meshes.bounds import Bound, check_fields
from meshes.errors import MeshError
from meshes.geometry import FingerGeometry

# Memory that mesh, model and a run's fields of 83,000 hexahedra took beyond those of 3,700; element
# updates of one thread; ten transits of a wave over the longest phalanx, in steps of half an
# element's transit.
BYTES_PER_ELEMENT, UPDATES_PER_S, STEPS_A_TAP = 4000.0, 1e7, 20.0


LYING = math.radians(2.0)
"""Tilt of a shaft, its round end lower, below which a tap rocks to its other end. If the rim at the
hinge touches, the round end often comes down in the same tap, whatever the tilt."""
LARGEST_GROWTH = 2.0
EDGE = Bound("m", at_least=1e-9, at_most=100, advice="give a positive length in metres")


@dataclass(frozen=True)
class Sizing:
    """Target edge lengths; the block structure rounds them to whole numbers of elements.

    Raises
    ------
    MeshError
        If a size, the angle, growth or a limit is out of its bounds.
    """

    section_size: Annotated[float, EDGE]
    """Edge length on the round section (circumference and radius)."""
    axial_size: Annotated[float, EDGE]
    """Edge length along the axis."""
    tip_size: Annotated[float, EDGE]
    """Edge length on the tip's surface where it touches. Equal to or above `section_size`: the tip
    is meshed evenly. Below: edges are `tip_size` within `patch_size` of the contact point and grow
    beyond, in all three directions, by the factor `growth` from one to the next. The element count
    grows only with ``log(1/tip_size)`` per direction, so 1e-4 is possible."""
    contact_angle: Annotated[float, Bound("rad", at_least=-math.pi, at_most=math.pi)] = (
        math.radians(52.0)
    )
    """Angle between the axis (towards the tip) and the contact direction, positive towards the
    lower side; a finger that swung over touches with its upper one. At impact the last phalanx of
    the paper's finger points 38 degrees below the horizontal, so its lowest point is 52 degrees off
    the axis. The refinement follows it from the pole to the shaft (see `block_angle`); beyond a
    right angle the rim at the hinge touches, and both ends of the shaft are fine."""
    growth: Annotated[float, Bound(above=1, at_most=LARGEST_GROWTH)] = 1.25
    """Largest ratio of neighbouring edges in the refinement."""
    patch_size: Annotated[float, Bound("m", at_least=0, at_most=100)] = 0.0
    """Radius around the contact point in which edges on the surface do not grow: a patch of contact
    whose rim crosses edges of several lengths makes the peak force noisy. 1.3 of Hertz's radius is
    enough."""
    halvings: Annotated[int, Bound(integer=True, at_least=0, at_most=10)] = 0
    """How often cells are halved in place on the way to `tip_size`; see `halving`. Blocks then have
    edges of `tip_size` times 2^halvings where it touches, so that the fine ones end near there.
    Without effect on a shaft that lies on the surface or points up."""
    full_volume: bool = False
    """Whether outer nodes, except where it touches, are moved outwards until the facets between
    them hold the body's whole volume; see `full_volume`."""
    max_elements: Annotated[int, Bound(integer=True, at_least=1)] = 2_000_000
    """Meshes with more elements (as built, that is in the half model) are refused: before anything
    is allocated, or by the halving that makes them so many."""
    max_updates: Annotated[float, Bound(above=0)] = 1e11
    """Elements times time steps of a tap, by the estimate of `require_bearable`; more are refused
    too. The default, three hours of one thread, is some ten times what `max_elements` even ones
    take in the paper's finger."""

    def __post_init__(self) -> None:
        check_fields(self, MeshError)

    @property
    def lies(self) -> bool:
        """Whether the shaft lies on the surface or points up, where it touches."""
        return abs(self.contact_angle) > 0.5 * math.pi - LYING

    @property
    def block_angle(self) -> float:
        """Angle off the axis at which the cube's edge meets the sphere, rad.

        The contact's angle if between 40 and 54 degrees, on either side. Beyond, blocks would be
        too flat: the edge stays, and the contact lies in the cap or between edge and equator.
        """
        return min(max(abs(self.contact_angle), math.radians(40.0)), math.radians(54.0))

    def coarser(self, factor: float) -> Self:
        """The same mesh with every edge `factor` times as long.

        If edges are joined in threes, say, they grow by growth³ from one to the next.
        """
        return replace(
            self,
            section_size=factor * self.section_size,
            axial_size=factor * self.axial_size,
            tip_size=factor * self.tip_size,
            growth=min(self.growth**factor, LARGEST_GROWTH),
        )


SIZINGS: Mapping[str, Sizing] = MappingProxyType(
    {
        "contact": Sizing(section_size=2e-3, axial_size=3e-3, tip_size=2.5e-4, growth=1.4),
        "fast": Sizing(section_size=1.5e-3, axial_size=2.5e-3, tip_size=1.5e-3),
        "ls-dyna-like": Sizing(section_size=0.736e-3, axial_size=0.76e-3, tip_size=0.736e-3),
        "converged": Sizing(
            section_size=1.472e-3,
            axial_size=1.52e-3,
            tip_size=1.2e-4,
            growth=1.25,
            halvings=2,
            full_volume=True,
        ),
    }
)
"""`fast`: 2,000-5,000 elements counted for the full body; `ls-dyna-like`: about 60,000 (30,000 in
the half model); `contact` and `converged`: fine tips, whose sizes should follow from the patch of
contact, on shafts as coarse as those of `fast`, which are fine enough: halving them changes the
contact by 0.2 %. `converged` halves cells: blocks as fine throughout have five times as many, for
peaks and impulses within 0.2 %. All for the paper's finger of three 40 mm x 15 mm phalanges."""


def require_bearable(geometry: FingerGeometry, sizing: Sizing, elements: int) -> None:
    """Refuse a mesh that would take too much memory or time.

    A refined tip adds few elements, however fine it is, but its edges set the time step of all
    elements: the number of steps counts as well.

    Raises MeshError: with memory and time, if there are more than ``sizing.max_elements``, or their
        updates in a tap are more than ``sizing.max_updates``.
    """
    smallest = min(sizing.section_size, sizing.axial_size, sizing.tip_size)
    steps = STEPS_A_TAP * max(geometry.lengths) / smallest
    if elements > sizing.max_elements:
        limit = f"max_elements = {sizing.max_elements:g}"
    elif elements * steps > sizing.max_updates:
        limit = f"max_updates = {sizing.max_updates:g} (elements times steps)"
    else:
        return
    raise MeshError(
        f"these sizes give {elements:.3g} elements and about {steps:.2g} steps a tap, above "
        f"{limit}: about {1e-9 * BYTES_PER_ELEMENT * elements:.3g} GB, and "
        f"{elements * steps / UPDATES_PER_S / 3600.0:.3g} hours for a tap; enlarge section_size, "
        "axial_size or tip_size"
    )
