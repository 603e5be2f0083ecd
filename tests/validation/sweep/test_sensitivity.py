"""Sobol's indices against closed forms."""

import numpy as np
import pytest
from scipy.stats import qmc

from validation.sweep.sensitivity import LEAST_Q2, MOST_MISSING, sobol


def cube(number: int, size: int) -> np.ndarray:
    return qmc.Sobol(size, rng=np.random.default_rng(3)).random(number)


def test_indices_are_those_of_the_function() -> None:
    """y = a x1 + b x2 + c x1 x2 with uniform x: V1 = (a + c/2)^2/12, V2 alike, V12 = c^2/144."""
    x = cube(256, 3)
    a, b, c = 2.0, 1.0, 3.0
    # ranks make any range, and any monotone scale of it, uniform
    columns = np.column_stack([10.0 ** (4 * x[:, 0]), 5 * x[:, 1] - 2, x[:, 2]])
    found = sobol(columns, a * x[:, 0] + b * x[:, 1] + c * x[:, 0] * x[:, 1])
    assert found is not None
    parts = np.array([(a + c / 2) ** 2 / 12, (b + c / 2) ** 2 / 12, 0.0])
    both = c**2 / 144
    whole = parts.sum() + both
    # 1024 samples a Saltelli matrix: 1/sqrt(1024) of the variance
    assert found.first == pytest.approx(parts / whole, abs=0.03)
    assert found.total == pytest.approx((parts + both * np.array([1, 1, 0])) / whole, abs=0.03)
    assert found.q2 > 0.99


@pytest.mark.parametrize("share", [0.5, 0.9])
def test_levels_count_as_often_as_they_are_drawn(share: float) -> None:
    """y = x1 + x2, x1 of two levels, p and 1 - p: V1 = p (1 - p), V2 = 1/12."""
    x = cube(256, 2)
    level = (x[:, 0] > share).astype(float)
    found = sobol(np.column_stack([level, x[:, 1]]), level + x[:, 1])
    assert found is not None
    parts = np.array([share * (1 - share), 1 / 12])
    assert found.first == pytest.approx(parts / parts.sum(), abs=0.03)


def test_points_that_miss_leave_no_independent_variables() -> None:
    x = cube(256, 2)
    y = x.sum(axis=1)
    found = sobol(x, np.where(y > 1.0, np.nan, y))
    assert found is not None
    assert np.isnan([*found.first, *found.total, found.q2]).all()
    few = sobol(x, np.where(np.arange(256) < 0.9 * MOST_MISSING * 256, np.nan, y))
    assert few is not None
    assert few.first == pytest.approx([0.5, 0.5], abs=0.03)


def test_noise_has_no_indices() -> None:
    found = sobol(cube(128, 2), np.random.default_rng(0).standard_normal(128))
    assert found is not None
    assert found.q2 < LEAST_Q2
    assert np.isnan(found.first).all()


def test_a_fits_quality_has_no_unit() -> None:
    """Noise in small units is noise still, and a function in large ones as well fitted."""
    x, noise = cube(128, 2), np.random.default_rng(0).standard_normal(128)
    y = x[:, 0] + 0.1 * noise
    for values in (noise, y):
        plain, *scaled = (sobol(x, factor * values) for factor in (1.0, 1e-6, 1e6))
        assert plain is not None
        for found in scaled:
            assert found is not None
            assert found.q2 == pytest.approx(plain.q2, abs=1e-6)


def test_too_few_points_have_none() -> None:
    x = cube(16, 2)
    assert sobol(x, x[:, 0]) is None
    assert sobol(cube(64, 2), np.full(64, 3.0)) is None
    values = np.where(np.arange(64) < 60, np.nan, 1.0)
    assert sobol(cube(64, 2), values) is None


def test_points_in_one_place_are_fitted_too() -> None:
    """A grid over a variable without influence: equal ranks, equal or unequal values."""
    x = np.repeat(cube(32, 2), 2, axis=0)
    found = sobol(x, x[:, 0] + 1e-3 * np.tile([1, -1], 32))
    assert found is not None
    assert found.first[0] > 0.9


def test_a_single_variable_has_all_of_the_variance() -> None:
    x = cube(16, 1)
    found = sobol(x, np.exp(x[:, 0]))
    assert found is not None
    assert (found.first.tolist(), found.total.tolist()) == ([1.0], [1.0])
    assert found.q2 > 0.9
