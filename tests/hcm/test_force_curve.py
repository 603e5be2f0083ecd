"""The contact force between the rows of collocation's long steps."""

from dataclasses import replace

import numpy as np
import pytest

import hcm
from hcm.force_curve import PARTS
from tests.hcm.cases import SOFT, SOFT_TIP, finger

SURFACE = hcm.Surface(0.1, 0.5)
LONG = hcm.Settings(
    contact_integrator="gauss", stages=8, contact_step=3e-5, flight="rigid", estimate=False
)


def tap(friction: float = 0.5, restitution: float = 1.0, **settings: object) -> hcm.TapResult:
    tip = replace(SOFT_TIP, restitution=restitution)
    return hcm.simulate(
        finger(SOFT), replace(SURFACE, friction=friction), tip,
        settings=replace(LONG, **settings),  # type: ignore[arg-type]
    )  # fmt: skip


@pytest.mark.parametrize(("friction", "restitution"), [(0.5, 1.0), (1.0, 0.5), (0.0, 1.0)])
def test_it_is_the_force_of_shorter_steps(friction: float, restitution: float) -> None:
    """By straight lines between the rows alone it was 0.7 % of the peak off."""
    coarse, fine = tap(friction, restitution), tap(friction, restitution, contact_step=2e-6)
    curve, rows = coarse.forces, coarse.history
    assert curve is not None
    assert fine.forces is not None
    first = coarse.taps[0]
    inside = (fine.forces.time_s > first[0]) & (fine.forces.time_s < first[1])
    time = fine.forces.time_s[inside]
    for name in ("normal_force_N", "tangential_force_N"):
        true = getattr(fine.forces, name)[inside]
        scale = fine.summary.peak_normal_force_N or np.nan
        apart = np.abs(np.interp(time, curve.time_s, getattr(curve, name)) - true).max() / scale
        by_rows = np.abs(np.interp(time, rows.time_s, getattr(rows, name)) - true).max() / scale
        assert apart < 1e-3
        assert apart < 0.3 * by_rows or friction == 0.0


def test_its_trapezoid_is_the_impulse_and_it_keeps_coulombs_cone() -> None:
    run = tap(friction=1.0)
    curve, mu = run.forces, 1.0
    assert curve is not None
    assert (np.diff(curve.time_s) >= 0.0).all()
    during = (curve.time_s >= run.taps[0][0]) & (curve.time_s <= run.taps[0][1])
    impulse = np.trapezoid(curve.normal_force_N[during], curve.time_s[during])
    # straight lines of PARTS pieces between the rows: an eighth squared of what rows leave
    assert impulse == pytest.approx(run.summary.normal_impulse_N_s, rel=0.3 / PARTS**2)
    assert curve.normal_force_N.min() >= 0.0
    assert (np.abs(curve.tangential_force_N) <= mu * curve.normal_force_N + 1e-9).all()
    # a run's rows are among it, and it is in its dataset
    assert set(run.history.time_s) <= set(curve.time_s)
    np.testing.assert_array_equal(run.to_dataset()["step_normal_force_N"], curve.normal_force_N)


def test_a_history_of_every_step_needs_none() -> None:
    assert tap(contact_integrator="generalized-alpha", contact_step=1e-6).forces is None
    early = tap(max_flight_time=0.01)
    assert early.status is hcm.Status.NOT_REACHED
    assert early.forces is None
