"""The stability maps of the reduced model: which parameters, over which ranges, on which scene."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from hcm import Assumptions, Drive, Finger, Phalanx, Scene, Settings, Surface, Tip
from validation.studies.random_scenes import random_numbers, random_scene
from validation.studies.stress.hcm.judge import judge_by_dop853, judge_by_laws, judge_by_tighter_run
from validation.studies.stress.hcm.rigid_rod import judge_by_closed_form
from validation.studies.stress.stability_map import Map

SOFT = Phalanx(0.04, 0.015, 1e9, 1400.0, elements=5)
STIFFNESS = 0.78e6  # k, N/m
MAX_STEPS = 10_000


def soft_finger(modulus: float = 1e9, count: int = 3, elements: int = 5) -> Finger:
    """Phalanges like the soft finger's."""
    return Finger((replace(SOFT, youngs_modulus=modulus, elements=elements),) * count)


SOFT_FINGER, SOFT_TIP, UNDRIVEN = soft_finger(), Tip(STIFFNESS), Drive()


def soft_scene(
    finger: Finger = SOFT_FINGER,
    height: float = 0.1,
    friction: float = 0.5,
    tip: Tip = SOFT_TIP,
    drive: Drive = UNDRIVEN,
    **settings: Any,
) -> Scene:
    """The soft scene with these changes; `settings` are fields of `hcm.Settings`."""
    chosen = Settings(**{"max_steps": MAX_STEPS, **settings})
    return Scene(finger, Surface(height, friction), tip, drive, chosen)


def _refined(friction: float, modulus: float, restitution: float) -> Scene:
    finger = Finger((replace(SOFT, youngs_modulus=modulus, poisson_ratio=0.4),) * 3)
    scene = soft_scene(finger, friction=friction, tip=Tip(STIFFNESS, restitution))
    return replace(scene, assumptions=Assumptions("refined"))


def _slender(slenderness: float, elements: float, modulus: float) -> Scene:
    phalanx = Phalanx(0.04, 0.04 / slenderness, modulus, 1400.0, elements=int(elements))
    return soft_scene(Finger((phalanx,) * 3))


def _many(count: float, modulus: float, elements: float) -> Scene:
    finger = soft_finger(modulus, int(count), int(elements))
    return soft_scene(finger, height=0.8 * finger.length)


def _bouncing_rod(restitution: float, end_time: float, friction: float) -> Scene:
    """A rod that bounces about ten times a second."""
    return soft_scene(
        soft_finger(count=1, elements=2), 0.01, friction, Tip(1e4, restitution),
        end_time=end_time, contact_step=1e-5, contact_tolerance=1e-9, max_steps=400_000,
    )  # fmt: skip


def _powers(low: float, high: float, count: int) -> tuple[float, ...]:
    return tuple(float(f"{value:.4g}") for value in np.geomspace(low, high, count))


def _whole(high: int, count: int) -> tuple[float, ...]:
    return tuple(sorted({float(round(value)) for value in np.geomspace(1, high, count)}))


def hcm_maps(quick: bool) -> tuple[Map, ...]:
    """All maps; `quick` has coarser axes and leaves out the map of taps over up to ten seconds."""

    def n(full: int, coarse: int) -> int:
        return coarse if quick else full

    plane = partial(Map, judge=judge_by_tighter_run, solver="hcm")
    maps = (
        plane("step-modulus-radius",
              {"contact_step (s)": _powers(1e-7, 1e-4, n(17, 4)),
               "youngs_modulus (Pa)": _powers(1e4, 1e12, n(17, 5)),
               "spectral_radius": (0.0, 0.8, 1.0) if quick else (0.0, 0.3, 0.6, 0.8, 1.0)},
              lambda step, modulus, radius: soft_scene(
                  soft_finger(modulus), contact_step=step, flight_step=min(100 * step, 1e-3),
                  spectral_radius=radius)),
        plane("stiffness-step",
              {"normal_stiffness (N/m)": _powers(1e2, 1e10, n(33, 9)),
               "contact_step (s)": _powers(1e-7, 1e-4, n(13, 3)),
               "restitution": (1.0,) if quick else (1.0, 0.5)},
              lambda stiffness, step, restitution: soft_scene(
                  tip=Tip(stiffness, restitution), contact_step=step)),
        plane("friction-ratio-restitution",
              {"friction": (0.0, *_powers(0.01, 10, n(15, 4))),
               "tangential_ratio": (0.0, *_powers(1e-3, 1e3, n(15, 4))),
               "restitution": (0.05, 0.5, 1.0) if quick else (0.05, 0.2, 0.5, 0.8, 1.0)},
              lambda friction, ratio, restitution: soft_scene(
                  friction=friction, tip=Tip(STIFFNESS, restitution, ratio))),
        plane("refined-restitution",
              {"friction": (0.0, *_powers(0.1, 1.2, n(7, 2))),
               "youngs_modulus (Pa)": _powers(1e7, 1e10, n(7, 2)),
               "restitution": (0.1, 0.5) if quick else (0.05, 0.1, 0.2, 0.3, 0.5, 0.8, 1.0)},
              _refined),
        plane("slenderness-elements",
              {"slenderness": _powers(2, 200, n(11, 4)),
               "elements": _whole(40 if quick else 320, n(10, 4)),
               "youngs_modulus": (1e9,) if quick else (1e7, 1e9)}, _slender),
        plane("torque-gravity",
              {"torque (N m)": (0.0, *_powers(1e-3, 10, n(20, 5))),
               "gravity (m/s2)": (0.0, *_powers(0.1, 1e3, n(14, 3))),
               "sign of the second torque": (1.0, -1.0)},
              lambda torque, gravity, sign: soft_scene(
                  drive=Drive((torque, sign * torque, torque), gravity))),
        plane("phalanges",
              {"phalanges": _whole(30, n(17, 5)),
               "youngs_modulus (Pa)": _powers(1e5, 1e11, n(9, 2)),
               "elements": (2.0,) if quick else (1.0, 2.0, 5.0)}, _many),
        plane("rigid-rod",
              {"normal_stiffness (N/m)": _powers(1e3, 1e6, n(13, 5)),
               "youngs_modulus (Pa)": _powers(1e10, 1e12, n(5, 2)),
               "height (m)": (0.008,) if quick else (0.008, 0.02)},
              lambda stiffness, modulus, height: soft_scene(
                  soft_finger(modulus, 1, 2), height, 0.0, Tip(stiffness),
                  max_steps=10 * MAX_STEPS),
              judge=judge_by_closed_form),
        plane("other-integrator",
              {"friction": (0.0, 0.1, 0.3, 0.5, 1.0, 3.0, 10.0)[:: n(1, 3)],
               "youngs_modulus (Pa)": _powers(1e7, 1e9, n(3, 2)),
               "restitution": (1.0,) if quick else (1.0, 0.5)},
              lambda friction, modulus, restitution: soft_scene(
                  soft_finger(modulus), friction=friction, tip=Tip(STIFFNESS, restitution)),
              judge=judge_by_dop853),
        plane("random",
              {"number": tuple(map(float, range(n(10_000, 150)))), "seed": (2026.0,)},
              lambda number, seed: random_scene(random_numbers(int(seed), int(number))),
              judge=judge_by_laws, solver="fuzz"),
        plane("taps",
              {"restitution": (0.9, 0.99, 1.0), "end_time (s)": (1.0, 3.0, 10.0),
               "friction": (0.0, 0.5)}, _bouncing_rod, judge=judge_by_laws),
    )  # fmt: skip
    return maps[:-1] if quick else maps
