"""A model of one's own: the finger as one rigid rod, its tip a linear spring without friction.

Fall from -X by the angle a, sin a = H/L, of a rod with J = m L^2/3: J w^2/2 = m g (L/2) sin a.
Impact of the mass J/(L cos a)^2 at w L cos a on a spring k: F = v sqrt(k m) sin(sqrt(k/m) t).
"""

import math

import numpy as np

from validation.models.adapter import Outcome
from validation.models.curves import Curves, record_of

name, kind = "mine", "reduced"
settings, resumable = "", False
sources, independent_of = ("rigid_rod",), ("hcm", "reference_fem", "meshes")


def refusal(scene):
    """Why it can't take this scene."""
    if scene.tables.drive.torques:
        return "torques are not carried; leave drive.torques out"
    if scene.tables.tip.normal_stiffness is None:
        return "tip.normal_stiffness is missing: it is the spring's k"
    return ""


def warm_up():
    """Nothing is compiled."""


def run(scene, progress=None, checkpoint=None):
    """Arrival, and the half sine of the force."""
    tables = scene.tables
    length, height = tables.total_length, tables.surface.height
    rows = tables.rows(tables.finger.length, tables.finger.diameter, tables.material.density)
    mass = sum(rho * math.pi / 4 * d**2 * span for span, d, rho in rows)
    roots = np.linspace(1e-9, math.sqrt(math.asin(height / length)), 2001)  # of angles
    rates = np.sqrt(3.0 * tables.drive.gravity / length * np.sin(roots**2))
    arrival = np.trapezoid(2.0 * roots / rates, roots)  # t = int da/w(a)
    arm = length * math.cos(roots[-1] ** 2)
    effective, speed = mass * length**2 / 3.0 / arm**2, rates[-1] * arm
    stiffness = tables.tip.normal_stiffness
    phase = np.linspace(0.0, math.pi, 401)
    time = arrival + phase / math.sqrt(stiffness / effective)
    force = speed * math.sqrt(stiffness * effective) * np.sin(phase).clip(0.0)
    force[[0, -1]] = 0.0
    velocity = {"tip_velocity_at_contact_m_per_s": (float(height * rates[-1]), float(-speed))}
    return Outcome(record_of(Curves(time, force, 0.0 * force, velocity), scene, name))
