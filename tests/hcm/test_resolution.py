"""Taps that the steps do not resolve, or an end time cuts, say so."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import pade

import hcm
from hcm.estimates.resolution import (
    CAUTION_ERROR,
    LARGEST_TIME_ERROR,
    collocation_error,
    judge_steps,
    over_phase,
    second_difference,
)
from hcm.taps.summary import vertex
from tests.hcm.cases import HARD, HARD_TIP, SOFT, SOFT_TIP, SURFACE, TRUTH, finger


def tap(phalanx: hcm.Phalanx, tip: hcm.Tip, **settings: float) -> hcm.TapResult:
    wanted = hcm.Settings(estimate=False, **settings)  # type: ignore[arg-type]
    return hcm.simulate(finger(phalanx), SURFACE, tip, settings=wanted)


@pytest.mark.parametrize("steps", [3, 10, 100])
def test_second_difference_of_a_half_sine(steps: int) -> None:
    """4 sin^2(omega h/2), also where events repeat rows; steps that shrink add nothing."""
    time = np.repeat(np.linspace(0.0, 1.0, steps + 1), 2)
    force = np.sin(np.pi * time)
    exact = 4.0 * np.sin(np.pi / steps / 2) ** 2
    shape = force.max()
    found = second_difference(time, force, 0, time.size)
    assert found == pytest.approx(exact * np.max(force[2:-2]) / shape, rel=1e-9)
    finer = np.sort(np.concatenate([np.linspace(0.0, 1.0, steps + 1), [0.5 / steps, 1 - 1e-9]]))
    assert second_difference(finer, np.sin(np.pi * finer), 0, finer.size) < 1.3 * found


def test_a_jump_within_a_short_step_is_a_jump() -> None:
    """Restitution begins 1 % lower, within a step of a nanosecond: 4 % of the peak, not 1e6."""
    time = np.sort(np.concatenate([np.linspace(0.0, 1.0, 41), [0.5 + 1e-9]]))
    force = np.where(time <= 0.5, 1.0, 0.99) * np.sin(np.pi * time)
    assert second_difference(time, force, 0, time.size) == pytest.approx(2 * 2 * 0.01, rel=0.01)


def test_two_rows_resolve_nothing() -> None:
    assert second_difference(np.array([0.0, 1.0]), np.array([0.0, 1.0]), 0, 2) == np.inf
    assert second_difference(np.arange(3.0), np.zeros(3), 0, 3) == np.inf


@pytest.mark.parametrize("stages", [1, 2, 3])
def test_collocation_is_out_of_phase_as_pades_approximant(stages: int) -> None:
    """Of e^z at i omega h (Hairer and Wanner 1996, section IV.3); the next term is 0.04 of it."""
    above, below = pade([1 / math.factorial(n) for n in range(2 * stages + 1)], stages)
    turn = 0.5
    late = abs(np.angle(above(1j * turn) / below(1j * turn)) / turn - 1.0)
    assert late == pytest.approx(turn ** (2 * stages) / over_phase(stages), rel=0.06)
    assert collocation_error(stages, (turn / (stages + 1)) ** 2) == pytest.approx(late, rel=0.06)


def test_a_tap_in_few_long_steps_of_collocation_has_no_caution_of_their_number() -> None:
    """Its rows are stages: as steps of order 2 they would leave 1.4 % where 0.1 % is left."""
    modulus, bounce = 4.146e10, replace(SOFT_TIP, restitution=0.933)
    scene = hcm.Scene(finger(SOFT, youngs_modulus=modulus), hcm.Surface(0.09, 1.095), bounce)
    result = hcm.simulate_within(1e-2, scene)
    exact = hcm.simulate_within(1e-4, scene).summary.contact_duration_s
    assert result.summary.contact_duration_s == pytest.approx(exact, rel=2e-3)
    tap = result.history.normal_force_N.nonzero()[0]
    rows = second_difference(*_force(result), tap[0] - 1, tap[-1] + 2) / 12
    assert rows > CAUTION_ERROR
    assert not [caution for caution in result.cautions if "steps" in caution]


def _force(result: hcm.TapResult) -> tuple[np.ndarray, np.ndarray]:
    return result.history.time_s, result.history.normal_force_N


@pytest.mark.parametrize("step", [1.0, 1e-4, 2e-5, 1e-5])
def test_fixed_steps_state_the_error_that_they_leave(step: float) -> None:
    """Of the contact's duration, within a factor of two of what it is."""
    result = tap(SOFT, SOFT_TIP, contact_tolerance=0.0, contact_step=step)
    duration = result.summary.contact_duration_s
    assert duration is not None
    error = abs(duration / TRUTH["contact_duration_s"] - 1)
    first, end = result.history.time_s.searchsorted([e.time_s for e in result.events])[[0, -1]]
    stated = second_difference(
        result.history.time_s, result.history.normal_force_N, first, end + 1
    ) / 12  # fmt: skip
    assert 0.5 < stated / error < 2.0
    status = hcm.Status.UNRESOLVED if stated > LARGEST_TIME_ERROR else hcm.Status.COMPLETED
    assert result.status is status
    assert ("contact_step" in result.status.advice) == (stated > LARGEST_TIME_ERROR)
    assert bool(result.cautions) == (CAUTION_ERROR < stated <= LARGEST_TIME_ERROR)


def test_a_tap_of_four_steps_carries_a_caution() -> None:
    result = tap(HARD, HARD_TIP, contact_tolerance=0.0, contact_step=2e-5)
    assert result.status is hcm.Status.COMPLETED
    (caution,) = result.cautions
    assert "4 steps" in caution
    assert "reduce solver.hcm.contact_step" in caution


@pytest.mark.parametrize(("restitution", "counts"), [(0.01, True), (0.1, False), (1.0, False)])
def test_transitions_that_are_not_resolved_say_so(restitution: float, counts: bool) -> None:
    """At e* = 0.01 each tighter tolerance finds more of them, at 0.1 none does."""
    result = tap(HARD, replace(HARD_TIP, restitution=restitution))
    assert result.status is hcm.Status.COMPLETED
    found = result.summary.compression_to_restitution
    words = f"transitions are not resolved (compression_to_restitution {found}, "
    assert [caution.startswith(words) for caution in result.cautions] == [True] * counts


@pytest.mark.parametrize("stages", [2, 3, 5])
def test_collocation_takes_a_phase_in_one_step(stages: int) -> None:
    """(s!)^2/((2s)! (2s + 1)!) pi^(2s) of half a swing: 0.14, 0.0095, 1e-5."""
    f = math.factorial
    error = f(stages) ** 2 / (f(2 * stages) * f(2 * stages + 1)) * math.pi ** (2 * stages)
    result = tap(
        HARD, replace(HARD_TIP, restitution=0.01), contact_integrator="gauss", stages=stages,
        contact_step=3e-6, contact_tolerance=0.0,
    )  # fmt: skip
    assert result.status is hcm.Status.COMPLETED
    assert result.summary.compression_to_restitution > 1
    told = any("transitions are not resolved" in caution for caution in result.cautions)
    assert told == (error > CAUTION_ERROR)


@pytest.mark.parametrize(("end_time", "whole"), [(0.13612, False), (0.1362, True)])
def test_an_end_time_that_cuts_the_first_tap_completes_nothing(
    end_time: float, whole: bool
) -> None:
    result = tap(HARD, HARD_TIP, end_time=end_time)
    assert (result.status is hcm.Status.COMPLETED) == whole
    if not whole:
        assert result.status is hcm.Status.STILL_IN_CONTACT
        assert "end_time cuts the first tap" in result.message
        assert "solver.hcm.end_time" in result.status.advice


def test_vertex_of_uneven_rows_is_the_parabolas() -> None:
    time = np.array([0.0, 0.2, 0.4, 0.9, 1.0])
    force = 5.0 - 3.0 * (time - 0.37) ** 2
    assert vertex(time, force, 0, 5, 2) == pytest.approx((0.37, 5.0), rel=1e-12)


@pytest.mark.parametrize(
    ("steps", "status", "cautions"),
    [(10, "COMPLETED", 0), (8, "COMPLETED", 1), (3, "COMPLETED", 1), (2, "UNRESOLVED", 0)],
)
def test_the_steps_of_a_half_sine_are_judged(steps: int, status: str, cautions: int) -> None:
    """By 4 sin^2(pi/2n)/12: 0.0082, 0.013, 0.083 and 0.17 of the peak."""
    time = np.linspace(0.0, 1.0, steps + 1)
    history = SimpleNamespace(time_s=time, normal_force_N=np.sin(np.pi * time))
    summary = SimpleNamespace(contact_time_s=0.0, contact_duration_s=1.0)
    found = judge_steps(history, (), summary, hcm.Settings())
    assert (found[0].name, len(found[2])) == (status, cautions)


def half_sine_in(steps: int, kinds: tuple[str, ...], **settings: float) -> tuple[str, ...]:
    """Cautions of a tap from 0 to 1 s, with these events a step apart in its middle."""
    time = np.linspace(0.0, 1.0, steps + 1)
    history = SimpleNamespace(time_s=time, normal_force_N=np.sin(np.pi * time))
    events = [hcm.Event(time[steps // 2 + n], kind) for n, kind in enumerate(kinds)]
    summary = SimpleNamespace(contact_time_s=0.0, contact_duration_s=1.0)
    return judge_steps(history, tuple(events), summary, hcm.Settings(**settings))[2]


@pytest.mark.parametrize(
    "kinds",
    [
        ("stick_to_slip", "slip_to_stick"),
        ("compression_to_restitution", "restitution_to_compression"),
    ],
)
def test_changes_within_a_step_of_each_other_are_not_resolved(kinds: tuple[str, ...]) -> None:
    """Of friction as of the force; each alone, or one of both sorts, is no phase."""
    (said,) = half_sine_in(100, kinds)
    assert f"({kinds[0]} 1, {kinds[1]} 1): 1 of them" in said
    assert half_sine_in(100, kinds[:1]) == ()
    assert half_sine_in(100, ("stick_to_slip", "compression_to_restitution")) == ()


def test_what_follows_the_first_tap_has_no_part_in_its_transitions() -> None:
    """Two changes a step apart, of a second tap."""
    time = np.linspace(0.0, 2.0, 201)
    history = SimpleNamespace(time_s=time, normal_force_N=np.abs(np.sin(np.pi * time)))
    kinds = ("stick_to_slip", "slip_to_stick")
    events = tuple(hcm.Event(float(time[150 + n]), kind) for n, kind in enumerate(kinds))
    summary = SimpleNamespace(contact_time_s=0.0, contact_duration_s=1.0)
    found = judge_steps(history, events, summary, hcm.Settings())
    assert (found[0], found[2]) == (hcm.Status.COMPLETED, ())


@pytest.mark.parametrize(("tolerance", "key"), [(0.0, "step"), (1e-9, "tolerance")])
def test_the_remedy_is_what_controls_the_steps(tolerance: float, key: str) -> None:
    """A tap of five steps is 3 % off: smaller ones, or a smaller tolerance where there is one."""
    (said,) = half_sine_in(5, (), contact_tolerance=tolerance)
    assert said.endswith(f"reduce solver.hcm.contact_{key}")
