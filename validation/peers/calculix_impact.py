"""A body that hits the ground, in CalculiX: the reference's mesh, law and contact, its own steps.

CalculiX solves the same equations implicitly: St. Venant-Kirchhoff (``*ELASTIC`` with NLGEOM),
its own hexahedra on our mesh, hinges as ``*EQUATION`` with the reference's mean weights,
surface-to-surface contact with a linear pressure of the same modulus on a fixed floor.
Its mass is consistent where the reference's is lumped, its contact has no dashpots and acts on the
facets, not on the round surface that they approximate.
"""

import re
from itertools import pairwise

import numpy as np

from reference_fem import Material
from reference_fem.arrays import Array, Index
from reference_fem.contact.springs import SpringContact, Springs
from reference_fem.elements.geometry import by_element, geometries
from reference_fem.joints.hinges import Hinges
from reference_fem.model import Model
from reference_fem.rigid.true_body import mass_factors
from validation.peers import calculix

# The motion's duration over CalculiX's first increment; it adapts the others itself.
INCREMENTS = 200
MOST_INCREMENTS = 20_000
ALPHA = -0.05  # of the Hilber-Hughes-Taylor method, where increments are prescribed
TERMS_A_LINE = 4  # terms of an equation; CalculiX does not read more
_FORCE = re.compile(
    r"total force \(fx,fy,fz\) for set FLOOR and time\s+(\S+)\s+(\S+)\s+(\S+)\s+(\S+)"
)
_STRESS = re.compile(r"stresses \(elem.*and time\s+(\S+)\n\n((?:.*\S.*\n)+)")
# Corners of CalculiX' faces S1 to S6.
_FACES = ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))


def deck(
    model: Model,
    material: Material,
    displacement: Array,
    velocity: Array,
    end_s: float,
    element: str = "C3D8",
    step_s: float | None = None,
    stresses: bool = False,
) -> str:
    """The input file: the unstrained body at its start, a floor under it, and `end_s` of motion.

    The floor's force and a field are printed after every increment: there is only one frequency.

    displacement, velocity : (n_points, 3), m and m/s, at the start.
    step_s : length of every increment; None: automatic.
    stresses : whether to print stresses instead of velocities.

    Raises ValueError: CalculiX does not have the contact law.
    """
    contact = model.contact
    # springs at single nodes are those of 'penalty'
    if not isinstance(contact, SpringContact) or contact.parts.facets.shape[1] == 1:
        raise ValueError(f"{type(contact).__name__}: only 'surface' is a law of CalculiX too")
    points, cells, friction = model.points + displacement, model.cells, model.surface.friction
    outside = points[contact.nodes, 0]
    floor = _floor(model.surface.height, float(outside.mean()), float(np.ptp(outside)))
    plate = len(points) + np.arange(1, 9)[None, :]
    springs, last = contact.parts, len(cells) + 1
    modulus = f"{springs.stiffness[0, 0] / springs.area[0, 0]:.9g}"
    lines = [*calculix.nodes("BODY", points), *calculix.nodes("FLOOR", floor, len(points) + 1)]
    lines += calculix.elements(element, "BLOCK", cells + 1)
    lines += calculix.elements("C3D8", "PLATE", plate, last)
    lines += ["*NSET,NSET=MIDDLE", *(f"{i + 1}," for i in model.symmetry)]
    lines += ["*SURFACE,NAME=OUTSIDE", *_outside(springs, model.cells)]
    lines += ["*SURFACE,NAME=TOP", f"{last},S2"]
    elastic, heavier = (material.youngs_modulus, material.poisson_ratio), densities(model, material)
    lines += calculix.material("M", *elastic, material.density, "PLATE")
    for number, density in enumerate(np.unique(heavier)):
        name = f"M{number}"
        lines += [
            f"*ELSET,ELSET={name}",
            *(f"{e + 1}," for e in np.flatnonzero(heavier == density)),
        ]
        lines += calculix.material(name, *elastic, density, name)
    lines += ["*SURFACE INTERACTION,NAME=I", "*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=LINEAR",
              modulus]  # fmt: skip
    if friction:
        lines += ["*FRICTION", f"{friction},{modulus}"]
    scheme = "*DYNAMIC" if step_s is None else f"*DYNAMIC,DIRECT,ALPHA={ALPHA}"
    lines += ["*CONTACT PAIR,INTERACTION=I,TYPE=SURFACE TO SURFACE", "OUTSIDE,TOP",
              *_equations(model.hinges),
              "*BOUNDARY", "FLOOR,1,3", "MIDDLE,3,3",
              "*INITIAL CONDITIONS,TYPE=VELOCITY",
              *(f"{n},{axis},{speed:.9g}" for n, row in enumerate(velocity[:, :2].tolist(), 1)
                for axis, speed in enumerate(row, 1)),
              f"*STEP,NLGEOM,INC={MOST_INCREMENTS}", scheme,
              f"{step_s or end_s / INCREMENTS:.6g},{end_s:.6g}",
              "*DLOAD", f"BLOCK,GRAV,{-model.gravity_vector[1]},0,-1,0",
              "*NODE PRINT,NSET=FLOOR,TOTALS=ONLY", "RF",
              *(("*EL PRINT,ELSET=BLOCK", "S") if stresses else ("*NODE PRINT,NSET=BODY", "V")),
              "*END STEP"]  # fmt: skip
    return "\n".join(lines) + "\n"


def densities(model: Model, material: Material) -> Array:
    """Cells' densities, kg/m^3, whose consistent masses have our phalanges' mass, centre, inertia.

    The material's times each cell's mean of `mass_factors` at its Gauss points, rounded to 1e-3.
    """
    volumes, places = by_element(
        geometries(model.points, model.cells),
        lambda of: (of.weights, of.shape @ model.points[model.cells[of.cells]]),
    )
    factors = np.ones(volumes.size)
    if model.chain is not None:
        body = np.repeat(model.body_of_point[model.cells[:, 0]], volumes.shape[1])
        points = [np.flatnonzero(body == w) for w in range(model.chain.links)]
        masses = material.density * volumes.ravel()
        factors = mass_factors(places.reshape(-1, 3), masses, points, model.chain, 1)
    mean = (factors.reshape(volumes.shape) * volumes).sum(axis=1) / volumes.sum(axis=1)
    return material.density * mean.round(3)


def _equations(hinges: Hinges) -> list[str]:
    """Σ c_i u_i = 0 along X and Y of each hinge; the node of the largest weight is dependent."""
    lines = []
    for first, last in pairwise(hinges.starts.tolist()):
        nodes, weights = hinges.nodes[first:last], hinges.weights[first:last]
        order = np.argsort(-np.abs(weights), kind="stable")
        for axis in (1, 2):
            terms = [f"{nodes[i] + 1},{axis},{weights[i]:.12g}" for i in order]
            lines += ["*EQUATION", str(len(terms))]
            lines += [
                ",".join(terms[i : i + TERMS_A_LINE]) for i in range(0, len(terms), TERMS_A_LINE)
            ]
    return lines


def _outside(springs: Springs, cells: Index) -> list[str]:
    """The lines that name the faces of the block's outside."""
    wanted = {frozenset(facet) for facet in springs.facets.tolist()}
    return [
        f"{e},S{side}"
        for e, cell in enumerate(cells.tolist(), 1)
        for side, corners in enumerate(_FACES, 1)
        if frozenset(cell[c] for c in corners) in wanted
    ]


def faces_within(cells: Index, nodes: Index) -> tuple[list[int], list[list[int]]]:
    """Cells (n,) with a face whose four corners are all among `nodes`, and the corners (n, 4)."""
    inside = np.isin(cells, nodes)
    found = [
        (number, cells[number, list(corners)].tolist())
        for corners in _FACES
        for number in np.flatnonzero(inside[:, corners].all(axis=1)).tolist()
    ]
    return [number for number, _ in found], [corners for _, corners in found]


def _floor(height: float, middle: float, side: float) -> Array:
    """Corners of a plate below the surface, wide enough for a body to slide on, in VTK order."""
    wide, low = 4.0 * side, -height - 0.5 * side
    square = [(-wide, -wide), (wide, -wide), (wide, wide), (-wide, wide)]
    # Local Z of the element is up: its second face, S2, is the top.
    return np.array([(middle + x, y, -z) for y in (low, -height) for x, z in square])


def floor_forces(printed: str) -> tuple[Array, Array]:
    """Times (s) and the floor's upward forces (N) of all increments in a .dat file."""
    found = np.array([(m[1], m[3]) for m in _FORCE.finditer(printed)], dtype=float).reshape(-1, 2)
    return found[:, 0], found[:, 1]


def stress_near(printed: str, time_s: float) -> tuple[float, Array]:
    """The printed time nearest to `time_s`, and the elements' mean Cauchy stress at it.

    (n_cells, 6), Pa, as xx, yy, zz, xy, yz, xz: the plain mean over eight points.
    """
    tables = {float(found[1]): found[2] for found in _STRESS.finditer(printed)}
    time = min(tables, key=lambda printed_at: abs(printed_at - time_s))
    values = np.array([line.split()[2:] for line in tables[time].splitlines()], dtype=float)
    return time, values.reshape(-1, 8, 6).mean(axis=1)[:, [0, 1, 2, 3, 5, 4]]


def last_velocities(printed: str) -> Array | None:
    """Nodes' velocities (n, 3), m/s, after the last increment; None if there was none."""
    return calculix.last_vectors(printed, "velocities (vx,vy,vz)")
