"""One generator of scenes for the reduced model, from numbers in [0, 1).

Both Hypothesis and the stress campaign supply such numbers, so that either can repeat what the
other finds. The ranges reach far beyond any finger: a scene may be hopeless, but needs an answer.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from hcm import Drive, Finger, Phalanx, Scene, Settings, Surface, Tip

NUMBERS = 24
# steps of one random scene: enough for a tap, few enough for ten thousand scenes
MAX_STEPS = 3_000
MOST_ELEMENTS = 240


def random_numbers(seed: int, index: int) -> list[float]:
    """The numbers of one scene of a campaign."""
    numbers: list[float] = np.random.default_rng((seed, index)).random(NUMBERS).tolist()
    return numbers


def _log(number: float, low: float, high: float) -> float:
    return float(low * (high / low) ** number)


def _count(number: float, low: int, high: int) -> int:
    return min(int(_log(number, low, high + 1)), high)


def _rare(number: float, share: float, special: float, otherwise: float) -> float:
    return special if number < share else otherwise


def random_scene(numbers: Sequence[float], max_steps: int = MAX_STEPS) -> Scene:
    """The scene that `NUMBERS` numbers in [0, 1) stand for; nearby numbers give nearby scenes.

    E 1e4..1e12 Pa, rho 100..2e4, slenderness L/d 2..200, 1..30 phalanges of 1..40 elements, k
    1e2..1e10 N/m, e* 0.05..1, mu 0..10, eta^-2 0..1e3, torques up to a thousand times the finger's
    weight times its length (either sign), gravity up to 1e3 m/s^2, a surface anywhere in reach,
    one tap or several, any spectral radius, fixed or controlled steps, elastic or rigid
    flights, by either integrator.
    """
    u: Iterator[float] = iter([float(number) for number in numbers])
    phalanges = _count(next(u) ** 2, 1, 30)
    length, slenderness = _log(next(u), 0.005, 0.5), _log(next(u), 2, 200)
    modulus, density = _log(next(u), 1e4, 1e12), _log(next(u), 100, 2e4)
    elements = min(_count(next(u), 1, 40), max(1, MOST_ELEMENTS // phalanges))
    phalanx = Phalanx(length, length / slenderness, modulus, density, elements)
    taper = _rare(next(u), 0.5, 1.0, _log(next(u), 0.3, 3.0))
    chain = tuple(
        Phalanx(
            length * taper ** (w / phalanges), phalanx.diameter, modulus, density,
            max(1, elements - w % 2) if taper != 1.0 else elements,
        )
        for w in range(phalanges)
    )  # fmt: skip
    finger = Finger(chain)
    depth = next(u)
    share = _rare(next(u), 0.1, _log(depth, 1e-6, 0.1), 0.02 + 0.979 * depth)
    # the surface may not cut the finger at rest
    height = max(finger.length * share, 0.505 * phalanx.diameter)
    friction = _rare(next(u), 0.15, 0.0, _log(next(u), 0.01, 10))
    ratio = _rare(next(u), 0.1, 0.0, _log(next(u), 1e-3, 1e3))
    tip = Tip(_log(next(u), 1e2, 1e10), min(1.0, 0.05 + 1.2 * next(u)), ratio)
    gravity = _rare(next(u), 0.7, 9.8, _log(next(u), 1e-2, 1e3))
    weight = density * phalanx.area * finger.length * 9.8
    size, sign = next(u), next(u)
    torques: tuple[float, ...] = ()
    if size > 0.6:
        largest = weight * finger.length * _log((size - 0.6) / 0.4, 1e-2, 1e3)
        # signs and sizes along the chain all derive from one number
        spread = [(sign * (7.0 + 3.0 * w)) % 2.0 - 0.7 for w in range(phalanges)]
        torques = tuple(largest * s for s in spread)
    several, control = next(u), next(u)
    free_fall_s = (2 * height / max(abs(gravity), 1e-3)) ** 0.5
    mass = density * phalanx.area * phalanx.length
    bounce = math.pi * (mass / tip.k) ** 0.5
    collocated = 0.2 < several < 0.35 or 0.85 < several < 0.95
    own_steps = control < 0.7  # steps fitted to the scene, or the defaults, whatever comes of it
    settings = Settings(
        flight_step=min(free_fall_s / 200, 1e-2) if own_steps else 1e-4,
        flight_tolerance=(
            0.0 if 0.45 < control < 0.5 else min(1e-5 * length / height, 1.0) if own_steps else 1e-6
        ),
        contact_step=bounce / 100 if own_steps else 1e-6,
        contact_tolerance=0.0 if 0.48 < control < 0.53 else 1e-11,
        spectral_radius=_rare(control, 0.6, 0.8, 2.5 * (control - 0.6)),
        end_time=4 * free_fall_s if several > 0.8 else None,
        taps=3 if 0.7 < several < 0.8 else 1,
        max_flight_time=min(max(5 * free_fall_s, 0.01), 10.0),
        max_contact_time=max(100 * bounce, 0.01),
        max_steps=max_steps,
        consistent_start=several > 0.05,
        flight="rigid" if 0.1 < several < 0.2 or several > 0.9 else "elastic",
        flight_integrator="gauss" if collocated else "generalized-alpha",
    )
    return Scene(finger, Surface(height, friction), tip,
                 Drive(torques, gravity, reaction=0.4 < several < 0.5), settings)  # fmt: skip
