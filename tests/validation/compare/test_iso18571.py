"""The rating against its definition, and against another implementation of the standard."""

import numpy as np
import pytest

from tests.validation.commands import Make
from validation.compare.iso18571 import Rating, iso18571, rate_forces

TIME = np.linspace(0.0, 1.0, 301)
PULSE = np.sin(np.pi * np.clip((TIME - 0.2) / 0.6, 0, 1)) ** 2


def test_identical_curves_are_rated_one() -> None:
    rating = iso18571(PULSE, PULSE)
    assert rating == (1.0, 1.0, 1.0, 1.0)
    assert rating.overall == pytest.approx(1.0, abs=1e-15)
    assert rating.grade == "excellent"


def test_a_shift_costs_its_share_of_the_allowed_one_and_no_magnitude() -> None:
    shift = 15  # of 301 samples, 60.2 allowed
    rating = iso18571(np.roll(PULSE, shift), PULSE)
    assert rating.phase == pytest.approx(1 - 15 / (0.2 * 301), rel=1e-12)
    assert rating.magnitude == pytest.approx(1.0, abs=1e-12)
    assert rating.slope == pytest.approx(1.0, abs=1e-12)
    assert iso18571(np.roll(PULSE, -shift), PULSE).phase == rating.phase


def test_a_factor_costs_slope_in_proportion_and_no_phase() -> None:
    rating = iso18571(1.2 * PULSE, PULSE)
    assert rating.phase == 1.0
    assert rating.slope == pytest.approx(1 - 0.2 / 2, rel=1e-12)
    # Warping can only shorten the distance of 0.2.
    assert 1 - 0.2 / 0.5 <= rating.magnitude < 1.0


def test_the_corridor_follows_its_definition() -> None:
    # Everywhere 0.275 of the largest value apart: half way between the corridors.
    rating = iso18571(PULSE + 0.275, PULSE)
    assert rating.corridor == pytest.approx(0.25, rel=1e-12)
    assert iso18571(PULSE + 0.6, PULSE).corridor == 0.0
    assert iso18571(PULSE + 0.049, PULSE).corridor == 1.0


@pytest.mark.parametrize("seed", range(6))
def test_agrees_with_another_implementation(seed: int) -> None:
    oracle = pytest.importorskip("objective_rating_metrics.rating")
    random = np.random.default_rng(seed)
    start, length, height = random.uniform((0.05, 0.5, 0.7), (0.3, 0.7, 1.3))
    curve = height * np.sin(np.pi * np.clip((TIME - start) / length, 0, 1))
    curve = curve + 0.05 * np.sin(random.uniform(5, 40) * TIME + seed)
    ours = iso18571(curve, PULSE)
    theirs = oracle.ISO18571(np.stack([TIME, PULSE], 1), np.stack([TIME, curve], 1))
    assert ours.corridor == pytest.approx(theirs.corridor_rating(-1), abs=1e-12)
    assert ours.phase == pytest.approx(theirs.phase_rating(-1), abs=1e-12)
    assert ours.magnitude == pytest.approx(theirs.magnitude_rating(-1), abs=1e-9)
    assert ours.slope == pytest.approx(theirs.slope_rating(-1), abs=1e-12)
    assert ours.overall == pytest.approx(theirs.overall_rating(-1), abs=1e-9)


@pytest.mark.parametrize("bad", [np.ones(301), PULSE[:-1], np.where(TIME > 0.5, np.nan, PULSE)])
def test_curves_without_a_rating_are_refused(bad: np.ndarray) -> None:
    with pytest.raises(ValueError, match="ISO 18571"):
        iso18571(bad, PULSE)


def test_forces_are_aligned_at_contact(make_record: Make) -> None:
    rating = rate_forces(make_record(), make_record(model="fem3d"))
    assert rating.overall == pytest.approx(1.0, abs=1e-9)
    larger = rate_forces(make_record(peak=70.0), make_record(model="fem3d", peak=64.0))
    # Error of the slope 70/64 - 1 of 2 allowed.
    assert larger.slope == pytest.approx(1 - (70 / 64 - 1) / 2, abs=1e-3)
    assert rate_forces(make_record(), make_record(summary={})) is None


@pytest.mark.parametrize(
    ("score", "grade"),
    [(0.95, "excellent"), (0.93, "good"), (0.81, "good"), (0.79, "fair"), (0.59, "fair"),
     (0.57, "poor")],
)  # fmt: skip
def test_grades_are_the_standards(score: float, grade: str) -> None:
    assert Rating(score, score, score, score).grade == grade
