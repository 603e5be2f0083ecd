"""Quality figures on elements whose values are known by hand."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from meshes.quality import scaled_jacobians, volumes
from tests.meshes.lengths import characteristic_lengths, edge_lengths

CUBE = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]],
    dtype=float,
)
ONE = np.arange(8)[None]


def test_brick() -> None:
    brick = CUBE * [2.0, 3.0, 5.0]
    assert_allclose(scaled_jacobians(brick, ONE), 1.0)
    assert_allclose(volumes(brick, ONE), 30.0)
    assert_allclose(characteristic_lengths(brick, ONE), 2.0)  # 30 / (3 x 5)
    assert (edge_lengths(brick, ONE).min(), edge_lengths(brick, ONE).max()) == (2.0, 5.0)


@pytest.mark.parametrize("angle", [30.0, 45.0, 80.0, 120.0])
def test_sheared_cube_and_rhombus_have_the_sine_of_their_angle(angle: float) -> None:
    a = math.radians(angle)
    shear = np.eye(3)
    shear[1] = [math.cos(a), math.sin(a), 0.0]
    assert_allclose(scaled_jacobians(CUBE @ shear, ONE), math.sin(a))
    assert_allclose(volumes(CUBE @ shear, ONE), math.sin(a))
    rhombus = (CUBE @ shear)[:4, :2]
    cells = np.arange(4)[None]
    assert_allclose(scaled_jacobians(rhombus, cells), math.sin(a))
    assert_allclose(characteristic_lengths(rhombus, cells), math.sin(a))  # its altitude


def test_every_corner_and_edge_counts() -> None:
    for corner in range(8):
        dented = CUBE.copy()
        dented[corner] = 0.75 - 0.5 * CUBE[corner]  # beyond the plane of its three neighbours
        assert scaled_jacobians(dented, ONE)[0] < 0
    for corner in range(4):
        dented = CUBE[:4, :2].copy()
        dented[corner] = 0.75 - 0.5 * dented[corner]
        assert scaled_jacobians(dented, np.arange(4)[None])[0] < 0
    assert edge_lengths(CUBE, ONE).shape == (1, 12)
    assert_allclose(edge_lengths(CUBE, ONE), 1.0)


def test_collapsed_edge_gives_zero_not_nan() -> None:
    collapsed = CUBE.copy()
    collapsed[1] = collapsed[0]
    assert scaled_jacobians(collapsed, ONE)[0] == 0.0


def test_volume_of_a_frustum() -> None:
    frustum = CUBE.copy()
    frustum[4:, :2] = 0.25 + 0.5 * frustum[4:, :2]
    assert_allclose(volumes(frustum, ONE), (1 + 0.5 + 0.25) / 3)
