"""What is read off a state: energies, reactions and the stress at section R."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from hcm.ancf_element import (
    chord,
    combine,
    curvature_functions,
    kinetic_energy,
    slope_functions,
    strain_energy,
)
from hcm.layout import Chain, Probe

Floats = NDArray[np.float64]


@njit(cache=True)
def energies(q: Floats, v: Floats, chain: Chain) -> tuple[float, float, float]:
    """(kinetic, strain, gravity) energy of the finger, J; gravity is zero at Y = 0."""
    kinetic, strain, gravity = 0.0, 0.0, 0.0
    for e in range(chain.first.size):
        a, b = chain.first[e], chain.second[e]
        kinetic += kinetic_energy(chain.mass[e], v, a, b)
        strain += strain_energy(
            q, a, b, chain.length[e], chain.axial_stiffness[e], chain.bending[e]
        )
    for i in range(q.size):
        gravity -= chain.weight[i] * q[i]
    return kinetic, strain, gravity


@njit(cache=True)
def stress_at_probe(q: Floats, chain: Chain, probe: Probe) -> float:
    """Axial stress at R, sigma = E (e - k d/2), Pa, k the signed curvature (r' x r'')/|r'|.

    The finger points along -X at rest, so its lower surface lies on the left of r', where a
    positive (left-turning) curvature shortens the fibres.
    """
    stress = 0.0
    for i in range(2):
        e, xi = probe.elements[i], probe.abscissa[i]
        a, b, length = chain.first[e], chain.second[e], chain.length[e]
        c = chord(q, a, b, length)
        rx, ry = combine(q, a, b, c, slope_functions(xi))
        kx, ky = combine(q, a, b, c, curvature_functions(xi))
        r2 = rx * rx + ry * ry
        curvature = (rx * ky - ry * kx) / (length * np.sqrt(r2))
        strain = 0.5 * (r2 - 1.0) - curvature * probe.radius
        stress += 0.5 * probe.youngs_modulus * strain
    return stress
