"""Quantities computed from a state: energies, and the stress at section R."""

from __future__ import annotations

import numpy as np

from hcm.arrays import Floats
from hcm.beam.chain import Chain, Probe
from hcm.beam.element import kinetic_energy, polynomial, strain_energy
from hcm.compiled import kernel


@kernel
def energies(q: Floats, v: Floats, chain: Chain) -> tuple[float, float, float]:
    """(kinetic, strain, gravity) energy of the finger, J; gravity is zero at Y = 0."""
    kinetic, strain, gravity = 0.0, 0.0, 0.0
    for e in range(chain.first.size):
        a, length, bending = chain.first[e], chain.length[e], chain.bending[e]
        qe = q[a : a + 8]
        kinetic += kinetic_energy(chain.mass[e], v[a : a + 8])
        strain += strain_energy(
            (qe[4] - qe[0]) / length, (qe[5] - qe[1]) / length, qe[2], qe[3], qe[6], qe[7],
            chain.axial_stiffness[e] * length, bending[1, 1], bending[1, 3],
        )  # fmt: skip
    for i in range(q.size):
        gravity -= chain.weight[i] * q[i]
    return kinetic, strain, gravity


@kernel
def stress_at_probe(q: Floats, v: Floats, chain: Chain, probe: Probe) -> float:
    """Axial stress at R, sigma = E (s + tau ds/dt), Pa, of the strain s = e - k d/2.

    k is the signed curvature (r' x r'')/|r'|.

    The finger points along -X at rest, so its lower surface lies on the left of r', where a
    positive (left-turning) curvature shortens the fibres. With r' = A + B t + C t^2,
    l r'' = 2 B + 4 C t; with shear, C is multiplied by 1/(1 + Phi).
    """
    stress = 0.0
    for i in range(2):
        e, t = probe.elements[i], 2.0 * probe.abscissa[i] - 1.0
        a, length = chain.first[e], chain.length[e]
        qe = q[a : a + 8]
        ax, bx, dx = polynomial((qe[4] - qe[0]) / length, qe[2], qe[6])
        ay, by, dy = polynomial((qe[5] - qe[1]) / length, qe[3], qe[7])
        rx, ry = ax + t * (bx + t * dx), ay + t * (by + t * dy)
        bend = 4.0 * t * probe.rigidity
        kx, ky = 2.0 * bx + bend * dx, 2.0 * by + bend * dy
        r2 = rx * rx + ry * ry
        curvature = (rx * ky - ry * kx) / (length * np.sqrt(r2))
        strain = 0.5 * (r2 - 1.0) - curvature * probe.radius
        if chain.damped:
            ve = v[a : a + 8]
            ax, bx, dx = polynomial((ve[4] - ve[0]) / length, ve[2], ve[6])
            ay, by, dy = polynomial((ve[5] - ve[1]) / length, ve[3], ve[7])
            vx, vy = ax + t * (bx + t * dx), ay + t * (by + t * dy)
            stretching = rx * vx + ry * vy
            bending = vx * ky - vy * kx + rx * (2.0 * by + bend * dy)
            bending = (bending - ry * (2.0 * bx + bend * dx)) / (length * np.sqrt(r2))
            bending -= curvature * stretching / r2
            strain += chain.relaxation[e] * (stretching - bending * probe.radius)
        stress += 0.5 * probe.youngs_modulus * strain
    return stress
