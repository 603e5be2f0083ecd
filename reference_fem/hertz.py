"""Hertz's contact of an elastic sphere with a rigid plane (Johnson, Contact Mechanics, 4.2)."""

import math

from reference_fem.settings import Material


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
