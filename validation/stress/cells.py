"""One cell of a stability map: a scene, run, checked by what did not produce it, and judged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import hcm
from validation.stress.audit import LARGEST_ERROR, observed
from validation.stress.checks import violations
from validation.stress.frame import FLAGGED, REFUSED, RIGHT, SMALLER, STOPPED, WRONG, Verdict
from validation.stress.random_scenes import HcmScene

# A run whose mean contact step is this share of what was asked has chosen its own.
CHOSEN = 0.5
# Change of the drive that no measurement would notice, and what it changes in a chaotic motion: an
# error that grows ten thousandfold leaves no number that a smaller step could confirm.
NUDGE, CHAOTIC = 1e-6, 0.01
# Share of the impulse after which a tap counts as over: a tip that lingers at zero force decides on
# its separation by round-off, and no other number depends on when.
DELIVERED = 0.99


def nudged(scene: HcmScene) -> HcmScene:
    """The scene with torques and gravity changed by the share `NUDGE`.

    Neighbouring torques in opposite directions: alike, they would only change the motion's time.
    """
    drive = scene.drive
    torques = tuple((1 + NUDGE * (-1) ** w) * torque for w, torque in enumerate(drive.torques))
    return replace(
        scene, drive=replace(drive, torques=torques, gravity=(1 + NUDGE) * drive.gravity)
    )


def tighter(settings: hcm.Settings) -> hcm.Settings:
    """Steps a fifth as long, tolerances a hundredth."""
    return replace(
        settings,
        flight_step=settings.flight_step / 5,
        contact_step=settings.contact_step / 5,
        flight_tolerance=settings.flight_tolerance / 100,
        contact_tolerance=settings.contact_tolerance / 100,
        newton_tolerance=max(settings.newton_tolerance / 100, 1e-12),
        max_steps=20 * settings.max_steps,
    )


def tap_scalars(result: hcm.TapResult) -> tuple[float, float, float] | None:
    """Peak F_n (N), impulse (N s) and time to deliver `DELIVERED` of it (s) of the first tap."""
    s, h = result.summary, result.history
    if s.contact_time_s is None or not s.normal_impulse_N_s or s.contact_duration_s is None:
        return None
    end = s.contact_time_s + s.contact_duration_s
    rows = (h.time_s >= s.contact_time_s) & (h.time_s <= end)
    time, force = h.time_s[rows], h.normal_force_N[rows]
    impulse = np.append(0.0, np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(time)))
    delivered = float(np.interp(DELIVERED * impulse[-1], impulse, time)) - s.contact_time_s
    return float(s.peak_normal_force_N or 0.0), float(s.normal_impulse_N_s), delivered


def difference(result: hcm.TapResult, truth: hcm.TapResult) -> float | None:
    """Largest relative change of the first tap's scalars, None where there is no tap to compare."""
    own, other = tap_scalars(result), tap_scalars(truth)
    if own is None or other is None:
        return None
    return max(abs(a / b - 1) for a, b in zip(own, other, strict=True))


def _mean_contact_step(result: hcm.TapResult) -> float:
    rows = int((result.history.mode // 3 > 0).sum())
    return (result.summary.contact_duration_s or 0.0) / max(rows, 1)


def judge(scene: HcmScene) -> Verdict:
    """Run a scene and a tighter one beside it; say what the answer is worth.

    A result that differs from the tighter run by more than `LARGEST_ERROR` is wrong, unless a drive
    changed by `NUDGE` changes it too: then the motion is chaotic, and the cell is flagged.
    """
    return _judge(scene, compare=True)


def judge_alone(scene: HcmScene) -> Verdict:
    """Run a scene and check its invariants, without a second run."""
    return _judge(scene, compare=False)


def _judge(scene: HcmScene, compare: bool) -> Verdict:
    try:
        result = hcm.simulate(**observed(scene).arguments())
    except hcm.ParameterError as refusal:
        return Verdict(REFUSED, str(refusal))
    s = result.statistics
    found = Verdict(
        RIGHT, "", "mechanics of its states, contact law", None,
        result.summary.energy_residual, s.steps, s.wall_time_s,
    )  # fmt: skip
    broken = violations(observed(scene), result)
    if broken:
        return replace(found, answer=WRONG, reason="; ".join(broken))
    if result.status is not hcm.Status.COMPLETED:
        return replace(found, answer=STOPPED, reason=result.message)
    if compare:
        settings = tighter(scene.settings)
        truth = hcm.simulate(**replace(scene, settings=settings).arguments())
        error = difference(result, truth) if truth.status is hcm.Status.COMPLETED else None
        found = replace(found, error=error)
        if error is None or error > LARGEST_ERROR:
            spread = difference(result, hcm.simulate(**nudged(scene).arguments()))
            lost = spread is None and tap_scalars(result) is not None
            if lost or (spread is not None and spread > CHAOTIC):
                change = "the tap is lost" if spread is None else f"it changes by {spread:.2g}"
                return replace(
                    found, answer=FLAGGED, reason=f"drive changed by {NUDGE:g}: {change}"
                )
        if error is not None:
            found = replace(found, checked_by=f"{found.checked_by}, a tighter run")
            if error > LARGEST_ERROR:
                return replace(found, answer=WRONG, reason="differs from a tighter run")
    step = _mean_contact_step(result)
    if 0 < step < CHOSEN * scene.settings.contact_step:
        return replace(found, answer=SMALLER, reason=f"contact steps of {step:.2g} s")
    return found
