"""What the kernels of the 8-point hexahedron ask of a material: a contract for laws.

Each stands in a file of its own beside `saint_venant`: a class of `Law`, a class of `Blocks` that
selects it, what its rows of `reference` hold (`ElementKind.constants`), and compiled functions of
these names, which get no `law`. An element's pressure p follows from one measure v of its volume, a
sum over points; damping is that of `strain_rate`, as in the stress of outputs. f, r and o are rows
of F Q, `reference` and a place in it, as in `point`.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from reference_fem.arrays import Array
from reference_fem.compiled import use_for
from reference_fem.elements.blocks import Blocks
from reference_fem.elements.hexahedron.edges import Rows

Five = tuple[float, float, float, float, float]


class Law(NamedTuple):
    """The class selects the functions. relaxation : row of `reference` that holds tau, if any."""

    relaxation: int


def law_of(blocks: Blocks) -> Law:
    """The law of the elements in these blocks."""
    raise NotImplementedError


def volume(law: Law, f: Rows, r: Array, o: int) -> float:
    """Part of one point in v, m^3."""
    raise NotImplementedError


def pressure(law: Law, r: Array, lane: int, v: float) -> float:
    """Pressure p, Pa."""
    raise NotImplementedError


def energy(law: Law, r: Array, lane: int, v: float) -> float:
    """The energy whose derivative is p, J."""
    raise NotImplementedError


def point(law: Law, g: Rows, r: Array, o: int, mu: float, p: float) -> tuple[Rows, float]:
    """Rows x, y, z of w P J^-T: the forces conjugate to g_1, g_2, g_3 at one point; its energy, J.

    Where the caller that inlines this does not use the energy, it is not computed.
    """
    raise NotImplementedError


def damping(law: Law, r: Array, lane: int, v: float, rate: float) -> Five:
    """Pressures p and, where they are not one, p's viscous part, Pa; tau, s; `energy`, J, and what
    the viscous part takes, W. rate : sum of w tr dE/dt, m^3/s.
    """
    raise NotImplementedError


def damped_point(
    law: Law, bases: Rows, rates: Rows, r: Array, o: int, given: Five, stored: float, power: float
) -> tuple[Rows, float, float]:
    """`point` with damping, `rates` those of the bases; energy and power plus its own.

    given : mu, tau, p, its viscous part, and lag (see `strain_rate`).
    """
    raise NotImplementedError


FUNCTIONS = (volume, pressure, energy, point, damping, damped_point)


def implement_law(blocks: type[Blocks], law: Law, *compiled: Callable[..., Any]) -> None:
    """Register a law for a class of blocks, and its compiled `FUNCTIONS`."""
    use_for(law_of, blocks, lambda blocks: law, forceinline=True)
    for asked, function in zip(FUNCTIONS, compiled, strict=True):
        use_for(asked, type(law), _without_law(function), forceinline=True)


def _without_law(function: Callable[..., Any]) -> Callable[..., Any]:
    return lambda law, *args: function(*args)
