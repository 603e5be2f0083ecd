"""The stability maps of the reduced model: which parameters, over which ranges, on which scene."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from hcm import Drive, Finger, Phalanx, Settings, Surface, Tip
from validation.stress.random_scenes import HcmScene, random_numbers, random_scene

SOFT = Phalanx(0.04, 0.015, 1e9, 1400.0, elements=5)
MAX_STEPS = 10_000


@dataclass(frozen=True)
class Cell:
    """Where a cell lies on its map, its scene, and whether a tighter run is worth its time."""

    map: str
    x: float
    y: float
    panel: float
    scene: HcmScene
    compare: bool = True


@dataclass(frozen=True)
class Map:
    """A grid of cells: names and values of its axes and panels, and the scene of a cell."""

    name: str
    x_name: str
    y_name: str
    panel_name: str
    x: tuple[float, ...]
    y: tuple[float, ...]
    panels: tuple[float, ...]
    scene: Callable[[float, float, float], HcmScene]
    compare: bool = True

    def cells(self) -> Iterator[Cell]:
        """All cells, panel by panel."""
        for panel in self.panels:
            for y in self.y:
                for x in self.x:
                    scene = self.scene(x, y, panel)
                    yield Cell(self.name, x, y, panel, scene, self.compare)


def _finger(count: int = 3, modulus: float = 1e9, elements: int = 5) -> Finger:
    return Finger((replace(SOFT, youngs_modulus=modulus, elements=elements),) * count)


def _soft(**changes: object) -> HcmScene:
    scene = HcmScene(
        _finger(), Surface(0.1, 0.5), Tip(0.78e6), Drive(), Settings(max_steps=MAX_STEPS)
    )
    return replace(scene, **changes)  # type: ignore[arg-type]


def _steps(step: float, modulus: float, radius: float) -> HcmScene:
    settings = Settings(
        contact_step=step,
        flight_step=min(100 * step, 1e-3),
        spectral_radius=radius,
        max_steps=MAX_STEPS,
    )
    return _soft(finger=_finger(modulus=modulus), settings=settings)


def _stiffness(stiffness: float, step: float, restitution: float) -> HcmScene:
    settings = Settings(contact_step=step, max_steps=MAX_STEPS)
    return _soft(tip=Tip(stiffness, restitution), settings=settings)


def _friction(friction: float, ratio: float, restitution: float) -> HcmScene:
    return _soft(surface=Surface(0.1, friction), tip=Tip(0.78e6, restitution, ratio))


def _slenderness(slenderness: float, elements: float, modulus: float) -> HcmScene:
    finger = Finger(
        (Phalanx(0.04, 0.04 / slenderness, modulus, 1400.0, elements=int(elements)),) * 3
    )
    return _soft(finger=finger)


def _drive(torque: float, gravity: float, sign: float) -> HcmScene:
    return _soft(drive=Drive((torque, sign * torque, torque), gravity))


def _phalanges(count: float, modulus: float, elements: float) -> HcmScene:
    finger = _finger(int(count), modulus, int(elements))
    return _soft(finger=finger, surface=Surface(0.8 * finger.length, 0.5))


def _taps(restitution: float, end_time: float, friction: float) -> HcmScene:
    finger = _finger(1, elements=2)
    settings = Settings(end_time=end_time, contact_step=1e-5, max_steps=200_000)
    return HcmScene(
        finger, Surface(0.002, friction), Tip(1e4, restitution), Drive((), 9.8), settings
    )


def _random(number: float, seed: float, unused: float) -> HcmScene:
    del unused
    return random_scene(random_numbers(int(seed), int(number)))


def _powers(low: float, high: float, count: int) -> tuple[float, ...]:
    return tuple(float(f"{value:.4g}") for value in np.geomspace(low, high, count))


def _whole(low: int, high: int, count: int) -> tuple[float, ...]:
    return tuple(sorted({float(round(value)) for value in np.geomspace(low, high, count)}))


def hcm_maps(quick: bool) -> tuple[Map, ...]:
    """All maps; `quick` takes every axis coarser and leaves out ten seconds of taps."""

    def n(full: int, coarse: int) -> int:
        return coarse if quick else full

    maps = (
        Map("step-modulus-radius", "contact_step (s)", "youngs_modulus (Pa)", "spectral_radius",
            _powers(1e-7, 1e-4, n(13, 4)), _powers(1e4, 1e12, n(17, 5)),
            (0.0, 0.8, 1.0) if quick else (0.0, 0.3, 0.6, 0.8, 1.0), _steps),
        Map("stiffness-step", "normal_stiffness (N/m)", "contact_step (s)", "restitution",
            _powers(1e2, 1e10, n(25, 9)), _powers(1e-7, 1e-4, n(13, 3)),
            (1.0,) if quick else (1.0, 0.5), _stiffness),
        Map("friction-ratio-restitution", "friction", "tangential_ratio", "restitution",
            (0.0, *_powers(0.01, 10, n(12, 4))), (0.0, *_powers(1e-3, 1e3, n(12, 4))),
            (0.05, 0.5, 1.0) if quick else (0.05, 0.2, 0.5, 0.8, 1.0), _friction),
        Map("slenderness-elements", "slenderness", "elements", "youngs_modulus",
            _powers(2, 200, n(11, 4)), _whole(1, 80 if quick else 320, n(10, 4)),
            (1e9,) if quick else (1e7, 1e9), _slenderness),
        Map("torque-gravity", "torque (N m)", "gravity (m/s2)", "sign of the second torque",
            (0.0, *_powers(1e-3, 10, n(16, 5))), (0.0, *_powers(0.1, 1e3, n(12, 3))),
            (1.0, -1.0), _drive),
        Map("phalanges", "phalanges", "youngs_modulus (Pa)", "elements",
            _whole(1, 30, n(14, 5)), _powers(1e5, 1e11, n(7, 2)),
            (2.0,) if quick else (1.0, 2.0, 5.0), _phalanges),
        Map("random", "number", "seed", "", tuple(map(float, range(n(10_000, 150)))),
            (2026.0,), (0.0,), _random, compare=False),
    )  # fmt: skip
    if quick:
        return maps
    taps = Map("taps", "restitution", "end_time (s)", "friction",
               (0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0), (1.0, 3.0, 10.0), (0.0, 0.5), _taps,
               compare=False)  # fmt: skip
    return (*maps, taps)
