"""Samples checked as a tap, and what was done to them in lines."""

import numpy as np
from numpy.typing import NDArray

from validation.curve_files.contract import Samples, Sidecar
from validation.curve_files.sample_errors import (
    SCATTER_SAMPLES,
    ZeroLine,
    excess,
    held,
    lone_peak,
    quantum,
    tap_errors,
    zero_line,
)
from validation.errors import UserError
from validation.harness.record import Floats
from validation.models.curves import (
    Curves,
    other_than_stated,
    tap_scalars,
    touch_bounds,
    touches_of_tap,
)

COARSE = 10.0  # an interval over the tap's median one that is worth a line
# A first touch of few samples is scatter beside a later one of this many times its force or, if
# that is larger, of this many times its samples; a threshold of a larger share hides a tap.
SCATTER_RATIO, SCATTER_LENGTH, SCATTER_SHARE = 3.0, 5, 0.5
FEW = 20  # samples of a tap that is said to have few: its peak is then known to 0.3 %
LONE = 0.05  # of the peak, by which one sample above its neighbours is worth a line
RAISED = 0.01  # of the peak, what scatter may raise it by that is worth a line
ROUNDED = 1e-6  # of an interval, by which subtracting an offset may round it
ROUND_OFF = 1e-12  # of the largest force: a computed one this small is zero
AXES = {  # and what a tap's largest force along it decides
    "normal_force": ("peak_normal_force_N", "peak_normal_force_time_s", "normal_impulse_N_s"),
    "tangential_force": ("peak_tangential_force_N",),
}


def curves_of(samples: Samples, origin: str, sidecar: Sidecar) -> tuple[Curves, list[str]]:
    """The curves, and a line for each thing that was done or taken for granted.

    Time counts from the scene's start; forces are the whole body's, zero out of contact.

    Raises UserError: times do not rise, a force pulls, there is none, or a record begins or ends in
        contact.
    """
    beside, body = f"{origin}.toml", 2.0 if sidecar.half_model else 1.0
    time, hidden = _times(samples, origin, sidecar), body * sidecar.threshold_N
    signs = {"normal_force": sidecar.normal, "tangential_force": sidecar.tangential}
    forces = {
        name: array * (-body if "-" in signs.get(name, "") else body)
        for name, array in samples.forces.items()
    }
    normal, tangential = forces["normal_force"], forces.get("tangential_force")
    # rounded samples are off by up to half a step
    round_off = ROUND_OFF * float(np.abs(normal).max())
    least = max(hidden, 0.5 * quantum(normal) + round_off)
    _check_pushes(samples, normal, least, origin, sidecar)
    touches = _touches(normal, least)
    tap, joined, count = _first_tap(samples, time, normal, touches, least, origin, sidecar)
    contact = {name: np.where(touches, force, 0.0) for name, force in forces.items()}
    axes = [name for name in AXES if name in forces]
    lines = {name: zero_line(forces[name][~touches], round_off) for name in axes}
    errors = tap_errors(time, forces, contact, touches, tap, hidden, lines)
    notes = [*filter(None, [sidecar.source]), *samples.notes]
    notes.append(_of_the_whole(sidecar, beside))
    off = np.max([np.abs(forces[name]) for name in axes], axis=0)
    idle = ~touches & (off > round_off)
    if idle.any():
        most = max(least, float(off[idle].max())) / body
        notes.append(
            f"{idle.sum()} samples of up to {most:.3g} N count as no contact, without force"
        )
    if hidden > 0.0:
        notes.append(
            f"threshold_N = {sidecar.threshold_N:g} hides how the tap begins: curves over time are"
            " aligned where it is passed, and their differences include that delay"
        )
    if tangential is None:
        stated_peak = "peak_tangential_force_N" in sidecar.scalars.model_fields_set
        but = "only its stated peak" if stated_peak else "it"
        notes.append(f"no tangential force: {but} is {'not ' * (not stated_peak)}compared")
    if count > 1:
        of = f"{joined} touches" if joined > 1 else "one touch"
        own, largest = (f"{force.max() / body:.4g} N" for force in (normal[tap], normal))
        notes.append(
            f"touches {count} times; the first tap is compared, of {of} and {own} where the "
            f"largest has {largest} (if some are scatter, raise threshold_N)"
        )
    if joined > 1:
        whole = float(time[tap][-1] - time[tap][0])
        notes.append(
            "models part taps by a prediction: for the same touches, if they have as many, set"
            f" solver.hcm.tap_until and solver.fem.tap_until = {whole:.2g}"
        )
    for name, line in lines.items():
        by_samples = AXES[name][0] in errors.keys() - sidecar.uncertainty.model_fields_set
        found = _quality(np.abs(contact[name][tap]), line, body, "; errors include it" * by_samples)
        notes += [note if name == "normal_force" else f"{name}: {note}" for note in found]
    notes += _intervals(samples, time, tap)
    errors |= sidecar.uncertainty.model_dump(exclude_unset=True)
    if unknown := _unknown_start(time, tap, sidecar, beside):
        notes.append(unknown)
        if errors:
            errors["contact_time_s"] = np.inf
    if not errors:
        notes.append(
            "no uncertainty is known, so nothing is judged: give sigma columns, or state "
            f"uncertainty in {beside}"
        )
    scalars = sidecar.scalars.model_dump(exclude_unset=True)
    stated = scalars.keys() & sidecar.uncertainty.model_fields_set
    for name in axes:
        if saturated := _saturation(name, contact[name][tap], body, beside):
            notes.append(saturated)
            errors |= {key: np.inf for key in AXES[name] if key not in stated}
    curves = Curves(time, contact["normal_force"], contact.get("tangential_force"), scalars, errors)
    remedy = (
        f"take it out of {beside} unless it is the better one (half_model, time_offset_s and"
        " threshold_N change the curves alone)"
    )
    doubts = other_than_stated(curves, tap_scalars(curves))
    return curves, [*notes, *[f"{doubt}: {remedy}" for doubt in doubts]]


def _unknown_start(time: Floats, tap: slice, sidecar: Sidecar, beside: str) -> str:
    """A line if nothing tells the tap's arrival from the start of the motion, else nothing."""
    from_trigger = time[0] < 0.0 and "time_offset_s" not in sidecar.model_fields_set
    known = time[tap][0] > 0.0 and not from_trigger
    if known or "contact_time_s" in sidecar.scalars.model_fields_set:
        return ""
    what, begins = ("record", time[0]) if from_trigger else ("tap", time[tap][0])
    return (
        f"the {what} begins at {begins:.4g} s and the motion at 0 s, so its arrival means "
        f"nothing; state when the motion starts in {beside}: time_offset_s"
    )


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
        f"{origin}, line {samples.lines[lowest]}: normal force {-pull:.4g} N, and a contact can't "
        f"pull; state in {origin}.toml the right normal (it is {sidecar.normal}){remedy}"
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
            f"{highest:.4g} N, before a tap of {largest:.4g} N; if that is scatter, {remedy}remove"
            " it; if the tip touches so briefly, sample faster"
        )
    return tap, joined, count


def _of_the_whole(sidecar: Sidecar, beside: str) -> str:
    """What holds for all samples."""
    body = "doubled from half a body's" if sidecar.half_model else "taken as the whole body's"
    since = f"less {sidecar.time_offset_s:g} s" if sidecar.time_offset_s else "from the start"
    unsaid = [key for key in ("half_model", "time_offset_s") if key not in sidecar.model_fields_set]
    remedy = f" (else {beside}: {', '.join(unsaid)})" if unsaid else ""
    return f"forces {body}, times {since}{remedy}"


def _saturation(name: str, force: Floats, body: float, beside: str) -> str:
    """A line if a tap's force is held at its largest value in either direction, else nothing."""
    for one in (force, -force):
        count, usual = held(one)
        if count > usual:
            at = force[np.argmax(one)] / body
            what = "peak and impulse are" if name == "normal_force" else "its peak is"
            return (
                f"{name} is held at {at:.4g} N for {count} samples, of which rounding and a round "
                f"top explain {usual}: the sensor or its amplifier saturated, so {what} at least "
                "the curve's and not judged; measure again in a larger range, or state better "
                f"numbers in {beside}: scalars and their uncertainty"
            )
    return ""


def _quality(size: Floats, line: ZeroLine, body: float, included: str) -> list[str]:
    """Lines of an offset of the zero line, of scatter, and of a stray largest sample.

    size : |force| of the tap, N. included : what ends each, for the error of the peak.
    """
    notes, peak, raised = [], float(size.max()), excess(size, line.scatter)
    if line.offset:
        notes.append(f"the zero line lies at {line.zero / body:.2g} N: subtract it{included}")
    if raised > RAISED * peak:
        notes.append(
            f"samples scatter by {line.scatter / body:.2g} N, which may raise the peak by "
            f"{raised / body:.2g} N: filter them{included}"
        )
    lone = lone_peak(size, LONE * peak + raised) if size.size > FEW + 2 else 0.0
    if lone:
        notes.append(
            f"the largest sample, {peak / body:.4g} N, stands {lone / body:.2g} N above both its "
            f"neighbours: if it is stray, take it out{included}"
        )
    return notes


def _intervals(samples: Samples, time: Floats, tap: slice) -> list[str]:
    """Lines of a gap in the tap, and of few samples."""
    notes, steps = [], np.diff(time[tap])
    if steps.max() > COARSE * np.median(steps):
        where = samples.lines[tap][1 + int(np.argmax(steps))]
        notes.append(
            f"a gap in the tap before line {where}, {steps.max():.3g} s (the median step is "
            f"{np.median(steps):.3g} s), bridged by a straight line"
        )
    if steps.size <= FEW:
        count = f"{steps.size - 1} sample{'s' * (steps.size > 2)}"
        notes.append(f"the tap has {count}, its peak lies between two of them")
    return notes
