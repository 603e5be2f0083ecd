"""The stability maps of the reference: which parameters, over which ranges, on which body.

Bodies are small, so that a cell takes tenths of a second: a block of 20 mm (half of it, 4 x 4 x 2
elements), one of 6 x 6 x 3 where the mesh is distorted, or a finger of one phalanx, 104 elements.
"""

from dataclasses import replace
from functools import partial

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


ELEMENTS = {8.0: "hex8-sri", 1.0: "hex8-one-point", 4.0: None}  # by points; 4: plane elements


def reference_maps(quick: bool) -> tuple[Map, ...]:
    """All maps; `quick` takes every third value of the axes."""
    plane = partial(Map, judge=judge, solver="reference")
    step, factor, friction = "step_factor", "penalty_factor, surface_factor/1e4", "friction"
    speed, points = "speed (m/s)", "points of the element"
    maps = (
        plane("step-penalty", step, factor, LAW, STEPS, FACTORS, (1.0, 2.0),
              lambda x, y, law: ReferenceScene(step_factor=x, stiffness=y, contact=LAWS[law])),
        plane("step-penalty-finger", step, factor, LAW, STEPS, FACTORS, (1.0, 2.0),
              lambda x, y, law: ReferenceScene(
                  body="finger", step_factor=x, stiffness=y, contact=LAWS[law])),
        plane("step-penalty-2d", step, factor, LAW, STEPS, FACTORS, (1.0, 2.0),
              lambda x, y, law: ReferenceScene(
                  dim=2, step_factor=x, stiffness=y, contact=LAWS[law])),
        plane("step-friction", step, friction, "dimensions", STEPS, FRICTIONS, (3.0, 2.0),
              lambda x, y, dim: ReferenceScene(dim=int(dim), step_factor=x, friction=y)),
        plane("poisson-speed", "poisson_ratio", speed, points, RATIOS, SPEEDS, (8.0, 1.0, 4.0),
              lambda ratio, v, n: ReferenceScene(
                  dim=2 if n == 4.0 else 3, poisson=ratio, speed=v, element=ELEMENTS[n],
                  modulus=1e8)),
        plane("friction-speed", friction, speed, LAW, FRICTIONS, SPEEDS, (1.0, 2.0, 3.0),
              lambda mu, v, law: ReferenceScene(
                  body="finger", friction=mu, speed=v, contact=LAWS[law], stiffness=1.0)),
        plane("distortion", "nodes moved by (edges)", "seed", LAW, MOVES,
              tuple(map(float, range(1, 7))), (1.0, 2.0, 3.0),
              lambda moves, seed, law: ReferenceScene(
                  divisions=6, distortion=moves, seed=int(seed), contact=LAWS[law],
                  stiffness=1.0)),
        plane("hourglass", "tilt (rad)", "elements an edge", points,
              (0.0, 0.05, 0.1, 0.2, 0.4, 0.785), (2.0, 4.0, 6.0, 8.0), (8.0, 1.0),
              lambda tilt, count, n: ReferenceScene(
                  tilt=tilt, divisions=int(count), element=ELEMENTS[n])),
        plane("modulus-speed", "youngs_modulus (Pa)", speed, LAW, MODULI, SPEEDS, (1.0, 3.0),
              lambda modulus, v, law: ReferenceScene(
                  modulus=modulus, speed=v, contact=LAWS[law], stiffness=1.0)),
        plane("bar", speed, "elements an edge", points, (0.1, 0.5, 1.0, 2.0), (4.0, 8.0, 12.0),
              (8.0, 1.0),
              lambda v, count, n: ReferenceScene(
                  poisson=0.0, slide=0.0, tilt=0.0, speed=v, divisions=int(count),
                  element=ELEMENTS[n], step_factor=0.5)),
    )  # fmt: skip
    every = 3 if quick else 1
    return tuple(
        replace(m, name=f"reference-{m.name}", x=m.x[::every], y=m.y[::every]) for m in maps
    )
