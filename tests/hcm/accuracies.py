"""Runs with the settings of an accuracy, and the truth that they are held to."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

import hcm
from hcm.accuracy.chosen import contact_frequency, settings_for
from hcm.accuracy.coarser_run import ACCURACY_QUANTITIES
from tests.hcm.cases import NO_ESTIMATE, SOFT_SCENE


def truth(scene: hcm.Scene) -> np.ndarray:
    """Ten elements a phalanx, the flight's vibration in phase: 1e-5 (soft: 20 and 40 elements)."""
    fine = hcm.Finger(tuple(replace(p, elements=10) for p in scene.finger.phalanges))
    step = 0.005 / contact_frequency(fine.phalanges[-1], scene.tip)
    settings = hcm.Settings(
        flight_integrator="gauss", flight_step=1e-3, flight_tolerance=1e-9, contact_step=step,
        contact_tolerance=0.0, estimate=False,
    )  # fmt: skip
    return numbers(hcm.simulate_scene(replace(scene, finger=fine, settings=settings)))


def once(
    accuracy: float, scene: hcm.Scene, stated: Mapping[str, object] = MappingProxyType({})
) -> hcm.TapResult:
    """A run with the settings of that accuracy, which nothing judges."""
    of = settings_for(accuracy, scene, stated).scene
    plain = replace(of, settings=replace(of.settings, estimate=False))
    return hcm.simulate_scene(plain)


def numbers(result: hcm.TapResult) -> np.ndarray:
    assert result.status is hcm.Status.COMPLETED
    return np.array([getattr(result.summary, name) for name in ACCURACY_QUANTITIES])


def chosen(accuracy: float, scene: hcm.Scene = SOFT_SCENE, **stated: object) -> hcm.Chosen:
    values = {name: value for name, value in stated.items() if name != "elements"}
    return settings_for(accuracy, replace(scene, settings=replace(NO_ESTIMATE, **values)), stated)
