"""The stability maps of the reference: which parameters, over which ranges, on which body.

Bodies are small, so that a cell takes tenths of a second: a block of 20 mm (half of it, 4 x 4 x 2
elements), one of 6 x 6 x 3 where the mesh is distorted, or a finger of one phalanx, 104 elements.
"""

from __future__ import annotations

from collections.abc import Callable

from validation.studies.stress.reference.judge import judge
from validation.studies.stress.reference.scene import ReferenceScene
from validation.studies.stress.stability_map import Map

LAWS = {1.0: "penalty", 2.0: "surface", 3.0: "impulse"}
LAW = "law (1 penalty, 2 surface, 3 impulse)"

STEPS = (0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2)
FACTORS = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
SPEEDS = (0.1, 0.5, 2.0, 5.0, 10.0, 20.0, 50.0)
FRICTIONS = (0.0, 0.1, 0.3, 0.5, 1.0, 2.0, 5.0, 10.0)
RATIOS = (-0.5, 0.0, 0.3, 0.4, 0.45, 0.49, 0.495, 0.499)
MOVES = (0.0, 0.1, 0.2, 0.3, 0.4, 0.45, 0.6, 0.8, 1.0)
MODULI = (1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12)


def _block_steps(step: float, factor: float, law: float) -> ReferenceScene:
    return ReferenceScene(step_factor=step, stiffness=factor, contact=LAWS[law])


def _plate_steps(step: float, factor: float, law: float) -> ReferenceScene:
    return ReferenceScene(dim=2, step_factor=step, stiffness=factor, contact=LAWS[law])


def _finger_steps(step: float, factor: float, law: float) -> ReferenceScene:
    return ReferenceScene(body="finger", step_factor=step, stiffness=factor, contact=LAWS[law])


def _impulse_steps(step: float, friction: float, dim: float) -> ReferenceScene:
    return ReferenceScene(dim=int(dim), step_factor=step, friction=friction)


def _ratios(ratio: float, speed: float, points: float) -> ReferenceScene:
    element = {8.0: "hex8-sri", 1.0: "hex8-one-point", 4.0: None}[points]
    dim = 2 if points == 4.0 else 3
    return ReferenceScene(dim=dim, poisson=ratio, speed=speed, element=element, modulus=1e8)


def _frictions(friction: float, speed: float, law: float) -> ReferenceScene:
    return ReferenceScene(
        body="finger", friction=friction, speed=speed, contact=LAWS[law], stiffness=1.0
    )


def _distorted(moves: float, seed: float, law: float) -> ReferenceScene:
    return ReferenceScene(
        divisions=6, distortion=moves, seed=int(seed), contact=LAWS[law], stiffness=1.0
    )


def _hourglass(tilt: float, divisions: float, points: float) -> ReferenceScene:
    element = "hex8-sri" if points == 8.0 else "hex8-one-point"
    return ReferenceScene(tilt=tilt, divisions=int(divisions), element=element)


def _moduli(modulus: float, speed: float, law: float) -> ReferenceScene:
    return ReferenceScene(modulus=modulus, speed=speed, contact=LAWS[law], stiffness=1.0)


def _bars(speed: float, divisions: float, points: float) -> ReferenceScene:
    element = "hex8-sri" if points == 8.0 else "hex8-one-point"
    return ReferenceScene(
        poisson=0.0, slide=0.0, tilt=0.0, speed=speed, divisions=int(divisions), element=element,
        step_factor=0.5,
    )  # fmt: skip


def reference_maps(quick: bool) -> tuple[Map, ...]:
    """All maps; `quick` takes every second to fourth value of the axes."""

    def plane(
        name: str, x_name: str, y_name: str, panel_name: str, x: tuple[float, ...],
        y: tuple[float, ...], panels: tuple[float, ...],
        scene: Callable[[float, float, float], ReferenceScene],
    ) -> Map:  # fmt: skip
        if quick:
            x, y = x[::3], y[::3]
        return Map(
            "reference", f"reference-{name}", x_name, y_name, panel_name, x, y, panels, scene,
            judge,
        )  # fmt: skip

    step, factor, friction = "step_factor", "penalty_factor, surface_factor/1e4", "friction"
    speed, points = "speed (m/s)", "points of the element"
    return (
        plane("step-penalty", step, factor, LAW, STEPS, FACTORS, (1.0, 2.0), _block_steps),
        plane("step-penalty-finger", step, factor, LAW, STEPS, FACTORS, (1.0, 2.0), _finger_steps),
        plane("step-penalty-2d", step, factor, LAW, STEPS, FACTORS, (1.0, 2.0), _plate_steps),
        plane("step-friction", step, friction, "dimensions", STEPS, FRICTIONS, (3.0, 2.0),
              _impulse_steps),
        plane("poisson-speed", "poisson_ratio", speed, points, RATIOS, SPEEDS, (8.0, 1.0, 4.0),
              _ratios),
        plane("friction-speed", friction, speed, LAW, FRICTIONS, SPEEDS, (1.0, 2.0, 3.0),
              _frictions),
        plane("distortion", "nodes moved by (edges)", "seed", LAW, MOVES,
              tuple(map(float, range(1, 7))), (1.0, 2.0, 3.0), _distorted),
        plane("hourglass", "tilt (rad)", "elements an edge", points,
              (0.0, 0.05, 0.1, 0.2, 0.4, 0.785), (2.0, 4.0, 6.0, 8.0), (8.0, 1.0), _hourglass),
        plane("modulus-speed", "youngs_modulus (Pa)", speed, LAW, MODULI, SPEEDS, (1.0, 3.0),
              _moduli),
        plane("bar", speed, "elements an edge", points, (0.1, 0.5, 1.0, 2.0), (4.0, 8.0, 12.0),
              (8.0, 1.0),
              _bars),
    )  # fmt: skip
