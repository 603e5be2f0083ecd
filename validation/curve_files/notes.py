"""What was done to a file's samples or taken for granted, in lines with what to do about it."""

from collections.abc import Set

import numpy as np

from validation.curve_files.contract import Samples, Sidecar
from validation.curve_files.sample_errors import ZeroLine, excess, held, lone_peak
from validation.curve_files.tap import AXES, SampledTap
from validation.harness.record import Floats

COARSE = 10.0  # an interval over the tap's median one that is worth a line
FEW = 20  # samples of a tap that is said to have few: its peak is then known to 0.3 %
LONE = 0.05  # of the peak, by which one sample above its neighbours is worth a line
RAISED = 0.01  # of the peak, what scatter may raise it by that is worth a line


def notes_of(
    samples: Samples, tap: SampledTap, known: Set[str], beside: str, sidecar: Sidecar
) -> list[str]:
    """A line for each thing that was done to the samples.

    known : keys of the numbers whose errors are known from the samples. beside : the sidecar.
    """
    notes = [*filter(None, [sidecar.source]), *samples.notes, _of_the_whole(sidecar, beside)]
    notes += _idle(tap)
    if tap.hidden > 0.0:
        notes.append(
            f"threshold_N = {sidecar.threshold_N:g} hides how the tap begins: curves over time are"
            " aligned where it is passed, and their differences include that delay"
        )
    if "tangential_force" not in tap.forces:
        stated_peak = "peak_tangential_force_N" in sidecar.scalars.model_fields_set
        but = "only its stated peak" if stated_peak else "it"
        notes.append(f"no tangential force: {but} is {'not ' * (not stated_peak)}compared")
    notes += _of_several(tap)
    contact = tap.contact
    for name, line in tap.zero_lines.items():
        by_samples = AXES[name][0] in known - sidecar.uncertainty.model_fields_set
        size, included = np.abs(contact[name][tap.first]), "; errors include it" * by_samples
        found = _quality(size, line, tap.body, included)
        notes += [note if name == "normal_force" else f"{name}: {note}" for note in found]
    return notes + _intervals(samples, tap.time, tap.first)


def unknown_start(tap: SampledTap, sidecar: Sidecar, beside: str) -> str:
    """A line if nothing tells the tap's arrival from the start of the motion, else nothing."""
    begins, arrives = tap.time[0], tap.time[tap.first][0]
    from_trigger = begins < 0.0 and "time_offset_s" not in sidecar.model_fields_set
    known = arrives > 0.0 and not from_trigger
    if known or "contact_time_s" in sidecar.scalars.model_fields_set:
        return ""
    what, at = ("record", begins) if from_trigger else ("tap", arrives)
    return (
        f"the {what} begins at {at:.4g} s and the motion at 0 s, so its arrival means "
        f"nothing; state when the motion starts in {beside}: time_offset_s"
    )


def saturation(name: str, force: Floats, body: float, beside: str) -> str:
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


def _of_the_whole(sidecar: Sidecar, beside: str) -> str:
    """What holds for all samples."""
    body = "doubled from half a body's" if sidecar.half_model else "taken as the whole body's"
    since = f"less {sidecar.time_offset_s:g} s" if sidecar.time_offset_s else "from the start"
    unsaid = [key for key in ("half_model", "time_offset_s") if key not in sidecar.model_fields_set]
    remedy = f" (else {beside}: {', '.join(unsaid)})" if unsaid else ""
    return f"forces {body}, times {since}{remedy}"


def _idle(tap: SampledTap) -> list[str]:
    """A line of forces that count as no contact."""
    off = np.max([np.abs(tap.forces[name]) for name in tap.axes], axis=0)
    idle = ~tap.touches & (off > tap.round_off)
    if not idle.any():
        return []
    most = max(tap.least, float(off[idle].max())) / tap.body
    return [f"{idle.sum()} samples of up to {most:.3g} N count as no contact, without force"]


def _of_several(tap: SampledTap) -> list[str]:
    """Lines of a record that touches several times, and of a tap that does."""
    notes, normal = [], tap.forces["normal_force"]
    if tap.count > 1:
        of = f"{tap.joined} touches" if tap.joined > 1 else "one touch"
        own, largest = (f"{of.max() / tap.body:.4g} N" for of in (normal[tap.first], normal))
        notes.append(
            f"touches {tap.count} times; the first tap is compared, of {of} and {own} where the "
            f"largest has {largest} (if some are scatter, raise threshold_N)"
        )
    if tap.joined > 1:
        whole = float(tap.time[tap.first][-1] - tap.time[tap.first][0])
        notes.append(
            "models part taps by a prediction: for the same touches, if they have as many, set"
            f" solver.hcm.tap_until and solver.fem.tap_until = {whole:.2g}"
        )
    return notes


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
