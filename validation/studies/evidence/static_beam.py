"""Exudyn's beams at rest, clamped, under dead loads: by hcm's elements, and by either's energy.

hcm's elements store E A e^2/2 + E I k^2/2 a length with e = (r'.r' - 1)/2 and k = |r''|; Exudyn's
with e = |r'| - 1 and k = (r' x r'')/|r'|^2. With r' = lam (cos th, sin th) and the load F(s) that
is carried at s, both are stationary where, exactly and without elements,

    hcm:     E I lam'' = E A e lam + E I lam th'^2 - F.t,   (E I lam^2 th')' = -lam F.n,
    Exudyn:  E A (lam - 1) = F.t,                                  E I th'' = -lam F.n,

with th(0) = 0, th'(L) = lam'(0) = lam'(L) = 0: what they differ by is no error of either. The
second gives Exudyn's own number to its last digits.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_bvp

import hcm
from hcm.beam.banded_ldl import HALF_BANDWIDTH, storage
from hcm.beam.chain import build_chain
from hcm.beam.equations import residual, tangent
from hcm.contact.law import IN_FLIGHT, ContactLaw
from validation.harness.store import Store
from validation.models.adapter import Progress
from validation.studies.evidence.rows import Piece, Row

Floats = NDArray[np.float64]
NOWHERE = ContactLaw(1.0, 1.0, 0.75, 0.0, 1e3)  # a surface out of reach
STATIC = 1e12  # of the stiffness beside the mass, which drops out
LOAD_STEPS, ITERATIONS, ENOUGH = 20, 60, 1e-11
POINTS, TOLERANCE = 400, 1e-10  # of the boundary-value problem
ELEMENTS = 64


@dataclass(frozen=True)
class ClampedBeam:
    """A beam along X, clamped at 0 (place, and no slope), with a force at its end and its weight.

    length : L, m. axial, bending : E A, N, and E I, N m^2. force, weight : downwards, N and N/m.
    """

    length: float
    axial: float
    bending: float
    force: float = 0.0
    weight: float = 0.0

    def by_elements(self, elements: int) -> Floats:
        """Displacement (2,) of hcm's tip, m, by Newton's method in steps of the load."""
        diameter = 4.0 * (self.bending / self.axial) ** 0.5
        area = np.pi * diameter**2 / 4.0
        rod = hcm.Phalanx(self.length, diameter, self.axial / area, self.weight / area or 1.0,
                          elements)  # fmt: skip
        chain, q = build_chain(hcm.Finger((rod,)), hcm.Drive(gravity=float(self.weight > 0.0)))
        still, out, rows = np.zeros(q.size), np.empty(q.size), storage(q.size)
        first = int(chain.hinge_outer[0])
        free = np.setdiff1d(np.arange(first, q.size), [first, first + 1, first + 3])
        load = chain.weight.copy()
        load[chain.tip + 1] -= self.force
        scale = chain.scale[free]
        for share in np.linspace(0.0, 1.0, LOAD_STEPS + 1)[1:]:
            loaded = chain._replace(weight=share * load)
            for _ in range(ITERATIONS):
                residual(q, still, still, loaded, IN_FLIGHT, NOWHERE, out)
                tangent(q, STATIC, 0.0, loaded, IN_FLIGHT, NOWHERE, rows)
                matrix = _dense(rows)[np.ix_(free, free)]
                change = np.linalg.solve(matrix, -STATIC * scale * out[free])
                q[free] += scale * change
                if np.abs(change).max() < ENOUGH:
                    break
            else:
                raise ArithmeticError(f"no equilibrium at {share:g} of the load")
        # hcm's beams rest along -X
        return np.array([-q[chain.tip] - self.length, q[chain.tip + 1]])

    def by_energy(self, own: bool) -> Floats:
        """Displacement (2,) of the tip, m, that hcm's energy (`own`) or Exudyn's predicts."""
        place, slopes = np.linspace(0.0, self.length, POINTS), self._hcm if own else self._exudyn
        guess = np.stack([place, *np.zeros((3, POINTS)), np.ones(POINTS), np.zeros(POINTS)])

        def ends(a: Floats, b: Floats) -> Floats:
            return np.array([*a[:3], b[3], *([a[5], b[5]] if own else [])])

        def slope(s: Floats, y: Floats) -> Floats:
            return slopes(y, -self.force - self.weight * (self.length - s))

        found = solve_bvp(slope, ends, place, guess[: 6 if own else 4], tol=TOLERANCE,
                          max_nodes=100_000)  # fmt: skip
        if not found.success:
            raise ArithmeticError(found.message)
        return np.array([found.y[0, -1] - self.length, found.y[1, -1]])

    def _exudyn(self, y: Floats, load: Floats) -> Floats:
        """Slopes of (x, y, th, th')."""
        sine, cosine = np.sin(y[2]), np.cos(y[2])
        stretch = 1.0 + load * sine / self.axial
        bent = -stretch * load * cosine / self.bending
        return np.stack([stretch * cosine, stretch * sine, y[3], bent])

    def _hcm(self, y: Floats, load: Floats) -> Floats:
        """Slopes of (x, y, th, lam^2 th', lam, lam')."""
        sine, cosine, stretch = np.sin(y[2]), np.cos(y[2]), y[4]
        turning = y[3] / stretch**2
        pull = 0.5 * self.axial * (stretch**2 - 1.0) * stretch - load * sine
        return np.stack([
            stretch * cosine, stretch * sine, turning, -stretch * load * cosine / self.bending,
            y[5], pull / self.bending + stretch * turning**2,
        ])  # fmt: skip


def _dense(rows: Floats) -> Floats:
    """The symmetric matrix that `banded_ldl`'s rows store."""
    w = HALF_BANDWIDTH
    lower = sum(np.diag(rows[w + k :, w - k], -k) for k in range(w + 1))
    return np.asarray(lower + np.tril(lower, -1).T)


def rows(
    beam: ClampedBeam, stated: tuple[float, ...], known: float, progress: Progress, _: Store
) -> list[Row]:
    """Of each displacement that is stated, hcm's as it is and less what the energies differ by."""
    progress(0.0, "Exudyn's beams")
    fine, coarse = beam.by_elements(ELEMENTS), beam.by_elements(ELEMENTS // 2)
    gap = beam.by_energy(own=True) - beam.by_energy(own=False)
    found = []
    for axis, outside in enumerate(stated):
        error, ours, other = abs(fine[axis] - coarse[axis]), float(fine[axis]), float(gap[axis])
        name, common = f"u_{'xy'[axis]} of the tip", ("m", "hcm", outside, known)
        found += [
            Row(name, *common, ours, float(error), f"predicted: {other:+.4g} m by k = |r''|"),
            Row(f"{name}, less what is predicted", *common, ours - other, float(error)),
        ]
    return found


def _piece(
    name: str, where: str, beam: ClampedBeam, stated: tuple[float, ...], known: float
) -> Piece:
    return Piece(
        name, f"Exudyn's {name}", "element", f"Exudyn (J. Gerstmayr), {where}; printed",
        "Both are gradient-deficient ANCF beams at rest. Exudyn's curvature is the true one and its"
        " axial strain |r'| - 1, hcm's are the paper's, |r''| and (r'.r' - 1)/2; what that changes"
        " is solved for without elements.", (__name__,), partial(rows, beam, stated, known),
    )  # fmt: skip


BENDING = 1.725e6  # of the cantilever, N m^2
PIECES = (
    # 256 elements are 5e-12 m from it
    _piece("cantilever", "Examples/ANCFcantileverTest.py, converged, 2022-03-16",
           ClampedBeam(2.0, 2.07e9, BENDING, force=3.0 * BENDING / 4.0),
           (-0.508537304326, -1.207239854550), 1e-10),
    # "converged to 4 digits"
    _piece("hanging cable", "documentation, mini example of ObjectANCFCable2D, 32 elements",
           ClampedBeam(2.0, 1e6, 833.3333333333333, weight=78.0 * 9.81), (-0.5013058140,), 5e-5),
)  # fmt: skip
