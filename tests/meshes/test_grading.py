"""Edges around a contact point: even, then growing, then as long as allowed."""

import math

import numpy as np
import pytest

from meshes.grading import Division, Grading

GRADINGS = [
    Grading(fine=0.1, growth=1.25, even=0.0, coarse=1.5),
    Grading(fine=0.1, growth=1.25, even=0.9, coarse=0.4),
    Grading(fine=0.1, growth=1.6, even=0.33, coarse=0.1),
]


@pytest.mark.parametrize("grading", GRADINGS)
def test_edges_are_even_then_grow_then_stay(grading: Grading) -> None:
    ends = np.array([grading.distance(k) for k in range(60)])
    edges, start = np.diff(ends), ends[:-1]
    assert edges[ends[1:] <= grading.even + 1e-12] == pytest.approx(grading.fine)
    assert (edges[1:] / edges[:-1]).max() < grading.growth * (1 + 1e-12)
    if grading.even == 0.0:
        rising = edges[start < 4.0][:-2]
        assert rising == pytest.approx(0.1 * 1.25 ** np.arange(len(rising)))
    assert edges[-1] == pytest.approx(grading.coarse)
    for d in (-7.0, -0.4, 0.0, 0.05, 0.9, 1.3, 20.0):
        assert grading.distance(grading.edges(d)) == pytest.approx(d, abs=1e-13)


@pytest.mark.parametrize("grading", GRADINGS)
@pytest.mark.parametrize(("start", "stop"), [(0.0, 7.0), (-2.0, 5.0), (1.0, -6.0), (0.0, 0.05)])
def test_a_curve_has_the_fewest_edges_that_are_short_enough(
    grading: Grading, start: float, stop: float
) -> None:
    count = grading.count(start, stop)
    exact = abs(grading.edges(stop) - grading.edges(start))
    assert count - 1 < max(exact, 0.1) <= count + 1e-9 or count == 1
    division = grading.divide(start, stop, count)
    places = start + (stop - start) * np.array([0.0, *division.nodes, 1.0])
    spent = np.diff([grading.edges(d) for d in places])
    assert spent == pytest.approx((grading.edges(stop) - grading.edges(start)) / count)
    assert division.halfway.halfway.count == division.evened.count == count


def test_halfway_is_the_mean_with_even_edges() -> None:
    assert Division(2, (0.2,)).halfway.nodes == pytest.approx((0.35,))
    assert Division(3).halfway == Division(3)
    assert math.isclose(Grading(0.1, 1.25, 0.0, 1.5).edges(-0.1), -1.0)
