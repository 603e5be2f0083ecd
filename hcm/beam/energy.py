"""Quantities computed from a state: energies, and the stress at section R."""

from __future__ import annotations

import numpy as np

from hcm.arrays import Floats
from hcm.beam.chain import Chain, stiffness
from hcm.beam.element import kinetic_energy, polynomials, shape_of, strain_energy
from hcm.beam.probe import Probe
from hcm.compiled import kernel


@kernel
def energies(q: Floats, v: Floats, chain: Chain) -> tuple[float, float, float]:
    """(kinetic, strain, gravity) energy of the finger, J; gravity is zero at Y = 0."""
    kinetic, strain, gravity = 0.0, 0.0, 0.0
    for e in range(chain.first.size):
        a = chain.first[e]
        kinetic += kinetic_energy(chain.mass[e], v[a : a + 8])
        shape = shape_of(q[a : a + 8], chain.length[e])
        strain += strain_energy(shape, stiffness(e, 1.0, chain))
    for i in range(q.size):
        gravity -= chain.weight[i] * q[i]
    return kinetic, strain, gravity


@kernel
def stress_at_probe(q: Floats, v: Floats, chain: Chain, probe: Probe) -> float:
    """Axial stress at R by `probe`, sigma = E (s + tau ds/dt), Pa, of the strain s = e - k d/2.

    k is the signed curvature (r' x r'')/|r'|. Terms of second order in e and k d/2 (`probe`) have
    no rates.

    The finger points along -X at rest, so its lower surface lies on the left of r', where a
    positive (left-turning) curvature shortens the fibres. With r' = A + B t + C t^2,
    l r'' = 2 B + 4 C t; with shear, C is multiplied by 1/(1 + Phi).
    """
    stress = 0.0
    for i in range(probe.elements.size):
        e, t = probe.elements[i], 2.0 * probe.abscissa[i] - 1.0
        a, length = chain.first[e], chain.length[e]
        ax, bx, dx, ay, by, dy = polynomials(shape_of(q[a : a + 8], length))
        rx, ry = ax + t * (bx + t * dx), ay + t * (by + t * dy)
        bend = 4.0 * t * probe.rigidity
        kx, ky = 2.0 * bx + bend * dx, 2.0 * by + bend * dy
        r2 = rx * rx + ry * ry
        curvature = (rx * ky - ry * kx) / (length * np.sqrt(r2))
        stretch = r2 - 1.0
        strain = 0.5 * stretch - curvature * probe.radius
        of_stretch, of_both = probe.second_order[0], probe.second_order[1]
        strain += stretch * (of_stretch * stretch + of_both * curvature)
        strain += probe.second_order[2] * curvature * curvature
        if chain.damped:
            ax, bx, dx, ay, by, dy = polynomials(shape_of(v[a : a + 8], length))
            vx, vy = ax + t * (bx + t * dx), ay + t * (by + t * dy)
            stretching = rx * vx + ry * vy
            bending = vx * ky - vy * kx + rx * (2.0 * by + bend * dy)
            bending = (bending - ry * (2.0 * bx + bend * dx)) / (length * np.sqrt(r2))
            bending -= curvature * stretching / r2
            strain += chain.relaxation[e] * (stretching - bending * probe.radius)
        stress += probe.weights[i] * probe.youngs_modulus * strain
    return stress
