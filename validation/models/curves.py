"""A run's record from force curves alone, of a plug-in model, measured or foreign data."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from validation.harness.provenance import provenance
from validation.harness.quantities import QUANTITIES
from validation.harness.record import Floats, RunRecord
from validation.scenes.load import NamedScene

TIMES = ("contact_time_s", "peak_normal_force_time_s")  # times, whose scale is the duration
# largest share, of the number or of the tap's duration, by which it may differ without a caution
APART = 0.05
SAME_TAP = 2.0  # a touch within this many durations after a tap still belongs to it
PUSHED = 0.5  # share of the largest F_n above which F_t / F_n is more than scatter


@dataclass(frozen=True)
class Curves:
    """Contact force over time.

    time_s : (n,), rising.
    normal_force_N : (n,), pushing the tip up; zero out of contact.
    tangential_force_N : (n,), along +X; None: not known.
    scalars : further scalars by their keys (`quantities.QUANTITIES`), such as the tip's velocity.
    errors : estimated absolute errors of scalars, by the same keys.
    """

    time_s: Floats
    normal_force_N: Floats
    tangential_force_N: Floats | None = None
    scalars: Mapping[str, Any] = field(default_factory=dict)
    errors: Mapping[str, Any] = field(default_factory=dict)


def touch_bounds(touches: NDArray[np.bool_]) -> NDArray[np.int64]:
    """First sample of each touch and the one after its last, (m, 2)."""
    return np.flatnonzero(np.diff(touches, prepend=False, append=False)).reshape(-1, 2)


def touches_of_tap(time: Floats, touches: NDArray[np.bool_]) -> tuple[int, int, int, int]:
    """First sample of the first tap, the one after its last, numbers of its touches and of all.

    A touch belongs to the tap if it begins within `SAME_TAP` times the tap's duration so far after
    a separation, as in the solvers (`hcm.taps.tap`).

    touches : (n,) whether a sample is in contact, which the first is not. The end of a tap that the
    record cuts off is the number of samples.
    """
    starts, ends = touch_bounds(touches).T
    count = 1
    while count < starts.size and (
        time[starts[count]] - time[ends[count - 1]]
        <= SAME_TAP * (time[ends[count - 1]] - time[starts[0] - 1])
    ):
        count += 1
    return int(starts[0]), int(ends[count - 1]), count, starts.size


def tap_scalars(curves: Curves) -> dict[str, Any]:
    """Scalars of the first tap, from where F_n leaves zero to where it returns (interpolated).

    - contact time, duration: from these two points
    - peaks: the largest sample in between; for F_t the one of largest magnitude, signed
    - impulse: the integral of F_n in between, by the trapezoid rule

    Raises ValueError: the arrays are not curves (shapes, order of time, finite numbers), no force
        is positive, or they begin or end in contact.
    """
    for name in ("time_s", "normal_force_N", "tangential_force_N"):
        given = getattr(curves, name)
        if given is not None and not isinstance(given, np.ndarray):
            raise ValueError(f"{name} is a {type(given).__name__}: must be a NumPy array")
        if given is not None and given.dtype.kind not in "iuf":
            raise ValueError(f"{name} is an array of {given.dtype}: must be one of real numbers")
    time, normal = curves.time_s, curves.normal_force_N
    tangential = np.zeros_like(normal) if curves.tangential_force_N is None else (
        curves.tangential_force_N
    )  # fmt: skip
    for name, array in (("normal_force_N", normal), ("tangential_force_N", tangential)):
        if array.ndim != 1 or array.shape != time.shape:
            raise ValueError(f"{name} has the shape {array.shape}, time_s {time.shape}")
    if time.size < 3 or not all(np.isfinite(a).all() for a in (time, normal, tangential)):
        raise ValueError("the curves need three samples or more, all of them finite numbers")
    if (np.diff(time) <= 0.0).any():
        raise ValueError("time_s does not rise from sample to sample")
    touched = np.flatnonzero(normal > 0.0)
    if not touched.size:
        raise ValueError("the normal force is nowhere positive")
    if touched[0] == 0:
        raise ValueError("the curves begin in contact: they need a sample without force there")
    first, last, *_ = touches_of_tap(time, normal > 0.0)
    if last == time.size:
        raise ValueError("the curves end in contact: they need a sample without force there")
    start, end = (_zero(time, normal, step) for step in (first, last))
    inside = slice(first, last)
    knots = np.concatenate([[start], time[inside], [end]])
    top = first + int(np.argmax(normal[inside]))
    scalars = {
        "contact_time_s": start,
        "peak_normal_force_N": float(normal[top]),
        "peak_normal_force_time_s": float(time[top] - start),
        "contact_duration_s": end - start,
        "normal_impulse_N_s": float(np.trapezoid([0.0, *normal[inside], 0.0], knots)),
    }
    if curves.tangential_force_N is not None:
        most = int(np.argmax(np.abs(tangential[inside])))
        scalars["peak_tangential_force_N"] = float(tangential[inside][most])
    return scalars


def other_than_stated(curves: Curves, own: Mapping[str, float]) -> list[str]:
    """A line for each number that the source states differently from `own`, its curves' scalars."""
    lines = []
    for key, value in own.items():
        stated, error = curves.scalars.get(key), curves.errors.get(key)
        if stated is None:
            continue
        # the times of a peak and of a touch lie between samples
        scale = own["contact_duration_s"] if key in TIMES else abs(value)
        # a NaN compares false
        if not abs(stated - value) <= APART * scale + (error or 0.0):
            lines.append(f"scalars.{key} = {stated:.4g} is used, but the curves give {value:.4g}")
    return lines


def beyond_friction(curves: Curves, friction: float) -> list[str]:
    """A line if |F_t| exceeds what the scene's friction allows at F_n."""
    normal, tangential = curves.normal_force_N, curves.tangential_force_N
    if tangential is None:
        return []
    pushed = normal > PUSHED * normal.max()
    most = float((np.abs(tangential[pushed]) / normal[pushed]).max())
    if most <= friction + APART * max(friction, most):
        return []
    return [
        f"tangential_force_N reaches {most:.2g} of normal_force_N, and surface.friction is"
        f" {friction:g}: check columns, units and the scene's friction"
    ]


def _zero(time: Floats, force: Floats, step: int) -> float:
    """Time at which the force passes zero between samples step - 1 and step."""
    before, after = float(force[step - 1]), float(force[step])
    share = before / (before - after) if before != after else 0.0
    return float(time[step - 1] + share * (time[step] - time[step - 1]))


def record_of(
    curves: Curves, scene: NamedScene, model: str, *, wall_time_s: float | None = None
) -> RunRecord:
    """The curves as the record of a completed run, with cautions where scalars contradict them.

    wall_time_s : duration of the solve; None for data.

    Raises ValueError: as `tap_scalars`, or a scalar's key is unknown.
    """
    unknown = set(curves.scalars) - {entry.key for entry in QUANTITIES}
    if unknown:
        raise ValueError(f"unknown scalars: {', '.join(sorted(unknown))}")
    own = tap_scalars(curves)
    found = {**own, "wall_time_s": wall_time_s, **curves.scalars}
    cautions = other_than_stated(curves, own)
    cautions += beyond_friction(curves, scene.tables.surface.friction)
    tangential = curves.tangential_force_N
    if tangential is None:
        tangential = np.full(curves.time_s.shape, np.nan)
    return RunRecord(
        scene=scene.name,
        model=model,
        variant="",
        status="COMPLETED",
        ok=True,
        message="; ".join(cautions),
        summary={entry.key: found.get(entry.key) for entry in QUANTITIES},
        history={
            "time_s": curves.time_s,
            "normal_force_N": curves.normal_force_N,
            "tangential_force_N": tangential,
        },
        errors=curves.errors,
        provenance=provenance(scene.document),
    )
