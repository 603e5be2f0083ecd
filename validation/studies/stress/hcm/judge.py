"""One cell of a stability map: a scene, run, checked by what did not produce it, and judged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import hcm
from validation.studies.random_scenes import HcmScene
from validation.studies.stress.hcm.audit import observed
from validation.studies.stress.hcm.checks import violations
from validation.studies.stress.stability_map import (
    FLAGGED,
    LARGEST_ERROR,
    REFUSED,
    RIGHT,
    SMALLER,
    STOPPED,
    WRONG,
    Verdict,
)

# A run whose mean contact step is this share of what was asked has chosen its own.
CHOSEN = 0.5
# Factors of steps and tolerances of the runs that confirm, in the order in which they are tried.
TIGHTER = ((5.0, 100.0), (2.0, 8.0))
# Share of the impulse after which a tap counts as over: a tip that lingers at zero force decides on
# its separation by round-off, and no other number depends on when.
DELIVERED = 0.99


def tighter(settings: hcm.Settings, steps: float, tolerances: float) -> hcm.Settings:
    """Steps and tolerances smaller by these factors, with as many more steps allowed."""
    return replace(
        settings,
        flight_step=settings.flight_step / steps,
        contact_step=settings.contact_step / steps,
        flight_tolerance=settings.flight_tolerance / tolerances,
        contact_tolerance=settings.contact_tolerance / tolerances,
        newton_tolerance=max(settings.newton_tolerance / tolerances, 1e-12),
        max_steps=20 * settings.max_steps,
        repeat=False,
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


def confirm(scene: HcmScene, result: hcm.TapResult) -> tuple[str, float | None]:
    """What a completed run was compared with, and its largest relative difference to that.

    A tighter run that does not end in the work allowed gives way to one that is less tight; where
    none completes the difference is infinite: what can't be confirmed is not right.
    """
    for steps, tolerances in TIGHTER:
        settings = tighter(scene.settings, steps, tolerances)
        truth = hcm.simulate(**replace(scene, settings=settings).arguments())
        name = f"a run with {tolerances:g} times smaller tolerances"
        if truth.status is hcm.Status.COMPLETED:
            if tap_scalars(result) is None and tap_scalars(truth) is None:
                return name, None
            error = difference(result, truth)
            return name, float("inf") if error is None else error
        if truth.status is not hcm.Status.WORK_LIMIT:
            return f"{name}: {truth.status.value}", float("inf")
    return "no tighter run completes", float("inf")


def judge(scene: HcmScene) -> Verdict:
    """Run a scene and a tighter one beside it; say what the answer is worth.

    Right is what breaks no law of mechanics or contact (`violations`) and differs from the tighter
    run by `LARGEST_ERROR` at most, in the first tap's peak F_n, impulse and time.
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
        flagged = result.status in (hcm.Status.UNREPEATABLE, hcm.Status.TOO_FLEXIBLE)
        return replace(found, answer=FLAGGED if flagged else STOPPED, reason=result.message)
    if compare:
        name, error = confirm(scene, result)
        found = replace(found, error=error, checked_by=f"{found.checked_by}, {name}")
        if error is not None and not error <= LARGEST_ERROR:
            return replace(found, answer=WRONG, reason=f"differs by {error:.2g} from {name}")
    step = _mean_contact_step(result)
    if 0 < step < CHOSEN * scene.settings.contact_step:
        return replace(found, answer=SMALLER, reason=f"contact steps of {step:.2g} s")
    return found
