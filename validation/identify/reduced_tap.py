"""The reduced model's tap with another k: its peak force, and the angle at which it touches."""

from collections.abc import Callable
from typing import Any

import numpy as np

from validation.errors import RunFailedError
from validation.harness.interrupts import unless_interrupted
from validation.models.hcm import hcm_scene
from validation.models.solid_mesh import touching_spring
from validation.scenes.load import NamedScene, changed_scene

ROUNDS = 12  # fixed-point iterations; each contracts by dln F/dln k dln k/dln F = 0.5 * 0.33


def stated_force(scene: NamedScene, stiffness: Callable[[float], float], force: float) -> float:
    """F with F = the reduced model's peak force with k(F), by iteration from `force`, N.

    Raises RunFailedError: the forces still differ by more than 1e-4 after `ROUNDS` (two peaks of
    like height, of which now one is the higher and now the other).
    """
    for _ in range(ROUNDS):
        following = reduced_peak(scene, stiffness(force))
        if abs(following - force) < 1e-4 * force:
            return following
        last, force = force, following
    raise RunFailedError(
        f"scene {scene.name}: the reduced model's peak force, with the k of that force, is now"
        f" {last:.4g} N and now {force:.4g} N; change the tap, by surface.height for instance"
    )


def reduced_peak(scene: NamedScene, stiffness: float) -> float:
    """Peak normal force of the reduced model with another k, N.

    Raises RunFailedError: the reduced model's tap is not completed.
    """
    return float(reduced_tap(scene, stiffness).summary.peak_normal_force_N)


def touch_angle_of(tap: Any) -> float:
    """Angle, from its axis, at which the last phalanx of a reduced model's tap touches, rad."""
    from reference_fem.flight.touch import touch_angle

    touch = next(
        posture
        for event, posture in zip(tap.events, tap.event_postures, strict=True)
        if event.kind == "contact"
    )
    x, y = touch.slopes[-1][-1]
    return touch_angle(float(np.arctan2(-y, -x)))


def first_tap(scene: NamedScene, touch: Any) -> Any:
    """The reduced model's tap with the scene's k; if it has none, with the spring of the energy of
    the rigid finger's `touch`.

    Raises RunFailedError: neither is known, or the tap is not completed.
    """
    k = scene.tables.tip.normal_stiffness
    if k is None and touch is None:
        raise RunFailedError(
            f"scene {scene.name}: the rigid finger does not touch, which would give a first k;"
            " state tip.normal_stiffness, or lower surface.height"
        )
    return reduced_tap(scene, touching_spring(scene.tables, touch) if k is None else k)


def reduced_tap(scene: NamedScene, stiffness: float) -> Any:
    """The reduced model's tap with another k.

    Raises RunFailedError: it is not completed.
    """
    import hcm

    key = f"tip.normal_stiffness={float(stiffness)!r}"
    scene = changed_scene(scene.name, scene.document, (key,), scene.name)
    result = unless_interrupted(hcm.simulate_scene(hcm_scene(scene, estimate=False)))
    if result.summary.peak_normal_force_N is None or result.status is not hcm.Status.COMPLETED:
        why = result.message or "it does not touch"
        raise RunFailedError(
            f"scene {scene.name}: the reduced model has no whole tap: {why}; {result.status.advice}"
        )
    return result
