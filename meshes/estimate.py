"""What a mesh will cost, said and judged from its sizes alone: nothing is allocated for it."""

from __future__ import annotations

from meshes.errors import MeshError
from meshes.geometry import FingerGeometry
from meshes.sizing import Sizing

# What mesh and model of 83,000 hexahedra took beyond one of 3,700, with the fields that a run
# keeps; the updates of one thread; and ten transits of a wave over the longest phalanx in steps of
# half an element's.
BYTES_PER_ELEMENT, UPDATES_PER_S, STEPS_A_TAP = 4000.0, 1e7, 20.0


def require_bearable(geometry: FingerGeometry, sizing: Sizing, elements: int) -> None:
    """Refuse a mesh of so many elements that nobody would wait for.

    A tip that is refined alone has few elements however fine it is, but its edge sets the time
    step of them all: steps count as elements do.

    Raises
    ------
    MeshError
        With memory and time, if there are more than ``sizing.max_elements``, or their updates in
        a tap are more than ``sizing.max_updates``.
    """
    smallest = min(sizing.section_size, sizing.axial_size, sizing.tip_size)
    steps = STEPS_A_TAP * max(geometry.lengths) / smallest
    if elements > sizing.max_elements:
        limit = f"max_elements = {sizing.max_elements:g}"
    elif elements * steps > sizing.max_updates:
        limit = f"max_updates = {sizing.max_updates:g} of one element by one step"
    else:
        return
    raise MeshError(
        f"these sizes give {elements:.3g} elements and some {steps:.2g} steps a tap, above {limit}:"
        f" some {1e-9 * BYTES_PER_ELEMENT * elements:.3g} GB, and "
        f"{elements * steps / UPDATES_PER_S / 3600.0:.3g} hours for a tap; enlarge section_size, "
        "axial_size or tip_size"
    )
