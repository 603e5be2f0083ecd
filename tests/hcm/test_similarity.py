"""The reduced model in other units of length, time and mass."""

import pytest

import hcm
from tests.hcm.cases import finger
from tests.similarity import OWN, UNITS, Units, check_same_tap

DIAMETER, LENGTH = 0.015, 0.04


def scene(units: Units, assumptions: str, torque: float, incline: float, relax: float) -> hcm.Scene:
    length, time, mass = units
    force, pressure = mass * length / time**2, mass / (length * time**2)
    phalanx = hcm.Phalanx(
        LENGTH * length, DIAMETER * length, 1e9 * pressure, 1400.0 * mass / length**3,
        elements=4, relaxation_time=relax * time, poisson_ratio=0.4,
    )  # fmt: skip
    return hcm.Scene(
        finger(phalanx, elements=4),
        hcm.Surface(0.09 * length, 0.5),
        hcm.Tip(5e5 * force / length, restitution=0.8),
        hcm.Drive((torque * force * length,) * 3, 9.8 * length / time**2, incline=incline),
        hcm.Settings(max_flight_time=2.0 * time, max_contact_time=0.05 * time),
        assumptions=hcm.Assumptions(assumptions),  # type: ignore[arg-type]
    )


@pytest.mark.parametrize("units", UNITS)
@pytest.mark.parametrize(
    ("assumptions", "torque", "incline", "relax"),
    [("paper", 0.0, 0.0, 0.0), ("paper", 2e-3, 0.1, 0.0), ("refined", 0.0, 0.0, 1e-7),
     ("refined", 2e-3, 0.1, 0.0)],
)  # fmt: skip
def test_a_tap_in_other_units_is_the_same_tap(
    units: Units, assumptions: str, torque: float, incline: float, relax: float
) -> None:
    given = assumptions, torque, incline, relax
    own, other = (hcm.simulate_within(1e-3, scene(of, *given)) for of in (OWN, units))
    assert own.status is other.status is hcm.Status.COMPLETED
    assert own.statistics.steps == other.statistics.steps
    # roots that choose steps round: 220 random scenes differ by 2e-5 at most, errors by 9 %
    check_same_tap(own, other, units, 1e-4, 0.2)
