"""Samples checked as a tap, and what was done to them in lines."""

import math

import numpy as np
from numpy.typing import NDArray

from validation.curve_files.samples import Floats, Samples
from validation.curve_files.sidecar import Sidecar
from validation.errors import UserError
from validation.models.curves import Curves, other_than_stated, tap_scalars, touches_of_tap

COARSE = 10.0  # an interval over the tap's median one that is worth a line
# Samples of a first touch, and times its force a later one has, beside which it is scatter.
SCATTER_SAMPLES, SCATTER_RATIO = 2, 3.0
UNKNOWN = (np.inf, np.inf)  # of both ends
FEW = 20  # samples of a tap that is said to have few: its peak is then known to 0.3 %


def curves_of(samples: Samples, origin: str, sidecar: Sidecar) -> tuple[Curves, list[str]]:
    """The curves, and a line for each thing that was done or taken for granted.

    Time counts from the scene's start; forces are the whole body's, zero out of contact.

    Raises UserError: times do not rise, a force pulls, there is none, or a record begins or ends in
        contact.
    """
    line, beside, body = samples.lines, f"{origin}.toml", 2.0 if sidecar.half_model else 1.0
    if line.size < 3:
        raise UserError(f"{origin}: has {line.size} samples; a tap needs three or more")
    time = samples.time_s - sidecar.time_offset_s
    axes = {"normal_force": sidecar.normal, "tangential_force": sidecar.tangential}
    forces = {
        name: array * (-body if "-" in axes.get(name, "") else body)
        for name, array in samples.forces.items()
    }
    normal, least = forces["normal_force"], body * sidecar.threshold_N
    if (np.diff(time) <= 0.0).any():
        at = 1 + int(np.argmax(np.diff(time) <= 0.0))
        raise UserError(
            f"{origin}, line {line[at]}: its time, {samples.time_s[at]:g} s, is not after that of "
            "the sample before; sort the samples, one of each time"
        )
    lowest, touches = int(np.argmin(normal)), normal > least
    if (pull := -normal[lowest]) > least:
        zero, known = _zero_line(normal[np.abs(normal) <= pull])
        remedy = f"take the offset of the zero line off, {zero / body:.2g} N"
        if abs(zero) <= known or abs(zero) < 0.5 * pull:
            remedy = (
                "for scatter about zero, the force up to which nothing touches, "
                f"threshold_N = {1.5 * pull / body:.2g}"
            )
        raise UserError(
            f"{origin}, line {line[lowest]}: normal force {-pull:.4g} N, and a contact can't pull; "
            f"state in {beside} the right normal (it is {sidecar.normal}) or, {remedy}"
        )
    tap, joined, count = _first_tap(samples, time, normal, touches, origin, sidecar)
    contact = {name: np.where(touches, force, 0.0) for name, force in forces.items()}
    tangential, sigma = contact.get("tangential_force"), forces.get("normal_force_sigma")
    notes = [*filter(None, [sidecar.source]), *samples.notes, _of_the_whole(sidecar, beside)]
    idle = ~touches & np.any([forces[name] != 0.0 for name in axes if name in forces], axis=0)
    if idle.any():
        notes.append(
            f"{idle.sum()} samples of up to {least:g} N count as no contact, without force"
        )
    from_trigger = time[0] < 0.0 and "time_offset_s" not in sidecar.model_fields_set
    if unknown_start := from_trigger or time[tap][0] <= 0.0:
        what, begins = ("record", time[0]) if from_trigger else ("tap", time[tap][0])
        notes.append(
            f"the {what} begins at {begins:.4g} s and the motion at 0 s, so its arrival says "
            f"nothing; state when the motion starts in {beside}: time_offset_s"
        )
    if tangential is None:
        notes.append("no tangential force: it is not compared")
    if count > 1:
        of = f"{joined} touches" if joined > 1 else "one touch"
        notes.append(
            f"touches {count} times; the first tap is compared, of {of} and "
            f"{normal[tap].max():.4g} N where the largest has {normal.max():.4g} N (if some are "
            "scatter, raise threshold_N)"
        )
    zero, known = _zero_line(normal[~touches])
    if offset := abs(zero) > known:
        notes.append(f"the zero line lies at {zero / body:.2g} N: take it off; errors have it")
    steps = np.diff(time[tap])
    if steps.max() > COARSE * np.median(steps):
        where = line[tap][1 + int(np.argmax(steps))]
        notes.append(
            f"before line {where} a gap in the tap, {steps.max():.3g} s where the median step is "
            f"{np.median(steps):.3g} s, bridged by a straight line"
        )
    if steps.size <= FEW:
        notes.append(f"the tap has {steps.size - 1} samples, its peak lies between two of them")
    errors: dict[str, float] = {}
    if sigma is not None:
        errors = _errors(time[tap], contact["normal_force"][tap], sigma[tap], least)
        if offset:
            errors["peak_normal_force_N"] += abs(zero)
            errors["normal_impulse_N_s"] += abs(zero) * float(time[tap][-1] - time[tap][0])
    if tangential is not None and (deviation := forces.get("tangential_force_sigma")) is not None:
        most = int(np.argmax(np.abs(tangential[tap])))
        errors["peak_tangential_force_N"] = float(deviation[tap][most])
    if unknown_start and errors:
        errors["contact_time_s"] = np.inf
    errors |= sidecar.uncertainty.model_dump(exclude_unset=True)
    if not errors:
        notes.append(f"no uncertainty is known, so no verdict: give sigma columns, or {beside}")
    scalars = sidecar.scalars.model_dump(exclude_unset=True)
    curves = Curves(time, contact["normal_force"], tangential, scalars, errors)
    remedy = (
        f"take it out of {beside} unless it is the better one (half_model, time_offset_s and"
        " threshold_N change the curves alone)"
    )
    doubts = other_than_stated(curves, tap_scalars(curves))
    return curves, [*notes, *[f"{line}: {remedy}" for line in doubts]]


def _first_tap(
    samples: Samples, time: Floats, normal: Floats, touches: NDArray[np.bool_], origin: str,
    sidecar: Sidecar,
) -> tuple[slice, int, int]:  # fmt: skip
    """The first tap's samples with the one before and after it; how many touches it has, and all.

    Raises UserError: there is none, the record begins or ends in it, or it is scatter.
    """
    beside, body = f"{origin}.toml", 2.0 if sidecar.half_model else 1.0
    least = body * sidecar.threshold_N
    first, last, joined, count = 0, time.size, 0, 0
    if touches.any() and not touches[0]:
        first, last, joined, count = touches_of_tap(time, touches)
    if last == time.size:
        how = f"begins in contact, {normal[0]:.4g} N" if touches[0] else "ends in contact"
        how = how if touches.any() else f"has no normal force above {least:g} N"
        raise UserError(
            f"{origin}: {how}; give a longer record, take an offset of the zero line off, or state "
            f"in {beside} the right normal (it is {sidecar.normal}) and threshold_N"
        )
    tap = slice(first - 1, last + 1)
    highest = normal[tap].max()
    if last - first <= SCATTER_SAMPLES and normal.max() > SCATTER_RATIO * highest:
        raise UserError(
            f"{origin}, line {samples.lines[first]}: touches for {last - first} samples, with "
            f"{highest:.4g} N, before a tap of {normal.max():.4g} N; if that is scatter, state in "
            f"{beside} threshold_N = {1.5 * highest / body:.2g}, else cut it off"
        )
    return tap, joined, count


def _zero_line(idle: Floats) -> tuple[float, float]:
    """Median of a force where nothing touches, which edges of a tap hardly move, and how well it is
    known, N: three standard deviations, by the median of what samples are off.
    """
    if not idle.size:
        return 0.0, 0.0
    zero = float(np.median(idle))
    scatter = 1.4826 * float(np.median(np.abs(idle - zero)))
    return zero, 3.0 * 1.2533 * scatter / math.sqrt(idle.size)


def _of_the_whole(sidecar: Sidecar, beside: str) -> str:
    """What holds for all samples."""
    body = "doubled, as half a body's" if sidecar.half_model else "taken as the whole body's"
    since = f"less {sidecar.time_offset_s:g} s" if sidecar.time_offset_s else "as since the start"
    unsaid = [key for key in ("half_model", "time_offset_s") if key not in sidecar.model_fields_set]
    remedy = f" (else {beside}: {', '.join(unsaid)})" if unsaid else ""
    return f"forces {body}, times {since}{remedy}"


def _errors(time: Floats, normal: Floats, sigma: Floats, least: float) -> dict[str, float]:
    """What one standard deviation means for the numbers of a tap, correlated all along it.

    - peak: sigma there, and what n samples of a half sine may miss of it, which are no further
      apart than T/m, m = n - 1 of even n and n of odd: 1/cos(pi/2/m) - 1; its time: how far away
      the force is as high within sigma
    - impulse: the integral of sigma, and the trapezoid's (pi/n)^2/12
    - start, end: how long the force is no more than sigma and the threshold (for a linear rise,
      sigma over the slope), and how long it is below the threshold, unseen: no longer than it then
      takes to three times that, linear or as Hertz's t^(3/2)
    """
    top, seen = int(np.argmax(normal)), np.flatnonzero(normal > least + sigma)
    ends = np.array((time[seen[0]] - time[0], time[-1] - time[seen[-1]]) if seen.size else UNKNOWN)
    unseen = np.zeros(2)
    if least > 0.0:
        well = np.flatnonzero(normal > 3.0 * least)
        unseen = np.array(
            (time[well[0]] - time[1], time[-2] - time[well[-1]]) if well.size else UNKNOWN
        )
    ends = ends + unseen
    high = np.abs(time[normal + sigma >= normal[top]] - time[top]).max()
    samples = time.size - 2
    parts = samples - 1 + samples % 2
    missed = (1.0 / np.cos(0.5 * np.pi / parts) - 1.0) * normal[top] if parts > 1 else np.inf
    rule = (np.pi / samples) ** 2 / 12.0 * np.trapezoid(normal, time) if parts > 1 else np.inf
    rule += least * unseen.sum()
    return {
        "contact_time_s": float(ends[0]),
        "contact_duration_s": float(sum(ends)),
        "peak_normal_force_N": float(np.hypot(sigma[top], missed)),
        "peak_normal_force_time_s": float(high + ends[0]),
        "normal_impulse_N_s": float(np.hypot(np.trapezoid(sigma, time), rule)),
    }
