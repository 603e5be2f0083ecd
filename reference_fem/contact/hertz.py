"""Hertz's contact of an elastic sphere, or in plane stress of a disc, with a rigid plane (Johnson,
Contact Mechanics, 4.2 and 5.6).
"""

import math

from reference_fem.settings import Material

ITERATIONS = 20  # for the logarithm of the disc's force, which hardly changes


def hertz_contact_radius(material: Material, radius: float, force: float) -> float:
    """Contact radius a = (3 F R/(4 E*))^(1/3), m."""
    return float((0.75 * force * radius / material.plane_strain_modulus) ** (1 / 3))


def hertz_indentation(material: Material, radius: float, force: float) -> float:
    """Hertz: δ = (3 F/(4 E* sqrt(R)))^(2/3) of an elastic sphere on a rigid plane, m."""
    modulus = material.plane_strain_modulus
    return float((0.75 * force / (modulus * math.sqrt(radius))) ** (2 / 3))


def hertz_stiffness(material: Material, radius: float, force: float) -> float:
    """Energy-equivalent k = F²/(2 U), U = (2/5) F δ: k = 5 F/(4 δ), N/m."""
    return 1.25 * force / hertz_indentation(material, radius, force)


def hertz_patch(force: float, radius: float, material: Material, angle: float, dim: int) -> float:
    """Radius of Hertz's patch, m.

    In plane stress half the width of a line contact, a² = 4 F R / π E t, with t the chord of the
    round section where a phalanx at this angle below the horizontal touches.
    """
    if dim == 3:
        return hertz_contact_radius(material, radius, force)
    return math.sqrt(4.0 * force * radius / _line_stiffness(radius, material, angle))


def hertz_impact(
    mass: float, speed: float, radius: float, material: Material, angle: float, dim: int
) -> tuple[float, float]:
    """Largest force, N, and patch (`hertz_patch`), m, as a sphere, or a disc, takes up ½ m v².

    Sphere (11.4.1): ½ m v² = 2/5 k δ^(5/2), F = k δ^(3/2), a = sqrt(R δ), k = 4/3 E* sqrt(R). Disc,
    between its centre and the plane (5.6), with c = π E t:

        δ = F/c (2 ln(4R/a) - 1),    ½ m v² = ∫ F dδ = F²/2c (ln(4 c R/F) - 3/2)
    """
    if dim == 3:
        stiffness = 4.0 / 3.0 * material.plane_strain_modulus * math.sqrt(radius)
        approach = (1.25 * mass * speed**2 / stiffness) ** 0.4
        return stiffness * approach**1.5, math.sqrt(radius * approach)
    stiffness, logarithm, force = _line_stiffness(radius, material, angle), 5.0, 0.0
    for _ in range(ITERATIONS if speed > 0.0 else 0):
        force = speed * math.sqrt(mass * stiffness / logarithm)
        logarithm = max(1.0, math.log(4.0 * stiffness * radius / force) - 1.5)
    return force, hertz_patch(force, radius, material, angle, dim)


def _line_stiffness(radius: float, material: Material, angle: float) -> float:
    """π E t, N/m: t is the chord at an angle of at least 0.1."""
    chord = 2.0 * radius * max(abs(math.sin(angle)), 0.1)
    return math.pi * material.youngs_modulus * chord
