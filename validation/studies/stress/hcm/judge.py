"""Judging a cell of the reduced model: a run, checked independently of the solver."""

from collections.abc import Callable
from dataclasses import replace

import hcm
from hcm import reference_solution
from hcm.results.posture import Postures
from validation.studies.stated_errors import true_errors
from validation.studies.stress.hcm.audit import observed
from validation.studies.stress.hcm.checks import violations
from validation.studies.stress.judging import SMALLER_STEP, largest_difference
from validation.studies.stress.stability_map import Answer, CellVerdict

# Takes the verdict so far on a completed run that breaks no law; returns it after another check.
Check = Callable[[CellVerdict, hcm.Scene, hcm.TapResult], CellVerdict]
# Factors of steps and tolerances of the runs that confirm, in the order in which they are tried.
TIGHTER = ((5.0, 100.0), (2.0, 8.0))
# Of DOP853: the tap need only be known far better than `RIGHT_WITHIN`, and one that lasts longer
# differs anyway.
RTOL, ATOL, LONGEST_S = 1e-7, 1e-11, 0.01


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
        estimate=False,
    )


def confirm(found: CellVerdict, scene: hcm.Scene, result: hcm.TapResult) -> CellVerdict:
    """The verdict on a completed run, by a run with smaller steps and tolerances.

    If a tighter run exceeds the work allowed, a less tight one is tried; if none completes, the run
    counts as wrong: what can't be confirmed is not right.
    """
    failed = "no tighter run completes"
    for steps, tolerances in TIGHTER:
        settings = tighter(scene.settings, steps, tolerances)
        truth = hcm.simulate_scene(replace(scene, settings=settings))
        name = f"a run with {tolerances:g} times smaller tolerances"
        if truth.status is hcm.Status.COMPLETED:
            numbers = true_errors(vars(result.summary), result.errors, vars(truth.summary))
            return found.within_stated(name, numbers, bool(result.cautions))
        if truth.status is not hcm.Status.WORK_LIMIT:
            failed = f"{name}: {truth.status.value}"
            break
    return replace(found, error=float("inf")).judged(Answer.WRONG, failed)


def examine(scene: hcm.Scene, *checks: Check) -> CellVerdict:
    """Run a scene and check its invariants; if it completed and broke none, apply `checks`."""
    run = observed(scene)
    try:
        result = hcm.simulate_scene(run)
    except hcm.ParameterError as refusal:
        return CellVerdict(Answer.REFUSED, str(refusal))
    s = result.statistics
    found = CellVerdict(
        Answer.RIGHT, "", "mechanics of its states, contact law", None,
        result.summary.energy_residual, s.steps, s.wall_time_s,
    )  # fmt: skip
    broken = violations(run, result)
    if broken:
        return found.judged(Answer.WRONG, "; ".join(broken))
    if result.status is not hcm.Status.COMPLETED:
        flags = (hcm.Status.UNREPEATABLE, hcm.Status.TOO_FLEXIBLE, hcm.Status.UNRESOLVED)
        answer = Answer.FLAGGED if result.status in flags else Answer.STOPPED
        return found.judged(answer, result.message)
    for check in checks:
        found = check(found, scene, result)
    return found


def with_step(found: CellVerdict, scene: hcm.Scene, result: hcm.TapResult) -> CellVerdict:
    """The verdict; SMALLER if it is right and the contact steps are far smaller than asked."""
    rows = int((result.history.mode // 3 > 0).sum())
    step = (result.summary.contact_duration_s or 0.0) / max(rows, 1)
    if found.answer == Answer.RIGHT and 0 < step < SMALLER_STEP * scene.settings.contact_step:
        return found.judged(Answer.SMALLER, f"contact steps of {step:.2g} s")
    return found


def judge_by_tighter_run(scene: hcm.Scene) -> CellVerdict:
    """Run a scene and a tighter one beside it; say what the answer is worth.

    A run is right if it breaks no law of mechanics or contact (`violations`) and differs from the
    tighter run, on the same elements, by no more than its stated errors.
    """
    return examine(scene, confirm, with_step)


def judge_by_laws(scene: hcm.Scene) -> CellVerdict:
    """Run a scene and check its invariants, without a second run."""
    return examine(scene, with_step)


def judge_by_dop853(scene: hcm.Scene) -> CellVerdict:
    """Judge a run by the laws, and its peak F_n, impulse and duration by SciPy's DOP853.

    That solves from the same state at contact (`hcm.reference_solution`) and shares the beams'
    forces with hcm, but neither the time integration, nor Newton's method, nor the hinges'
    multipliers, nor the search for events.
    """
    return examine(scene, _by_dop853, with_step)


def _by_dop853(found: CellVerdict, scene: hcm.Scene, result: hcm.TapResult) -> CellVerdict:
    kept = result.event_postures
    assert isinstance(kept, Postures)
    assert kept.v is not None
    start = reference_solution.ChainStart(kept.q[0], kept.v[0], kept.times_s[0])
    try:
        other = reference_solution.solve(
            scene.finger, scene.surface, scene.tip, scene.drive, RTOL, ATOL, start,
            end_time=start.time_s + LONGEST_S,
        )  # fmt: skip
    except RuntimeError as failure:
        return found.judged(Answer.WRONG, f"DOP853: {failure}")
    s = result.summary
    assert s.peak_normal_force_N
    assert s.normal_impulse_N_s
    assert s.contact_duration_s
    error = largest_difference(
        (s.peak_normal_force_N, s.normal_impulse_N_s, s.contact_duration_s),
        (other.peak_normal_force_N, other.normal_impulse_N_s, other.end.time_s - start.time_s),
    )
    return found.compared("DOP853 with event handling from the state at contact", error)
