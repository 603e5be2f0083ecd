"""Ends of taps of half sines, whose phalanx as a rigid body is down again at a known time."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from reference_fem.arrays import Array
from reference_fem.estimates.mesh_error import (
    DURATION,
    IMPULSE,
    PEAK,
    PEAK_TIME,
    STIFFNESS_EXPONENTS,
    STRESS,
    TANGENTIAL,
)
from reference_fem.estimates.other_ends import FAINT, other_ends
from reference_fem.results.result import ForceRecord, Summary
from reference_fem.results.summary import summarize

STEP = 1e-3
# A tap of 1 s is over once it has not been touched for 0.1 s and will not be for 2 s.
MODEL: Any = SimpleNamespace(transit_s=0.2, step_s=STEP)
TIME = np.arange(0.0, 8.0, STEP)
# times of a curve's crossing are read at steps, and sines fall and rise to 1 % within 0.003 s
READ = 0.005


def run_of(
    normal: Array, lasts: float, next_touch: float, begin: float = 0.0, ratio: Array | float = -0.5
) -> Any:
    """A run from a first touch at `begin` on, with that ratio F_t/F_n and a stress of F_n, Pa."""
    time = begin + TIME
    forces = ForceRecord(time, normal, ratio * normal, np.where(normal > 0.0, -1.0, 0.0))
    samples: Any = SimpleNamespace(
        time_s=time[::5], stress_R_Pa=normal[::5], next_touch_s=np.full(time[::5].size, next_touch)
    )
    blank = Summary(wall_time_s=0.0, steps=0, elements=0, time_step_s=STEP)
    summary = summarize(forces, samples, 0.0, None, begin + lasts, blank)
    return SimpleNamespace(forces=forces, history=samples, summary=summary)


def half_sine(start: float, size: float = 1.0) -> Array:
    since = TIME - start
    return np.where((since > 0.0) & (since < 1.0), size * np.sin(np.pi * since), 0.0)


def test_a_peak_is_not_earlier_than_the_touch() -> None:
    """An impulse acts in the step before its node is at the surface: a peak may be that one."""
    time = np.array([0.0, 1e-6, 2e-6])
    forces = ForceRecord(time, np.array([0.0, 9.0, 0.0]), np.zeros(3), np.array([2e-9, 1e-9, 1.0]))
    samples: Any = SimpleNamespace(time_s=time, stress_R_Pa=np.zeros(3))
    blank = Summary(wall_time_s=0.0, steps=0, elements=0, time_step_s=STEP)
    summary = summarize(forces, samples, 0.0, None, 2e-6, blank)
    assert summary.contact_time_s == pytest.approx(2e-6)
    assert summary.peak_normal_force_time_s == 0.0


@pytest.mark.parametrize(
    ("gap", "next_touch", "faint", "open_"),
    [
        (0.06, 1.1, 0.0, True),  # over half of 0.1 s, and half of 2 s
        (0.06, np.inf, 0.9 * FAINT, True),
        (0.04, np.inf, 0.0, False),
        (0.06, 0.9, 0.0, False),
        (0.06, np.inf, 1.1 * FAINT, False),  # what presses is no end
    ],
)
def test_a_tap_that_nearly_ended_has_the_errors_of_both_ends(
    gap: float, next_touch: float, faint: float, open_: bool
) -> None:
    """Half sines of 1 and 3 N with a gap, in which it is hardly touched."""
    between = faint * (np.abs(TIME - 1.0 - 0.5 * gap) < 0.5 * gap + 0.01)
    normal = np.maximum(half_sine(0.0) + half_sine(1.0 + gap, 3.0), between)
    run = run_of(normal, 2.0 + gap, next_touch)
    run.history.next_touch_s[-1] = np.inf
    errors, doubts = other_ends(run, MODEL)
    if not open_:
        assert doubts == ()
        assert errors == dict.fromkeys(STIFFNESS_EXPONENTS, 0.0)
        return
    assert len(doubts) == 1
    assert f"as here, after {1e6 * (2.0 + gap):.4g} us" in doubts[0]
    assert errors == {
        PEAK: pytest.approx(2.0, rel=READ),
        STRESS: pytest.approx(2.0, rel=READ),
        TANGENTIAL: pytest.approx(1.0, rel=READ),
        IMPULSE: pytest.approx(3.0 * 2.0 / np.pi, rel=READ),
        DURATION: pytest.approx(1.0 + gap, abs=READ),
        PEAK_TIME: pytest.approx(1.0 + gap, abs=READ),
    }


@pytest.mark.parametrize(("lasts", "open_"), [(0.0, False), (0.02, False), (0.05, True)])
def test_a_tap_ends_within_the_time_for_which_it_hardly_presses(lasts: float, open_: bool) -> None:
    """δ'' = -δ^3/2 from δ' = 1 on, stretched to 1 s: from 0.984 s on it presses with 1 %.

    A while of half of that, in which a body comes down at once, follows.
    """

    def leaves(_: float, y: Array) -> float:
        return float(y[0])

    leaves.terminal, leaves.direction = True, -1  # type: ignore[attr-defined]
    ball = solve_ivp(
        lambda _, y: [y[1], -(max(y[0], 0.0) ** 1.5)], (0.0, 9.0), [0.0, 1.0],
        events=leaves, rtol=1e-10, atol=1e-12, dense_output=True,
    )  # fmt: skip
    force = np.maximum(ball.sol(np.minimum(TIME, 1.0) * ball.t_events[0][0])[0], 0.0) ** 1.5
    end = 1.0 + lasts
    after = 0.5 * FAINT * force.max() * np.heaviside(end - TIME, 0.0) * (TIME > 0.9)
    run = run_of(np.maximum(force, after), end, 0.0)
    run.history.next_touch_s[-1] = np.inf
    errors, doubts = other_ends(run, MODEL)
    assert bool(doubts) == open_
    assert errors[DURATION] == pytest.approx(open_ * (0.016 + lasts), abs=STEP)


@pytest.mark.parametrize("seen", [True, False])
@pytest.mark.parametrize(("wait", "open_"), [(3.9, True), (4.1, False)])
def test_a_next_touch_within_four_durations_may_belong_to_the_tap(
    seen: bool, wait: float, open_: bool
) -> None:
    """It comes as it is foretold, or as the record has it, whatever is foretold."""
    last = float(TIME[::5][-1])
    next_touch = -1.0 if seen else 1.0 + wait - last
    run = run_of(half_sine(0.0) + seen * half_sine(1.0 + wait), 1.0, next_touch)
    errors, doubts = other_ends(run, MODEL)
    assert bool(doubts) == open_
    if open_:
        assert errors[PEAK] == 1.0
        assert errors[TANGENTIAL] == 0.5
        assert errors[IMPULSE] == pytest.approx(2.0 / np.pi, rel=READ)
        assert errors[DURATION] == pytest.approx(wait + 1.0, abs=READ)


@pytest.mark.parametrize("touches", ["nearly ended", "seen again", "foretold"])
def test_other_ends_do_not_depend_on_when_the_tip_first_touches(touches: str) -> None:
    """The same record 3 s later has the same errors, and words with the same durations."""
    gap, last = 0.06, float(TIME[::5][-1])
    normal, lasts, next_touch = {
        "nearly ended": (half_sine(0.0) + half_sine(1.0 + gap, 3.0), 2.0 + gap, 1.1),
        "seen again": (half_sine(0.0) + half_sine(4.9), 1.0, -1.0),
        "foretold": (half_sine(0.0), 1.0, 4.9 - last),
    }[touches]
    found = []
    for begin in (0.0, 3.0):
        run = run_of(normal, lasts, next_touch, begin)
        if touches == "nearly ended":
            run.history.next_touch_s[-1] = np.inf
        found.append(other_ends(run, MODEL))
    (errors, doubts), (later_errors, later_doubts) = found
    assert len(doubts) == 1
    assert later_doubts == doubts
    # rounding of 11 s
    assert later_errors == pytest.approx(errors, rel=1e-12, abs=1e-14)


def test_friction_that_turns_round_has_the_error_of_the_end_that_changes_it_most() -> None:
    """From -0.5 N to 1.5 as the tap goes on through its gap: by 2 N, more than all of it.

    A third touch, which may belong to it, may add as much as there is.
    """
    gap = 0.06
    normal = half_sine(0.0) + half_sine(1.0 + gap, 3.0) + half_sine(4.0)
    turned = 1.0 + 0.5 * gap
    run = run_of(normal, 2.0 + gap, 1.1, ratio=0.5 * np.sign(TIME - turned))
    errors, doubts = other_ends(run, MODEL)
    assert len(doubts) == 2
    assert errors[TANGENTIAL] == pytest.approx(2.0, rel=READ)
    assert errors[PEAK] == pytest.approx(3.0, rel=READ)
