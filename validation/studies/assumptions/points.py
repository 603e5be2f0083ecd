"""The study's scenes: fingers that fall from rest, horizontal, and touch with the tip.

Scrambled Sobol points over the phalanges' number, L/d, E, rho, nu, mu and the last phalanx's angle
theta at the touch (angles are uniform, since other parts would touch first at most of uniform
heights). Rods of the true body's masses (`hcm.flight.rigid_chain`) fall to theta; the surface is at
the lowest point of the sphere about the end's centre, H = sum L sin theta_i + R (1 - sin theta_P).
"""

import math
from typing import Any

import numpy as np

import hcm
from hcm.arrays import Floats
from hcm.flight.rigid_chain import build_rods, rates
from validation.models import solid_mesh
from validation.scenes.load import load_scene
from validation.scenes.scene import Scene
from validation.sweep.axis import Axis
from validation.sweep.plan import assignment
from validation.sweep.points import values_of

DIAMETER = 0.015  # m: another size amounts to another density, as only gravity has a length
LONGEST_FALL_S = 1.0
# keys of a scene, or the angle in degrees
RANGES = {
    "finger.phalanges": Axis(low=1.0, high=5.0),
    "finger.length": Axis(low=2 * DIAMETER, high=10 * DIAMETER),
    "material.youngs_modulus": Axis(low=1e7, high=1e11, log=True),
    "material.density": Axis(low=800.0, high=8000.0, log=True),
    "material.poisson_ratio": Axis(low=0.3, high=0.49),
    "surface.friction": Axis(low=0.0, high=1.2),
    "angle_deg": Axis(low=15.0, high=62.0),
}


def points(number: int, seed: int = 0) -> list[dict[str, Any]]:
    """The first `number` points, each a dictionary by column, with numbers to six digits."""
    from scipy.stats import qmc

    cube = qmc.Sobol(len(RANGES), rng=np.random.default_rng(seed)).random_base2(
        math.ceil(math.log2(number))
    )
    values = [values_of(*pair) for pair in zip(RANGES.values(), cube[:number].T, strict=True)]
    return [
        _point(dict(zip(RANGES, map(six, row), strict=True))) for row in zip(*values, strict=True)
    ]


def _point(found: dict[str, Any]) -> dict[str, Any]:
    """A point with what follows from its values in the ranges."""
    found["finger.phalanges"] = int(found["finger.phalanges"])
    found["surface.height"] = six(_height(found))
    touch = solid_mesh.predicted_touch(tables_of(found), 3)
    # the linear spring that holds Hertz's energy at the turn, k d^2/2 = 2/5 F d, d = a^2/R
    radius, nu = 0.5 * DIAMETER, found["material.poisson_ratio"]
    found["tip.normal_stiffness"] = six(0.8 * touch.force * radius / touch.patch_radius**2)
    found["tip.tangential_ratio"] = six(2.0 * (1.0 - nu) / (2.0 - nu))
    found["patch_over_radius"] = six(touch.patch_radius / radius)
    return found


def tables_of(point: dict[str, Any]) -> Scene:
    """The tables of a point's scene; columns without a dot are not keys of a scene."""
    keys = {"finger.diameter": DIAMETER} | {key: v for key, v in point.items() if "." in key}
    return load_scene("soft", [assignment(key, value) for key, value in keys.items()]).tables


def _height(found: dict[str, Any]) -> float:
    """H at which the last phalanx has the wanted angle, m."""
    from scipy.integrate import solve_ivp

    count, length, modulus, density, ratio, _, angle = (found[key] for key in RANGES)
    phalanx = hcm.Phalanx(length, DIAMETER, modulus, density, poisson_ratio=ratio)
    anywhere, refined = hcm.Surface(1.0, 0.0), hcm.Assumptions("refined")
    rods, _ = build_rods(hcm.Finger((phalanx,) * count), anywhere, hcm.Drive(), refined)
    out = np.empty(2 * count)

    def motion(time: float, state: Floats) -> Floats:
        rates(time, state, rods, out)
        return out.copy()

    def beyond(time: float, state: Floats) -> float:
        del time
        return float(state[count - 1]) - math.radians(angle)

    beyond.terminal = True  # type: ignore[attr-defined]
    flight = solve_ivp(
        motion, (0.0, LONGEST_FALL_S), np.zeros(2 * count), events=beyond, rtol=1e-10, atol=1e-10
    )
    sines = np.sin(flight.y[:count, -1])
    return float(length * sines.sum() + 0.5 * DIAMETER * (1.0 - sines[-1]))


def six(value: float) -> float:
    """A number rounded to six digits."""
    return float(f"{value:.6g}")
