"""The stability maps of the reference: which parameters, over which ranges, on which body.

Bodies are small, so that a cell takes tenths of a second: a block of 20 mm (half of it, 4 x 4 x 2
elements), one of 6 x 6 x 3 where the mesh is distorted, or a finger of one phalanx, 104 elements.
"""

from dataclasses import replace
from functools import partial

from validation.studies.stress.reference.judge import judge
from validation.studies.stress.reference.scene import ReferenceScene
from validation.studies.stress.stability_map import Map

STEPS = {"step_factor": (0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2)}
FACTORS = {"penalty_factor, surface_factor/1e4": (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)}
SPEEDS = {"speed (m/s)": (0.1, 0.5, 2.0, 5.0, 10.0, 20.0, 50.0)}
FRICTIONS = {"friction": (0.0, 0.1, 0.3, 0.5, 1.0, 2.0, 5.0, 10.0)}
RATIOS = {"poisson_ratio": (-0.5, 0.0, 0.3, 0.4, 0.45, 0.49, 0.495, 0.499)}
MODULI = (1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12)
LAW = "law (1 penalty, 2 surface, 3 impulse)"
LAWS = {1.0: "penalty", 2.0: "surface", 3.0: "impulse"}
POINTS = "points of the element"
ELEMENTS = {8.0: "hex8-sri", 1.0: "hex8-one-point", 4.0: None}  # 4: plane elements
PANELS = (LAW, POINTS, "dimensions")


def reference_maps(quick: bool) -> tuple[Map, ...]:
    """All maps; `quick` takes every third value of the axes."""
    plane = partial(Map, judge=judge, solver="reference")
    maps = (
        plane("step-penalty", STEPS | FACTORS | {LAW: (1.0, 2.0)},
              lambda step, factor, law: ReferenceScene(
                  step_factor=step, stiffness=factor, contact=LAWS[law])),
        plane("step-penalty-finger", STEPS | FACTORS | {LAW: (1.0, 2.0)},
              lambda step, factor, law: ReferenceScene(
                  body="finger", step_factor=step, stiffness=factor, contact=LAWS[law])),
        plane("step-penalty-2d", STEPS | FACTORS | {LAW: (1.0, 2.0)},
              lambda step, factor, law: ReferenceScene(
                  dim=2, step_factor=step, stiffness=factor, contact=LAWS[law])),
        plane("step-friction", STEPS | FRICTIONS | {"dimensions": (3.0, 2.0)},
              lambda step, mu, dim: ReferenceScene(dim=int(dim), step_factor=step, friction=mu)),
        plane("poisson-speed", RATIOS | SPEEDS | {POINTS: (8.0, 1.0, 4.0)},
              lambda ratio, v, n: ReferenceScene(
                  dim=2 if n == 4.0 else 3, poisson=ratio, speed=v, element=ELEMENTS[n],
                  modulus=1e8)),
        plane("friction-speed", FRICTIONS | SPEEDS | {LAW: (1.0, 2.0, 3.0)},
              lambda mu, v, law: ReferenceScene(
                  body="finger", friction=mu, speed=v, contact=LAWS[law], stiffness=1.0)),
        plane("distortion",
              {"nodes moved by (edges)": (0.0, 0.1, 0.2, 0.3, 0.4, 0.45, 0.6, 0.8, 1.0),
               "seed": tuple(map(float, range(1, 7))), LAW: (1.0, 2.0, 3.0)},
              lambda moves, seed, law: ReferenceScene(
                  divisions=6, distortion=moves, seed=int(seed), contact=LAWS[law],
                  stiffness=1.0)),
        plane("hourglass",
              {"tilt (rad)": (0.0, 0.05, 0.1, 0.2, 0.4, 0.785),
               "elements an edge": (2.0, 4.0, 6.0, 8.0), POINTS: (8.0, 1.0)},
              lambda tilt, count, n: ReferenceScene(
                  tilt=tilt, divisions=int(count), element=ELEMENTS[n])),
        plane("modulus-speed", {"youngs_modulus (Pa)": MODULI} | SPEEDS | {LAW: (1.0, 3.0)},
              lambda modulus, v, law: ReferenceScene(
                  modulus=modulus, speed=v, contact=LAWS[law], stiffness=1.0)),
        plane("bar",
              {"speed (m/s)": (0.1, 0.5, 1.0, 2.0), "elements an edge": (4.0, 8.0, 12.0),
               POINTS: (8.0, 1.0)},
              lambda v, count, n: ReferenceScene(
                  poisson=0.0, slide=0.0, tilt=0.0, speed=v, divisions=int(count),
                  element=ELEMENTS[n], step_factor=0.5)),
    )  # fmt: skip
    every = 3 if quick else 1
    return tuple(
        replace(m, name=f"reference-{m.name}", axes={
            name: values if name in PANELS else values[::every] for name, values in m.axes.items()
        })
        for m in maps
    )  # fmt: skip
