"""Samples checked as a tap: which of them touch, and which are the first tap."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from validation.curve_files.contract import Samples, Sidecar
from validation.curve_files.sample_errors import (
    ZeroLine,
    normal_force_errors,
    peak_error,
    quantum,
    zero_line,
)
from validation.errors import UserError
from validation.harness.record import Floats
from validation.models.curves import touch_bounds, touches_of_tap

SCATTER_SAMPLES = 2  # most of a touch that may be scatter
# A first touch of few samples is scatter beside a later one of this many times its force or, if
# that is larger, of this many times its samples; a threshold of a larger share hides a tap.
SCATTER_RATIO, SCATTER_LENGTH, SCATTER_SHARE = 3.0, 5, 0.5
ROUNDED = 1e-6  # of an interval, by which subtracting an offset may round it
ROUND_OFF = 1e-12  # of the largest force: a computed one this small is zero
AXES = {  # and what a tap's largest force along it decides
    "normal_force": ("peak_normal_force_N", "peak_normal_force_time_s", "normal_impulse_N_s"),
    "tangential_force": ("peak_tangential_force_N",),
}


@dataclass(frozen=True, eq=False)
class SampledTap:
    """Samples of which some are a tap.

    time : (n,), s, since the motion starts
    body : the whole body's forces over the file's: 2 for half a model
    forces : (n,) each, N, the whole body's, by the names of `Samples.forces`
    round_off, hidden, least : N, what is zero by computing, by a threshold, and in all
    touches : (n,), whether each sample is in contact
    first : the first tap's samples with the one before and after it
    joined, count : touches of the first tap, and of all
    """

    time: Floats
    body: float
    forces: Mapping[str, Floats]
    round_off: float
    hidden: float
    least: float
    touches: NDArray[np.bool_]
    first: slice
    joined: int
    count: int

    @property
    def axes(self) -> list[str]:
        """Names of the forces that there are."""
        return [name for name in AXES if name in self.forces]

    @cached_property
    def contact(self) -> dict[str, Floats]:
        """The forces, zero out of contact, N."""
        return {name: np.where(self.touches, of, 0.0) for name, of in self.forces.items()}

    @cached_property
    def zero_lines(self) -> dict[str, ZeroLine]:
        """What the forces of `axes` are out of contact."""
        idle = ~self.touches
        return {name: zero_line(self.forces[name][idle], self.round_off) for name in self.axes}

    def errors(self) -> dict[str, float]:
        """Errors of the tap's numbers by its samples' standard deviations, where there are any."""
        errors, tap = dict[str, float](), self.first
        time, bounds = self.time[tap], touch_bounds(self.touches[tap])
        for name in self.axes:
            if (sigma := self.forces.get(f"{name}_sigma")) is None:
                continue
            samples = time, self.contact[name][tap], sigma[tap]
            line, step = self.zero_lines[name], quantum(self.forces[name][tap])
            if name == "normal_force":
                errors |= normal_force_errors(*samples, self.hidden, line, step)
                # how much later it ends by last touches that may be scatter
                solid = [end for begin, end in bounds if end - begin > SCATTER_SAMPLES]
                stray = time[bounds[-1, 1] - 1] - time[solid[-1] - 1] if solid else 0.0
                errors["contact_duration_s"] += float(stray)
            else:
                errors["peak_tangential_force_N"], _ = peak_error(*samples, line, step)
        return errors


def sampled_tap(samples: Samples, origin: str, sidecar: Sidecar) -> SampledTap:
    """What touches in a file's samples.

    Raises UserError: times do not rise, a force pulls, there is none, or a record begins or ends in
        contact.
    """
    body = 2.0 if sidecar.half_model else 1.0
    time, hidden = _times(samples, origin, sidecar), body * sidecar.threshold_N
    signs = {"normal_force": sidecar.normal, "tangential_force": sidecar.tangential}
    forces = {
        name: array * (-body if "-" in signs.get(name, "") else body)
        for name, array in samples.forces.items()
    }
    normal = forces["normal_force"]
    # rounded samples are off by up to half a step
    round_off = ROUND_OFF * float(np.abs(normal).max())
    least = max(hidden, 0.5 * quantum(normal) + round_off)
    _check_pushes(samples, normal, least, origin, sidecar)
    touches = _touches(normal, least)
    first = _first_tap(samples, time, normal, touches, least, origin, sidecar)
    return SampledTap(time, body, forces, round_off, hidden, least, touches, *first)


def _times(samples: Samples, origin: str, sidecar: Sidecar) -> Floats:
    """Times since the motion starts, s.

    Raises UserError: there are less than three samples, their times do not rise, or the offset
        leaves no digits of them.
    """
    line = samples.lines
    if line.size < 3:
        raise UserError(f"{origin}: has {line.size} samples; a tap needs three or more")
    steps = np.diff(samples.time_s)
    if (steps <= 0.0).any():
        at = 1 + int(np.argmax(steps <= 0.0))
        raise UserError(
            f"{origin}, line {line[at]}: its time, {samples.time_s[at]:g} s, is not after that of "
            "the sample before; sort the samples, one of each time"
        )
    time: Floats = samples.time_s - sidecar.time_offset_s
    if (np.abs(np.diff(time) - steps) > ROUNDED * steps).any():
        raise UserError(
            f"{origin}.toml: time_offset_s = {sidecar.time_offset_s:g}: must leave the digits of "
            f"times that are {steps.min():.3g} s apart; give the file's time at which the motion "
            "starts"
        )
    return time


def _check_pushes(
    samples: Samples, normal: Floats, least: float, origin: str, sidecar: Sidecar
) -> None:
    """Raise UserError where the normal force pulls by more than `least`, N."""
    body = 2.0 if sidecar.half_model else 1.0
    lowest = int(np.argmin(normal))
    pull = -normal[lowest]
    if pull <= least:
        return
    line = zero_line(normal[np.abs(normal) <= pull])
    remedy = ""
    if line.offset and line.offset >= 0.5 * pull:
        remedy = f" or, subtract the offset of the zero line, {line.zero / body:.2g} N"
    elif normal.max() > 1.5 * pull:
        remedy = (
            " or, for scatter about zero, the force up to which nothing touches, "
            f"threshold_N = {1.5 * pull / body:.2g}"
        )
    raise UserError(
        f"{origin}, line {samples.lines[lowest]}: normal force {-pull / body:.4g} N, and a contact"
        f" can't pull; state in {origin}.toml the right normal (it is {sidecar.normal}){remedy}"
    )


def _touches(normal: Floats, least: float) -> NDArray[np.bool_]:
    """Whether each sample is in contact: above the threshold, and no scatter about that, which is a
    touch of no more than twice the threshold beside a larger one.
    """
    touches: NDArray[np.bool_] = normal > least
    if normal.max() > 2.0 * least:
        for begin, end in touch_bounds(touches):
            if normal[begin:end].max() <= 2.0 * least:
                touches[begin:end] = False
    return touches


def _first_tap(
    samples: Samples, time: Floats, normal: Floats, touches: NDArray[np.bool_], least: float,
    origin: str, sidecar: Sidecar,
) -> tuple[slice, int, int]:  # fmt: skip
    """The first tap's samples with the one before and after it; how many touches it has, and all.

    Raises UserError: there is none, the record begins or ends in it, or it is scatter.
    """
    beside, body = f"{origin}.toml", 2.0 if sidecar.half_model else 1.0
    first, last, joined, count = 0, time.size, 0, 0
    if touches.any() and not touches[0]:
        first, last, joined, count = touches_of_tap(time, touches)
    if last == time.size:
        how, end = ("begins", normal[0]) if touches[0] else ("ends", normal[-1])
        allowed = f"{least / body:.2g} N"
        how = f"{how} in contact, {end / body:.4g} N where up to {allowed} counts as zero"
        how = how if touches.any() else f"has no normal force above {allowed}"
        raise UserError(
            f"{origin}: {how}; give a longer record, subtract an offset of the zero line, or state "
            f"in {beside} the right normal (it is {sidecar.normal}) and threshold_N, up to which "
            "nothing touches"
        )
    tap = slice(first - 1, last + 1)
    highest, own, few = normal[tap].max(), last - first, SCATTER_SAMPLES
    later = [
        (end - begin, normal[begin:end].max())
        for begin, end in touch_bounds(touches)
        if begin >= last
    ]
    largest = max((force for _, force in later), default=0.0)
    longer = any(size >= SCATTER_LENGTH * own and force > highest for size, force in later)
    if (own <= few + 1 and longer) or (own <= few and largest > SCATTER_RATIO * highest):
        state = f"state in {beside} threshold_N = {1.5 * highest / body:.2g}, else "
        remedy = state if 1.5 * highest < SCATTER_SHARE * largest else ""
        raise UserError(
            f"{origin}, line {samples.lines[first]}: touches for {own} samples, with "
            f"{highest / body:.4g} N, before a tap of {largest / body:.4g} N; if that is scatter, "
            f"{remedy}remove it; if the tip touches so briefly, sample faster"
        )
    return tap, joined, count
