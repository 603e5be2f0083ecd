"""The analytic limit: one stiff phalanx falls on a linear spring, in closed form.

A rod of mass m and length L falls about its hinge through the angle theta (sin theta = H/L) and
strikes with v = cos(theta) sqrt(3 g H). Its tip then moves as the mass m_e = m/(3 cos^2 theta) on
the spring k under the static force W = m g/2, for as long as F_n = k u_Y presses:

    t_c = int_0^theta da/sqrt(3 g sin(a)/L),      omega = sqrt(k/m_e),
    F = W + sqrt(W^2 + k m_e v^2),      T = 2 (pi - atan(k v/(omega W)))/omega.

The rod's bending adds (omega/omega_1)^2, its turning tan(theta) v/(omega L): together below
`RIGHT_WITHIN` on the map, whose softest spring is chosen for that (pinned and free,
omega_1 = 15.4 sqrt(E I/(rho A L^4))).
"""

import math

from scipy.integrate import quad

from hcm import Scene, TapResult
from validation.studies.stress.hcm.judge import examine
from validation.studies.stress.stability_map import CellVerdict


def closed_form(scene: Scene) -> dict[str, float]:
    """t_c (s), peak F_n (N), duration (s) and impulse (N s) of a frictionless elastic tap."""
    phalanx, g, k = scene.finger.phalanges[0], scene.drive.gravity, scene.tip.k
    length, height = phalanx.length, scene.surface.height
    mass = phalanx.density * phalanx.area * length
    angle = math.asin(height / length)
    # a = u^2 removes the singularity at the start
    fall, _ = quad(lambda u: 2 * u / math.sqrt(3 * g * math.sin(u**2) / length), 0, angle**0.5)
    speed = math.cos(angle) * math.sqrt(3 * g * height)
    effective = mass / (3 * math.cos(angle) ** 2)
    weight, omega = mass * g / 2, math.sqrt(k / effective)
    duration = 2 * (math.pi - math.atan(k * speed / (omega * weight))) / omega
    return {
        "contact_time_s": float(fall),
        "peak_normal_force_N": weight + math.sqrt(weight**2 + k * effective * speed**2),
        "contact_duration_s": duration,
        "normal_impulse_N_s": 2 * effective * speed + weight * duration,
    }


def judge_by_closed_form(scene: Scene) -> CellVerdict:
    """Right is what breaks no law and lies within `RIGHT_WITHIN` of the closed form."""
    return examine(scene, _by_closed_form)


def _by_closed_form(found: CellVerdict, scene: Scene, result: TapResult) -> CellVerdict:
    errors = {
        name: abs(getattr(result.summary, name) / exact - 1)
        for name, exact in closed_form(scene).items()
    }
    worst = max(errors, key=lambda name: errors[name])
    return found.compared("closed form", errors[worst], worst)
