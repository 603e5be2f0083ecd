"""Flights after a tap: the audit closes over several taps, and vibrations live on."""

from dataclasses import replace

import numpy as np
import pytest

import hcm
from tests.hcm.cases import HARD, HARD_TIP, SOFT, SOFT_TIP, SURFACE, finger

FREE = replace(SURFACE, friction=0.0)


@pytest.mark.parametrize(("mu", "restitution"), [(0.0, 1.0), (0.5, 1.0), (0.9, 0.8)])
def test_audit_of_several_taps_closes(mu: float, restitution: float) -> None:
    """1e-3 of the kinetic energy at impact; xi = 0.8 throughout leaves 1e-2 to 4e-2 of it."""
    result = hcm.simulate(
        finger(SOFT), replace(SURFACE, friction=mu), replace(SOFT_TIP, restitution=restitution),
        settings=hcm.Settings(taps=3),
    )  # fmt: skip
    assert result.status is hcm.Status.COMPLETED
    history = result.history
    impact = np.searchsorted(history.time_s, result.summary.contact_time_s or np.nan)
    allowed = 1e-3 * float(history.kinetic_energy_J[impact])
    assert np.abs(history.energy_balance_J).max() < allowed
    for loss in (history.friction_dissipation_J, history.restitution_dissipation_J):
        assert np.diff(loss).min() > -1e-9 * allowed


def _kept(settings: hcm.Settings) -> float:
    """Strain energy late in the flight after the first tap, as a share of that early in it."""
    result = hcm.simulate(finger(HARD), FREE, HARD_TIP, settings=settings)
    history = result.history
    leaves = next(e.time_s for e in result.events if e.kind == "separation")
    flown = (history.time_s - leaves) / (history.time_s[-1] - leaves)
    assert np.all(history.normal_force_N[flown > 0] == 0.0)
    early, late = (flown > 0) & (flown < 0.2), flown > 0.8
    widths = np.gradient(history.time_s)
    means = [np.average(history.strain_energy_J[part], weights=widths[part])
             for part in (early, late)]  # fmt: skip
    return float(means[1] / means[0])


def test_vibration_lives_on_after_a_tap() -> None:
    """Nothing in the model damps it; xi = 0.8 keeps 2e-5 of it."""
    assert _kept(hcm.Settings(end_time=0.2)) == pytest.approx(1.0, abs=0.1)


def test_fixed_steps_keep_the_spectral_radius() -> None:
    """Who fixes the flight's steps has chosen the method too."""
    fixed = hcm.Settings(end_time=0.2, flight_step=1e-5, flight_tolerance=0.0, spectral_radius=0.5)
    assert _kept(fixed) < 0.1


def test_first_tap_does_not_depend_on_what_follows() -> None:
    one, two = (
        hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, settings=hcm.Settings(**wanted))
        for wanted in ({"taps": 1}, {"end_time": 0.14})
    )
    rows = one.history.time_s.size
    assert two.history.time_s.size > rows
    for name in ("time_s", "normal_force_N", "tip_position_m", "hinge_reactions_N"):
        np.testing.assert_array_equal(getattr(one.history, name), getattr(two.history, name)[:rows])
