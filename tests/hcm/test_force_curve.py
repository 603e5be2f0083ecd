"""The contact force between the rows of collocation's long steps."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import hcm
from hcm.integrators.gauss_tableau import tableau
from hcm.results.force_curve import PARTS, ForceCurve, force_curve
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
    run = tap(contact_integrator="generalized-alpha", contact_step=1e-6)
    assert run.forces is None
    # a dataset's names do not depend on the integrator
    data = run.to_dataset()
    np.testing.assert_array_equal(data["step_normal_force_N"], run.history.normal_force_N)
    np.testing.assert_array_equal(data["step_time_s"], run.history.time_s)
    early = tap(max_flight_time=0.01)
    assert early.status is hcm.Status.NOT_REACHED
    assert early.forces is None


def one_step(normal: list[float], tangential: list[float], friction: float) -> ForceCurve:
    """The curve of a step of 1 s in contact, by its rows at both ends and three stages."""
    rows = np.array([0.0, *tableau(3).c, 1.0])
    history = SimpleNamespace(
        time_s=rows, mode=np.full(5, 3, dtype=np.int8), normal_force_N=np.array(normal),
        tangential_force_N=np.array(tangential),
    )  # fmt: skip
    given = {"settings": replace(LONG, stages=3), "surface": hcm.Surface(0.1, friction)}
    curve = force_curve(history, given)
    assert curve is not None
    assert curve.time_s.size == 5 + 4 * (PARTS - 1)
    return curve


def test_a_polynomial_of_the_stages_order_is_exact_between_rows() -> None:
    """Degree 4 through five rows."""
    rows = np.array([0.0, *tableau(3).c, 1.0])
    force = np.polynomial.Polynomial([2.0, 1.0, -3.0, 0.5, 1.0])
    curve = one_step((10.0 + force(rows)).tolist(), force(rows).tolist(), 1.0)
    assert curve.normal_force_N == pytest.approx(10.0 + force(curve.time_s), rel=1e-12)
    assert curve.tangential_force_N == pytest.approx(force(curve.time_s), rel=1e-12)


def test_a_polynomial_that_leaves_the_cone_between_rows_is_cut_to_it() -> None:
    """Rows of no force, or of all the friction there may be, are overshot between them."""
    touching = one_step([1.0, 0.0, 0.0, 0.0, 1.0], [0.0] * 5, 0.5)
    assert touching.normal_force_N.min() == 0.0
    sliding = one_step([1.0] * 5, [0.5, -0.5, 0.5, -0.5, 0.5], 0.5)
    assert sliding.normal_force_N == pytest.approx(1.0, rel=1e-12)
    # rounding of the normal force
    assert np.abs(sliding.tangential_force_N).max() <= 0.5 * (1.0 + 1e-12)
    assert np.count_nonzero(np.abs(sliding.tangential_force_N) > 0.4999) > 5
