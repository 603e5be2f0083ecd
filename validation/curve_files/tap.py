"""Samples checked as a tap, and what was done to them in lines."""

import numpy as np

from validation.curve_files.samples import Floats, Samples
from validation.curve_files.sidecar import Sidecar
from validation.errors import UserError
from validation.models.curves import Curves, other_than_stated, tap_scalars

COARSE = 10.0  # an interval over the tap's median one that is worth a line
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
        raise UserError(
            f"{origin}, line {line[lowest]}: normal force {-pull:.4g} N, and a contact can't pull; "
            f"state in {beside} the right normal (it is {sidecar.normal}) or, for scatter about "
            f"zero, the force up to which nothing touches, threshold_N = {1.5 * pull / body:.2g}"
        )
    edges = np.diff(touches.astype(int))
    starts, ends = np.flatnonzero(edges == 1) + 1, np.flatnonzero(edges == -1) + 1
    if touches[0] or not ends.size:
        how = f"begins in contact, {normal[0]:.4g} N" if touches[0] else "ends in contact"
        how = how if touches.any() else f"has no normal force above {least:g} N"
        raise UserError(
            f"{origin}: {how}; give a longer record, take an offset of the zero line off, or state "
            f"in {beside} the right normal (it is {sidecar.normal}) and threshold_N"
        )
    tap = slice(int(starts[0]) - 1, int(ends[0]) + 1)
    contact = {name: np.where(touches, force, 0.0) for name, force in forces.items()}
    tangential, sigma = contact.get("tangential_force"), forces.get("normal_force_sigma")
    notes = [*filter(None, [sidecar.source]), *samples.notes, _of_the_whole(sidecar, beside)]
    idle = ~touches & np.any([forces[name] != 0.0 for name in axes if name in forces], axis=0)
    if idle.any():
        notes.append(
            f"{idle.sum()} samples of up to {least:g} N count as no contact, without force"
        )
    if (touch := time[tap][0]) <= 0.0:
        notes.append(
            f"the tap begins at {touch:.4g} s and the motion at 0 s, so its arrival says nothing; "
            f"state when the motion starts in {beside}: time_offset_s"
        )
    if tangential is None:
        notes.append("no tangential force: it is not compared")
    if starts.size > 1:
        notes.append(
            f"touches {starts.size} times; the first tap is compared, of {normal[tap].max():.4g} N "
            f"where the largest has {normal.max():.4g} N (if some are scatter, raise threshold_N)"
        )
    steps = np.diff(time[tap])
    if steps.max() > COARSE * np.median(steps):
        where = line[tap][1 + int(np.argmax(steps))]
        notes.append(
            f"before line {where} a gap in the tap, {steps.max():.3g} s where the median step is "
            f"{np.median(steps):.3g} s, bridged by a straight line"
        )
    if steps.size <= FEW:
        notes.append(f"the tap has {steps.size - 1} samples, its peak lies between two of them")
    errors = {}
    if sigma is not None:
        errors = _errors(time[tap], contact["normal_force"][tap], sigma[tap], least)
    if tangential is not None and (deviation := forces.get("tangential_force_sigma")) is not None:
        most = int(np.argmax(np.abs(tangential[tap])))
        errors["peak_tangential_force_N"] = float(deviation[tap][most])
    if touch <= 0.0 and errors:
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


def _of_the_whole(sidecar: Sidecar, beside: str) -> str:
    """What holds for all samples."""
    body = "doubled, as half a body's" if sidecar.half_model else "taken as the whole body's"
    since = f"less {sidecar.time_offset_s:g} s" if sidecar.time_offset_s else "as since the start"
    unsaid = [key for key in ("half_model", "time_offset_s") if key not in sidecar.model_fields_set]
    remedy = f" (else {beside}: {', '.join(unsaid)})" if unsaid else ""
    return f"forces {body}, times {since}{remedy}"


def _errors(time: Floats, normal: Floats, sigma: Floats, least: float) -> dict[str, float]:
    """What one standard deviation means for the numbers of a tap, correlated all along it.

    - peak: sigma there, and what n samples of a half sine may miss of it, 1/cos(pi/2/n) - 1; its
      time: how far away the force is as high within sigma
    - impulse: the integral of sigma, and the trapezoid's (pi/n)^2/12
    - start, end: how long the force is no more than sigma and the threshold (for a linear rise,
      sigma over the slope)
    """
    top, seen = int(np.argmax(normal)), np.flatnonzero(normal > least + sigma)
    ends = (time[seen[0]] - time[0], time[-1] - time[seen[-1]]) if seen.size else (np.inf, np.inf)
    high = np.abs(time[normal + sigma >= normal[top]] - time[top]).max()
    samples = time.size - 2
    missed = (1.0 / np.cos(0.5 * np.pi / max(samples, 2)) - 1.0) * normal[top]
    rule = (np.pi / samples) ** 2 / 12.0 * np.trapezoid(normal, time)
    return {
        "contact_time_s": float(ends[0]),
        "contact_duration_s": float(sum(ends)),
        "peak_normal_force_N": float(np.hypot(sigma[top], missed)),
        "peak_normal_force_time_s": float(high + ends[0]),
        "normal_impulse_N_s": float(np.hypot(np.trapezoid(sigma, time), rule)),
    }
