"""Random fingers that tap: what both models can run at their fixed settings.

Fingers as one might build them, unlike `random_scenes`, whose ranges reach far beyond: 1 to 4
phalanges of 10 to 80 mm, one in three unequal, L/d 2 to 10, E 1e7 to 1e11 Pa, rho 800 to 8000
kg/m^3, nu 0.3 to 0.49, mu 0 (one in five) to 1.2, e* 1 (every other) or 0.3 to 1, k 0.01 to 0.3 E d
(the paper's are 0.017 and 0.052), a surface 30 to 95 % of the reach below the hinge and a diameter
at least (the middle of a finger meets nearer ones first), 20 elements a phalanx (every other) or 2
to 20. By turns they fall, are driven by torques of 0.1 to 30 times weight times length, a third of
them upwards, start tilted by up to half a radian a phalanx, or tap three times (the solid: until
3 ms after the touch).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from validation.errors import RunFailedError
from validation.models.impact import impact_of
from validation.scenes.load import load_scene
from validation.studies.random_scenes import random_numbers

KINDS = ("falls", "driven", "tilted", "three taps")
SEED = 13
AFTER_S = 3e-3  # time for a solid's further taps, after the touch
LARGEST_TILT = 0.5  # rad


@dataclass(frozen=True)
class RandomTap:
    """A scene by its overrides of ``soft``; accuracy : the one that its run must keep, if any."""

    model: str
    kind: str
    overrides: tuple[str, ...]
    accuracy: float | None = None


def _short(number: float) -> float:
    """A number to four digits, as one would write it in a scene."""
    return float(f"{number:.4g}")


def case(model: str, index: int, accuracy: float | None = None) -> RandomTap:
    """The scene with that number; an `accuracy` chooses elements and settings itself."""
    kind = KINDS[index % len(KINDS)]
    u: Iterator[float] = iter(random_numbers(SEED, index))

    def log(low: float, high: float) -> float:
        return _short(low * (high / low) ** next(u))

    count = 1 + int(4 * next(u))
    size, spread = log(0.01, 0.08), 0.3 if next(u) < 1 / 3 else 0.0
    lengths = [_short(size * (1 + spread * np.cos(2.0 * w))) for w in range(count)]
    diameter = _short(size / log(2, 10))
    modulus, density = log(1e7, 1e11), log(800, 8000)
    poisson, slide, share = 0.3 + 0.19 * next(u), max(0.0, 1.5 * next(u) - 0.3), next(u)
    height = max((0.3 + 0.65 * share) * sum(lengths), diameter)
    height = min(height, 0.99 * sum(lengths))
    stiffness, bounce, few = modulus * diameter * log(0.01, 0.3), next(u), next(u)
    weight = 9.8 * density * 0.25 * np.pi * diameter**2 * sum(lengths)
    torque = weight * sum(lengths) * log(0.1, 30)
    turns = np.random.default_rng(int(1e9 * next(u))).uniform(size=(2, count))
    torques = torque * turns[0] * np.where(turns[1] < 1 / 3, -1, 1)
    tilts = LARGEST_TILT * (2 * turns[0] - 1)
    lowest = float(np.max(np.cumsum(lengths * np.sin(tilts))))
    if lowest > 0.8 * (height - diameter):
        tilts = -np.abs(tilts)
    overrides = [
        f"finger.phalanges={count}", f"finger.length={lengths}", f"finger.diameter={diameter}",
        f"finger.elements={20 if few < 0.5 else round(2 * 10 ** (2 * few - 1))}"
        if accuracy is None else f"solver.accuracy={accuracy}",
        f"material.youngs_modulus={modulus}", f"material.density={density}",
        f"material.poisson_ratio={poisson:.3g}", f"surface.height={height:.5g}",
        f"surface.friction={slide:.3g}", f"tip.normal_stiffness={stiffness:.4g}",
    ]  # fmt: skip
    if model == "hcm":  # the solid has no restitution
        overrides.append(
            f"tip.restitution={1.0 if bounce < 0.5 else 0.3 + 1.4 * (bounce - 0.5):.3g}"
        )
    if kind == "driven":
        overrides.append(f"drive.torques={list(map(_short, torques))}")
    elif kind == "three taps":
        overrides += _further_taps(model, tuple(overrides))
    elif kind == "tilted":
        overrides.append(f"start.angles={list(map(_short, tilts))}")
    return RandomTap(model, kind, tuple(overrides), accuracy)


def _further_taps(model: str, overrides: tuple[str, ...]) -> list[str]:
    if model == "hcm":
        return ["solver.hcm.taps=3"]
    try:
        touch = impact_of(load_scene("soft", overrides)).time_s
    except RunFailedError:  # the solver will report it too
        return []
    return [f"solver.fem.end_time={touch + AFTER_S:.6g}"]
