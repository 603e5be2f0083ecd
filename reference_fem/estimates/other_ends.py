"""Other possible ends of a first tap, where the rule that parts taps (`tap.tap_after`) is close.

- *Sooner*: with forces below `FAINT` of the largest so far taken as zero, and both times of the
  rule divided by `NEARLY`, the tap ends earlier; in its last faint stretch only the time without
  contact is compared (a Hertzian tap, F_n ~ (T - t)^3/2, is so faint for 1.6 % of T).
- *Later*: with both times multiplied by `NEARLY` the next touch would still belong to the tap.
"""

import numpy as np

from reference_fem.dynamics.tap import parting_s
from reference_fem.estimates.mesh_error import STIFFNESS_EXPONENTS
from reference_fem.model import Model
from reference_fem.results.result import TapResult
from reference_fem.results.summary import summarize

LATER = (
    "the tip returns so soon that the next touch may belong to the first tap: run on through it "
    "(solver.fem.end_time) and look at the forces"
)
# One next touch was predicted a quarter too late, from a contact that was a third too short.
NEARLY = 2.0
# Share of the largest force so far that a default mesh's error may amount to.
FAINT = 0.01


def other_ends(run: TapResult, model: Model) -> tuple[dict[str, float], tuple[str, ...]]:
    """Errors of a completed run's numbers by other possible ends of its first tap, and cautions.

    Both are empty where there is no doubt. The next touch, taken to be as strong and as long, is
    timed by the record or by the rigid motion of the last phalanx.
    """
    start, lasts = run.summary.contact_time_s, run.summary.contact_duration_s
    if start is None or lasts is None:
        return {}, ()
    errors, doubts, forces = dict.fromkeys(STIFFNESS_EXPONENTS, 0.0), [], run.forces
    sooner = nearly_over_s(run, model, start, start + lasts)
    if sooner is not None:
        # friction 0: stick and slip are not among the numbers with an error
        part = summarize(forces, run.history, 0.0, None, sooner, run.summary)
        for name in STIFFNESS_EXPONENTS:
            errors[name] = abs(_number(run.summary, name) - _number(part, name))
        doubts.append(
            f"contact nearly ceases for a while after {1e6 * (sooner - start):.4g} us: the first "
            f"tap may end then or, as here, after {1e6 * lasts:.4g} us; look at the forces"
        )
    later = (forces.time_s > start + lasts + 0.5 * run.summary.time_step_s) & (
        forces.normal_force_N > 0.0
    )
    wait = float((run.history.time_s + run.history.next_touch_s)[-1]) - start - lasts
    if later.any():
        wait = float(forces.time_s[later][0]) - start - lasts
    if wait <= NEARLY * parting_s(model, lasts)[1]:
        for name, exponent in STIFFNESS_EXPONENTS.items():
            more = wait + lasts if exponent > 0.0 else abs(_number(run.summary, name))
            errors[name] = max(errors[name], more)
        doubts.append(LATER)
    return errors, tuple(doubts)


def nearly_over_s(run: TapResult, model: Model, start: float, end: float) -> float | None:
    """Last contact before a tap was nearly over for the first time, s; None: it never was.

    At later times of this kind the numbers differ less.
    """
    forces, samples = run.forces, run.history
    high = np.maximum.accumulate(forces.normal_force_N)
    pressed = np.where(forces.normal_force_N > FAINT * high, forces.time_s, start)
    at = (samples.time_s > start) & (samples.time_s < end)
    rows = np.searchsorted(forces.time_s, samples.time_s[at])
    last = np.maximum.accumulate(pressed)[rows]
    wait, soon = parting_s(model, last - start)
    at_its_end = last == last.max(initial=start)
    parts = at_its_end | (NEARLY * samples.next_touch_s[at] > soon)
    nearly = (NEARLY * (samples.time_s[at] - last) > wait) & parts
    return float(last[nearly][0]) if nearly.any() else None


def _number(summary: object, name: str) -> float:
    return float(getattr(summary, name) or 0.0)
