"""Published clamped beams at rest under dead loads: by hcm's elements, and by either's energy.

hcm's elements store E A e^2/2 + E I k^2/2 per length with e = (r'.r' - 1)/2 and k = |r''|; Exudyn's
with e = |r'| - 1 and k = (r' x r'')/|r'|^2. With r' = lam (cos th, sin th) and the load F(s) that
is carried at s, both energies are stationary where, exactly and without elements,

    hcm:     E I lam'' = E A e lam + E I lam th'^2 - F.t,   (E I lam^2 th')' = -lam F.n,
    Exudyn:  E A (lam - 1) = F.t,                                  E I th'' = -lam F.n,

with th(0) = 0, th'(L) = lam'(0) = lam'(L) = 0: their difference is not an error of either code. The
second gives Exudyn's own number to its last digits.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_bvp

import hcm
from hcm.arrays import Floats
from hcm.assembly.statics import equilibrium
from hcm.beam.chain import build_chain
from validation.harness.store import Store
from validation.models.adapter import Progress
from validation.studies.evidence.rows import EvidenceRow

POINTS, TOLERANCE = 400, 1e-10  # of the boundary-value problem
ELEMENTS = 64
HELD = np.array([0, 1, 2, 3, 5])  # the hinge's multipliers; the first node except its stretch


@dataclass(frozen=True)
class ClampedBeam:
    """A beam along X, clamped at 0 (place and slope), with a force at its end and its weight.

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
        load = chain.weight.copy()
        load[chain.tip + 1] -= self.force
        q = equilibrium(chain, q, HELD, load)
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
        """Derivatives of (x, y, th, th') along s."""
        sine, cosine = np.sin(y[2]), np.cos(y[2])
        stretch = 1.0 + load * sine / self.axial
        bent = -stretch * load * cosine / self.bending
        return np.stack([stretch * cosine, stretch * sine, y[3], bent])

    def _hcm(self, y: Floats, load: Floats) -> Floats:
        """Derivatives of (x, y, th, lam^2 th', lam, lam') along s."""
        sine, cosine, stretch = np.sin(y[2]), np.cos(y[2]), y[4]
        turning = y[3] / stretch**2
        pull = 0.5 * self.axial * (stretch**2 - 1.0) * stretch - load * sine
        return np.stack([
            stretch * cosine, stretch * sine, turning, -stretch * load * cosine / self.bending,
            y[5], pull / self.bending + stretch * turning**2,
        ])  # fmt: skip


def rows(
    beam: ClampedBeam, stated: tuple[float, ...], known: float, progress: Progress, _: Store
) -> Iterator[EvidenceRow]:
    """Per published displacement hcm's own, and hcm's minus the difference of the energies."""
    progress(0.0, "Exudyn's beams")
    fine, coarse = beam.by_elements(ELEMENTS), beam.by_elements(ELEMENTS // 2)
    gap = beam.by_energy(own=True) - beam.by_energy(own=False)
    numbers = np.stack([fine, np.abs(fine - coarse), gap], axis=1).tolist()
    for axis, outside, (ours, error, other) in zip("xy", stated, numbers, strict=False):
        name, common = f"u_{axis} of the tip", ("m", "hcm", outside, known)
        yield EvidenceRow(name, *common, ours, error, f"predicted: {other:+.4g} m by k = |r''|")
        yield EvidenceRow(f"{name}, less what is predicted", *common, ours - other, error)


def princeton_rows(progress: Progress, _: Store) -> Iterator[EvidenceRow]:
    """The sag of the Princeton beam, flat and on edge, against ANSYS' beams and solids."""
    progress(0.0, "the Princeton beam")
    length, young, poisson, sides = 0.508, 71.7e9, 0.31, (12.3777e-3, 3.2024e-3)
    area = sides[0] * sides[1]
    for lying, stated in PRINCETON.items():
        thick = sides[1] if lying == "flat" else sides[0]
        bending = young * area * thick**2 / 12.0
        for force, numbers in zip(FORCES, stated, strict=True):
            beam = ClampedBeam(length, young * area, bending, force=force)
            ours, coarse = (-float(beam.by_elements(n)[1]) for n in (ELEMENTS, ELEMENTS // 2))
            shear = force * length / (5.0 / 6.0 * young / (2.0 * (1.0 + poisson)) * area)
            remark = f"its shear, which the paper's beams lack: {shear:.2g} m"
            for (of, known), outside in zip(ANSYS.items(), numbers, strict=True):
                name = f"sag under {force:g} N, {lying}; {of}"
                error = abs(ours - coarse)
                yield EvidenceRow(name, "m", "hcm", outside, known * outside, ours, error, remark)


BENDING = 1.725e6  # of the cantilever, N m^2
FORCES = (8.896, 13.345)  # N
# By ANSYS' beams and its solids, m.
PRINCETON = {
    "flat": ((0.146245978, 0.143848652), (0.200677707, 0.197669499)),
    "on edge": ((1.071417630e-2, 1.069752828e-2), (1.606423724e-2, 1.603700622e-2)),
}
# Relative errors that are assumed: of beams, which changed little from 10 elements to 199; of
# solids, of which finer ones "don't have much influence".
ANSYS = {"beams": 2e-4, "solids": 2e-3}
# Exudyn's printed values, and their errors: its cantilever's 256 elements are 5e-12 m off; the
# cable's are "converged to 4 digits".
EXUDYN = {
    "cantilever": (ClampedBeam(2.0, 2.07e9, BENDING, force=3.0 * BENDING / 4.0),
                   (-0.508537304326, -1.207239854550), 1e-10),
    "hanging cable": (ClampedBeam(2.0, 1e6, 833.3333333333333, weight=78.0 * 9.81),
                      (-0.5013058140,), 5e-5),
}  # fmt: skip
