"""A tap solved from the same state at contact by SciPy's DOP853 (`hcm.reference_solution`).

It shares the beams' forces with hcm, and neither the time integration, nor Newton's method, nor the
hinges' multipliers, nor the search for events.
"""

from hcm import Scene, TapResult
from hcm import reference_solution as truth
from hcm.posture import Postures
from validation.studies.stress.hcm.judge import examine, with_step
from validation.studies.stress.judging import largest_difference
from validation.studies.stress.stability_map import Answer, Verdict

# The tap need only be known far better than LARGEST_ERROR.
RTOL, ATOL = 1e-7, 1e-11
# s; a contact that lasts longer differs anyway
LONGEST_S = 0.01


def judge_by_dop853(scene: Scene) -> Verdict:
    """The verdict of the laws, and then peak F_n, impulse and duration by DOP853."""
    return examine(scene, _by_dop853, with_step)


def _by_dop853(found: Verdict, scene: Scene, result: TapResult) -> Verdict:
    kept = result.event_postures
    assert isinstance(kept, Postures)
    assert kept.v is not None
    start = truth.Start(kept.q[0], kept.v[0], kept.times_s[0])
    try:
        other = truth.solve(
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
        (other.peak_normal_force_N, other.normal_impulse_N_s, other.end.time_s - start.time_s),
        (s.peak_normal_force_N, s.normal_impulse_N_s, s.contact_duration_s),
    )
    return found.compared("DOP853 with event handling from the state at contact", error)
