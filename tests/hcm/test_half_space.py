"""Partial slip against an elastic half-space: the same where pressure and friction do not move each
other's surface (nu = 1/2), and what Mindlin's springs leave out elsewhere.
"""

import numpy as np
import pytest

from tests.hcm.half_space import forces
from tests.hcm.round_tips import TOUCH, E, R, at, law, press, touched

STEPS = 20
TIME = np.linspace(0, 1, STEPS + 1)
DEPTH = 0.01 * np.sin(np.pi * TIME) ** 2 + 1e-9  # over R: a/R = 0.1


@pytest.mark.parametrize(("nu", "apart"), [(0.499, 0.0), (0.4, 0.0226), (0.3, 0.0597)])
def test_springs_forces_beside_a_half_spaces(nu: float, apart: float) -> None:
    """Pressed, moved there and partly back at mu = 0.6: slip, stick of a growing part, slip.

    apart : what |F_t| is too large by at most, of the largest mu F_n, as measured. Squares of a/7
    leave 1 %.
    """
    mu = 0.6
    way = 1.2 * mu * (2 - nu) / (2 * (1 - nu)) * 0.01 * np.sin(0.8 * np.pi * TIME)
    wanted = forces(DEPTH, way, 0 * TIME, nu, mu)
    tip, fine = touched(law(mu=mu, nu=nu)), np.linspace(0, STEPS, 8 * STEPS + 1)[1:]
    places = [R * np.interp(fine, np.arange(STEPS + 1), one) for one in (way, DEPTH)]
    path = [press(tip, TOUCH, at(x, depth)) for x, depth in zip(*places, strict=True)]
    own = np.array(path[7::8]) / (E / (2 * (1 + nu)) * R**2)
    found = (np.abs(own[:, 0]) - np.abs(wanted[:, 0])) / (mu * wanted[:, 1].max())
    assert found.max() == pytest.approx(apart, abs=5e-3)
    assert found.min() > -0.012
