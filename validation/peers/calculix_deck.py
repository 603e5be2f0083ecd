"""A block of the reference's maps as CalculiX' input: same mesh, law and contact, own steps.

CalculiX (GPL-2 or later) solves the same equations implicitly: St. Venant-Kirchhoff (``*ELASTIC``
with NLGEOM), C3D8 elements on our mesh, surface-to-surface contact with a linear pressure of the
same modulus on a fixed floor, ``*DYNAMIC`` with automatic increments. Its mass is consistent where
the reference's is lumped, and its contact has no dashpots.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from reference_fem.contact.surface import SurfaceContact
from reference_fem.model import Model
from validation.studies.stress.reference.bodies import SIDE
from validation.studies.stress.reference.scene import DENSITY, ReferenceScene

# Increments that its first step would make of the tap; it refines and coarsens from there.
INCREMENTS = 200
MOST_INCREMENTS = 20_000


def deck(
    scene: ReferenceScene, model: Model, displacement: NDArray[np.float64], end_s: float
) -> str:
    """Its input file: the block where it starts, a floor under it, `end_s` of motion.

    It prints the floor's force and the block's velocities after every increment.

    Raises
    ------
    ValueError
        The contact law is one that CalculiX has not.
    """
    if not isinstance(model.contact, SurfaceContact):
        raise ValueError(f"contact = {scene.contact!r}: only 'surface' is a law of CalculiX too")
    points = model.points + displacement
    n = len(points)
    lines = ["*NODE,NSET=BODY", *_nodes(points, 1)]
    floor = _floor(model.surface.height)
    lines += ["*NODE,NSET=FLOOR", *_nodes(floor, n + 1)]
    cells = (model.cells + 1).tolist()
    lines.append("*ELEMENT,TYPE=C3D8,ELSET=BLOCK")
    lines += [f"{e},{','.join(map(str, nodes))}" for e, nodes in enumerate(cells, 1)]
    plate = ",".join(str(n + i) for i in range(1, 9))
    lines += ["*ELEMENT,TYPE=C3D8,ELSET=PLATE", f"{len(cells) + 1},{plate}"]
    lines += ["*NSET,NSET=MIDDLE", *(f"{i + 1}," for i in model.symmetry)]
    lines += ["*SURFACE,NAME=OUTSIDE", *_faces(model)]
    lines += ["*SURFACE,NAME=TOP", f"{len(cells) + 1},S2"]
    lines += ["*MATERIAL,NAME=M", "*ELASTIC", f"{scene.modulus},{scene.poisson}", "*DENSITY",
              f"{DENSITY}", "*SOLID SECTION,ELSET=BLOCK,MATERIAL=M",
              "*SOLID SECTION,ELSET=PLATE,MATERIAL=M",
              "*SURFACE INTERACTION,NAME=I", "*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=LINEAR",
              f"{model.contact.modulus:.9g}"]  # fmt: skip
    if scene.friction:
        lines += ["*FRICTION", f"{scene.friction},{model.contact.modulus:.9g}"]
    lines += ["*CONTACT PAIR,INTERACTION=I,TYPE=SURFACE TO SURFACE", "OUTSIDE,TOP",
              "*BOUNDARY", "FLOOR,1,3", "MIDDLE,3,3",
              "*INITIAL CONDITIONS,TYPE=VELOCITY", f"BODY,1,{scene.slide * scene.speed:.9g}",
              f"BODY,2,{-scene.speed:.9g}",
              f"*STEP,NLGEOM,INC={MOST_INCREMENTS}", "*DYNAMIC",
              f"{end_s / INCREMENTS:.6g},{end_s:.6g}",
              "*DLOAD", f"BLOCK,GRAV,{model.gravity},0,-1,0",
              "*NODE PRINT,NSET=FLOOR,TOTALS=ONLY", "RF",
              "*NODE PRINT,NSET=BODY", "V", "*END STEP"]  # fmt: skip
    return "\n".join(lines) + "\n"


def _nodes(points: NDArray[np.float64], first: int) -> list[str]:
    return [f"{n},{x:.12g},{y:.12g},{z:.12g}" for n, (x, y, z) in enumerate(points.tolist(), first)]


# Corners of CalculiX' faces S1 to S6.
_FACES = ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))


def _faces(model: Model) -> list[str]:
    """The block's outside, face by face."""
    assert isinstance(model.contact, SurfaceContact)
    wanted = {frozenset(facet) for facet in model.contact.quadrature.facets.tolist()}
    return [
        f"{e},S{side}"
        for e, cell in enumerate(model.cells.tolist(), 1)
        for side, corners in enumerate(_FACES, 1)
        if frozenset(cell[c] for c in corners) in wanted
    ]


def _floor(height: float) -> NDArray[np.float64]:
    """Corners of a plate below the surface, wide enough for the block to slide on, in VTK order."""
    wide, low = 4.0 * SIDE, -height - 0.5 * SIDE
    square = [(-wide, -wide), (wide, -wide), (wide, wide), (-wide, wide)]
    # Local Z of the element is up: its second face, S2, is the top.
    return np.array([(x, y, -z) for y in (low, -height) for x, z in square])
