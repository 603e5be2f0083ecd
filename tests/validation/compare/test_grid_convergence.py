"""The grid convergence index on sequences whose limit is known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import curve_fit

from validation.compare.grid_convergence import convergence, observed_order


@settings(deadline=None)  # the first call imports SciPy
@given(st.floats(0.6, 2.0), st.floats(1.2, 3.0), st.floats(1.2, 3.0), st.floats(0.01, 0.3))
def test_order_and_limit_of_a_power_law(p: float, r32: float, r21: float, slope: float) -> None:
    sizes = (r32 * r21, r21, 1.0)
    values = [10.0 + slope * h**p for h in sizes]
    assert observed_order(sizes, values) == pytest.approx(p, rel=1e-5)
    found = convergence(sizes, values, 2.0)
    assert found.asymptotic
    assert found.limit == pytest.approx(10.0, rel=1e-6)
    # The index is 1.25 times the true error, over the finest value; 3 times if p is not near 2.
    safety = found.uncertainty / (slope / values[-1])
    assert safety == pytest.approx(1.25 if (found.order or 0.0) >= 1.8 else 3.0, rel=1e-3)


def test_celiks_example() -> None:
    # Celik et al. 2008, table 1, first column: r_21 = 1.5, r_32 = 1.333 and 6.063, 5.972, 5.863
    # give p = 1.53, phi_ext = 6.1685 and, with the factor 1.25 for any order, a GCI of 2.2 %.
    found = convergence((2.0, 1.5, 1.0), (5.863, 5.972, 6.063), 2.0)
    assert found.order == pytest.approx(1.53, abs=0.01)
    assert found.limit == pytest.approx(6.1685, abs=2e-3)
    assert found.uncertainty == pytest.approx(0.022 * 3.0 / 1.25, abs=12e-4)


def test_wiggles_and_wrong_orders_are_not_asymptotic() -> None:
    wiggle = convergence((4.0, 2.0, 1.0), (1.0, 1.2, 1.1), 2.0)
    assert not wiggle.asymptotic
    assert wiggle.uncertainty == pytest.approx(0.2 / 1.1)
    assert "not asymptotic" in wiggle.verdict
    assert not convergence((4.0, 2.0, 1.0), (1.0, 1.1, 1.2), 2.0).asymptotic  # order 0
    # Four levels: the three before the finest must have an order too.
    values = [1.0 + h**2 for h in (0.4, 0.2, 0.1)]
    assert convergence((0.8, 0.4, 0.2, 0.1), [1.64, *values], 2.0).asymptotic
    astray = convergence((0.8, 0.4, 0.2, 0.1), [0.5, *values], 2.0)
    assert astray.fitted
    assert astray.uncertainty > 0.2  # what the coarsest value is off by


@pytest.mark.parametrize("order", [1.0, 2.0])
def test_noise_on_a_trend_leaves_an_order_and_noise_alone_none(order: float) -> None:
    sizes = [0.8 / 2 ** (0.5 * k) for k in range(6)]
    noise = [0.002 * (-1) ** k for k in range(6)]
    found = convergence(
        sizes, [5.0 + 0.1 * h**order + e for h, e in zip(sizes, noise, strict=True)], 2.0
    )
    assert found.fitted
    assert found.asymptotic
    assert found.order == pytest.approx(order, abs=0.35)
    assert "least squares" in found.verdict
    assert abs(found.limit - 5.0) < found.uncertainty * found.finest
    assert found.uncertainty < 0.01
    assert not convergence(sizes, [5.0 + e for e in noise], 2.0).asymptotic


def test_scatter_of_five_levels_bounds_what_the_finest_is_off_by() -> None:
    """97.8 % of 3,000 such ladders, and 89 % by the spread of their last three: each lies 3.7
    standard deviations of 375 ladders off the 95 % between them.
    """
    rng = np.random.default_rng(7)
    found = [
        convergence((1.0, 0.84, 0.71, 0.6, 0.5), list(10.0 + rng.normal(0.0, 0.01, 5)), 2.0)
        for _ in range(400)
    ]
    scattered = [one for one in found if not one.asymptotic]
    held = [abs(one.finest - 10.0) <= one.uncertainty * one.finest for one in scattered]
    assert len(held) >= 200
    assert sum(held) >= 0.95 * len(held)


def test_a_first_order_trend_with_a_little_noise_is_known_to_its_error_bar() -> None:
    """Orders up to 3 are observed. 94 % of 2,000 such ladders are; 70 % were with the factor 1.25:
    0.9 lies 3.4 standard deviations of 400 ladders below the former.
    """
    rng = np.random.default_rng(3)
    sizes = np.array([2.0, 1.6818, 1.4142, 1.1892, 1.0])
    ladders = 1000.0 + sizes + rng.normal(0.0, 0.02, (400, 5))
    found = [convergence(sizes.tolist(), ladder.tolist(), 2.0) for ladder in ladders]
    assert sum(abs(one.finest - 1000.0) <= one.error for one in found) >= 0.9 * len(found)


def test_orders_above_the_formal_one_do_not_shrink_the_error_bar() -> None:
    values = [1.0 + h**2.8 for h in (0.4, 0.2, 0.1)]
    found = convergence((0.4, 0.2, 0.1), values, 2.0)
    change = abs(values[1] - values[2])
    assert found.asymptotic
    assert found.uncertainty == pytest.approx(3.0 * change / values[2] / 3.0)


def test_two_values_that_are_near_by_chance_are_no_order() -> None:
    """Durations of a tap on three meshes, us; the next two have 596.17 and 593.80, 0.65 % away:
    order 9 and 0.12 % were stated."""
    found = convergence((2.0, 1.41, 1.0), (583.75, 597.12, 597.71), 2.0)
    assert not found.asymptotic
    assert found.uncertainty > abs(593.80 / 597.71 - 1.0)


def test_an_order_that_was_far_above_the_formal_one_is_no_order_yet() -> None:
    """The last three have 2.0, the three before 6.0, and foretell the same limit."""
    last = [1.0 + 0.01 * h**2 for h in (4.0, 2.0, 1.0)]
    coarsest = last[0] + 2.0**6 * (last[0] - last[1])
    assert observed_order((8.0, 4.0, 2.0), [coarsest, *last[:2]]) == pytest.approx(6.0)
    assert convergence((4.0, 2.0, 1.0), last, 2.0).asymptotic
    found = convergence((8.0, 4.0, 2.0, 1.0), [coarsest, *last], 2.0)
    assert found.fitted or not found.asymptotic


def test_values_that_end_at_zero_have_no_relative_error() -> None:
    assert convergence((4.0, 2.0, 1.0), (4.0, 1.0, 0.0), 2.0).uncertainty == np.inf


def test_bad_sequences_are_refused() -> None:
    with pytest.raises(ValueError, match="three levels"):
        convergence((2.0, 1.0), (1.0, 1.0), 2.0)
    with pytest.raises(ValueError, match="do not fall"):
        convergence((1.0, 2.0, 3.0), (1.0, 1.0, 1.0), 2.0)


@pytest.mark.parametrize("factor", [-1.0, 1e3, -1e-3])
@pytest.mark.parametrize(
    ("sizes", "values"),
    [
        ((4.0, 2.0, 1.0), (17.0, 5.0, 2.0)),
        ((4.0, 2.0, 1.0), (1.0, 1.2, 1.1)),
        ((1.0, 0.84, 0.71, 0.6, 0.5), (5.41, 5.33, 5.29, 5.23, 5.21)),
        # of orders 2 and 1
        ((1e3, 1e2, 1e1, 1.0), (1111.0, 111.0, 101.0, 100.0)),
    ],
    ids=["order", "spread", "fit", "two orders"],
)
def test_a_numbers_unit_and_sign_are_none_of_its_convergence(
    sizes: tuple[float, ...], values: tuple[float, ...], factor: float
) -> None:
    one, other = (convergence(sizes, [f * v for v in values], 2.0) for f in (1.0, factor))
    assert (other.asymptotic, other.fitted) == (one.asymptotic, one.fitted)
    assert other.order == pytest.approx(one.order)
    assert other.limit == pytest.approx(factor * one.limit)
    assert other.uncertainty == pytest.approx(one.uncertainty)
    assert other.spread == pytest.approx(one.spread)


def test_a_fits_uncertainty_is_its_trend_its_scatter_and_what_the_finest_is_off() -> None:
    """Beside SciPy's fit of limit, slope and order: F_s |a| h^p + s + |r| of the finest."""
    sizes = np.array([1.0, 0.84, 0.71, 0.6, 0.5, 0.42])
    values = 5.0 + 0.4 * sizes**1.2 + 0.01 * np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.5])
    found = convergence(sizes.tolist(), values.tolist(), 2.0)

    def trend(h: np.ndarray, limit: float, slope: float, order: float) -> np.ndarray:
        return limit + slope * h**order

    (_, _, order), _ = curve_fit(trend, sizes, values, (5.0, 0.4, 1.0))
    assert found.fitted
    assert found.order == pytest.approx(order, abs=0.005)  # half a step of its search
    power = sizes**found.order
    slope, limit = np.polyfit(power, values, 1)
    left = values - limit - slope * power
    scatter = np.sqrt(left @ left / (sizes.size - 3))
    assert found.limit == pytest.approx(limit, rel=1e-9)
    whole = 3.0 * slope * power[-1] + scatter + abs(left[-1])
    assert found.error == pytest.approx(whole, rel=1e-9)


def test_a_verdict_is_in_percent() -> None:
    """100 + h^2: GCI 1.25 of 101. No trend: all of their range, 10 of 100."""
    found = convergence((4.0, 2.0, 1.0), (116.0, 104.0, 101.0), 2.0)
    assert found.verdict == "order 2.00, GCI 1.2 %"
    assert convergence((4.0, 2.0, 1.0), (95.0, 105.0, 100.0), 2.0).verdict == (
        "not asymptotic, spread 10 %"
    )
