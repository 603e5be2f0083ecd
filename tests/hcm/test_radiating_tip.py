"""A tip that radiates: F_n += -D k^2 g., its power, and what a ball loses by it."""

import numpy as np
import pytest
from scipy.special import beta

import hcm
from hcm.arrays import Floats
from hcm.contact import round_tip_law, tip_compliance, tip_damping
from hcm.contact.build import RADIATED, RADIATION
from hcm.contact.law import RESTITUTION, SLIP, STICK
from hcm.contact.round_tip import COMPLIANCE_XY, RoundTipLaw
from tests.hcm.round_tips import BALL, MU, NU, TOUCH, E, R, at, bounce, law, press, touched

DEEP = 2e-4
RADIATING = {"tip_compliance": True, "deforming_tip": True, "radiating_tip": True}
UNIT = 1.0 / (E * np.sqrt(E / 1400.0))  # 1/(E c)
SIDEWAYS = np.array([0.3, -0.8, 40.0, 25.0])


def pressed(angle: float = -0.7) -> RoundTipLaw:
    """The tip in the middle of a touch that has drawn its springs."""
    tip = touched(law(**RADIATING), angle)
    press(tip, TOUCH, at(0.0, DEEP, angle))
    press(tip, TOUCH, at(1e-5, 0.9 * DEEP, angle))
    return tip


def test_constants_are_those_of_the_scene() -> None:
    tip, without = law(**RADIATING), law(tip_compliance=True, deforming_tip=True)
    assert tip.radiation == pytest.approx(RADIATION * UNIT, rel=1e-12)
    assert without.radiation == 0.0
    lower = (without.compliance - tip.compliance) * E * R
    assert lower == pytest.approx([RADIATED, 0, 0, 0, 0], abs=1e-12)


@pytest.mark.parametrize("angle", [-0.7, -2.2])
@pytest.mark.parametrize("tangential", [STICK, SLIP])
def test_it_resists_the_rate_of_the_normal_force(tangential: int, angle: float) -> None:
    """-D (dF_n/dg)^2 g. by differences, of a tip whose F_n does not depend on F_t. The power is
    that of the work, less friction's where the tip slides.
    """
    tip, q, step = pressed(angle)._replace(softening=0.0), at(1.2e-5, 0.92 * DEEP, angle), 1e-10
    tip.memory[COMPLIANCE_XY] = 0.0
    contact = TOUCH._replace(tangential_mode=tangential, slip_sign=float(tangential == SLIP))

    def springs(moved: Floats) -> Floats:
        x, gap = tip_compliance.contact_position(moved, 0, contact, tip)
        return np.array(round_tip_law.contact_force(x, gap, contact, tip))

    up = np.array([0.0, step, 0.0, 0.0])
    k = (springs(q + up) - springs(q - up))[1] / (2 * step)
    more = np.array(tip_damping.tip_force(q, SIDEWAYS, 0, contact, tip)) - springs(q)
    assert more[1] == pytest.approx(-tip.radiation * k**2 * SIDEWAYS[1], rel=1e-5)
    assert more[0] == pytest.approx(-MU * more[1] if tangential == SLIP else 0.0, rel=1e-9)
    power = tip_damping.rate_power(q, SIDEWAYS, 0, contact, tip)
    if tangential == STICK:
        assert power == pytest.approx(tip.radiation * (k * SIDEWAYS[1]) ** 2, rel=1e-5)
    assert power > 0.0
    still = tip_damping.tip_force(q, np.zeros(4), 0, contact, tip)
    assert still == pytest.approx(springs(q), rel=1e-12)


def test_the_same_force_at_the_same_rate_radiates_as_much_in_restitution() -> None:
    """u_Y lags by D F_n. of the contact, whose way is e*^2 as long there: at e*^2 of the speed."""
    tip = touched(law(0.4, mu=0.0, **RADIATING))
    pushed = round_tip_law.contact_force(0.0, -DEEP, TOUCH, tip)[1]
    back = TOUCH._replace(normal_mode=RESTITUTION, force_ref=pushed, gap_ref=-DEEP)
    up, start = np.array([0.0, 0.8, 0.0, 0.0]), at(0.0, DEEP)
    loading = tip_damping.tip_force(start, up, 0, TOUCH, tip)[1]
    assert loading < pushed
    assert tip_damping.tip_force(start, 0.16 * up, 0, back, tip)[1] == pytest.approx(
        loading, rel=1e-12
    )


def test_it_does_not_pull() -> None:
    tip, q = pressed(), at(1e-5, 0.5 * DEEP)
    fast = np.array([0.0, 1e4, 0.0, 0.0])
    assert tip_damping.tip_force(q, fast, 0, TOUCH, tip)[1] == pytest.approx(0.0, abs=1e-9)
    assert tip_damping.rate_power(q, fast, 0, TOUCH, tip) > 0.0


@pytest.mark.parametrize("speed", [0.5, 2.0])
def test_a_ball_loses_what_the_rate_of_hertzs_force_takes(speed: float) -> None:
    """D int F.^2 dt = D 4.5 K^2 v d_max^2 (2/5) B(4/5, 3/2) over Hertz's pulse, F = K d^(3/2),
    d.^2 = v^2 (1 - (d/d_max)^(5/2)), to first order in D; the second is a share of the loss
    of the size of the loss over the energy.
    """
    tip = touched(law(mu=0.0)._replace(radiation=RADIATION * UNIT))
    k = tip.k
    deepest = (5 * BALL * speed**2 / (4 * k)) ** 0.4
    first = tip.radiation * 4.5 * k**2 * speed * deepest**2 * 0.4 * beta(0.8, 1.5)
    energy = 0.5 * BALL * speed**2
    lost, left = bounce(tip, speed)
    assert lost == pytest.approx(energy - left, rel=1e-4)
    assert lost == pytest.approx(first, rel=2 * first / energy)
    assert first / energy > 0.01


@pytest.mark.parametrize("friction", [0.3, 1.2])
def test_collocations_audit_counts_what_is_radiated(friction: float) -> None:
    """Some 0.5 % of the energy that a tap begins with."""
    phalanx = hcm.Phalanx(0.04, 2 * R, E, 1400.0, elements=6, poisson_ratio=NU)
    result = hcm.simulate(
        hcm.Finger((phalanx,) * 3), hcm.Surface(0.1, friction), hcm.Tip(1e6),
        settings=hcm.Settings(flight="rigid", estimate=False, contact_integrator="gauss"),
        assumptions=hcm.Assumptions("refined"),
    )  # fmt: skip
    assert result.status is hcm.Status.COMPLETED
    assert result.summary.energy_residual < 1e-4
    lost = result.history.material_dissipation_J
    assert np.diff(lost).min() >= 0.0
    assert lost[-1] > 10 * 1e-4 * result.history.kinetic_energy_J.max()


@pytest.mark.parametrize("restitution", [1.0, 0.6, 0.4])
def test_springs_that_stick_hold_by_the_whole_normal_force(restitution: float) -> None:
    """Coulomb's |F_t| <= mu F_n of the forces that a run states: the springs' own F_n is larger
    while the tip moves up. Where it slips then, F_t goes on as it was.
    """
    phalanx = hcm.Phalanx(0.04, 2 * R, E, 1400.0, elements=6, poisson_ratio=NU)
    result = hcm.simulate(
        hcm.Finger((phalanx,) * 3), hcm.Surface(0.1, 1.0), hcm.Tip(1e6, restitution),
        settings=hcm.Settings(flight="rigid", estimate=False),
        assumptions=hcm.Assumptions("refined"),
    )  # fmt: skip
    assert result.status is hcm.Status.COMPLETED
    assert result.summary.stick_to_slip == 1
    force, along = result.history.normal_force_N, result.history.tangential_force_N
    assert (np.abs(along) <= force * (1.0 + 1e-9) + 1e-9 * force.max()).all()
    (slip,) = (event.time_s for event in result.events if event.kind == "stick_to_slip")
    row = int(result.history.time_s.searchsorted(slip))
    # a step's change, 1 % of the peak; it was a jump of 1 to 24 %
    assert np.abs(np.diff(along[row - 1 : row + 2])).max() < 0.02 * force.max()
    assert result.summary.energy_residual < 1e-4
