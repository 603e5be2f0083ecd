"""Which touches are one tap."""

import math

import numpy as np
import pytest
from scipy.linalg import eigh

import hcm
from hcm.arrays import Floats
from hcm.beam.chain import Chain, build_chain
from hcm.beam.refinement import beams_of, refine_chain
from hcm.model import RigidStart, rigid_motion
from hcm.results.result import Event
from hcm.taps.next_touch import bent_touches, next_touch_s, swings_down
from hcm.taps.tap import TapEndRule, taps_of
from reference_fem.dynamics.next_touch import bending_frequency

TOUCHES = [
    Event(time, kind)
    for time, kind in [
        (1.0, "contact"), (1.1, "compression_to_restitution"), (1.2, "separation"),
        (1.3, "contact"), (1.5, "separation"), (4.0, "contact"),
    ]
]  # fmt: skip


def test_each_separation_ends_a_tap_unless_taps_are_whole() -> None:
    assert taps_of(TOUCHES, None) == ((1.0, 1.2), (1.3, 1.5), (4.0, math.inf))
    assert taps_of(TOUCHES, [2.0]) == ((1.0, 1.5), (4.0, math.inf))
    assert taps_of(TOUCHES, []) == ((1.0, math.inf),)


def test_a_tip_must_stay_away_and_stay_off() -> None:
    rule = TapEndRule(transit=0.1)
    assert rule.first_check_s((1.0, 2.0)) == pytest.approx(2.1)  # a tenth of the contact
    assert rule.first_check_s((1.0, 1.01)) == pytest.approx(1.01 + 0.025)  # a quarter of a transit
    assert rule.next_check_s((1.0, 2.0), 2.1, 2.01) == math.inf
    assert rule.next_check_s((1.0, 2.0), 2.1, 1.99) == pytest.approx(2.11)
    assert rule.next_check_s((1.0, 1.01), 1.1, 0.19) < math.inf  # two transits at least
    given = TapEndRule(transit=0.1, until=1.5)
    assert given.first_check_s((1.0, 2.0)) == 2.5
    assert given.first_check_s((1.0, 4.0)) == 4.0
    assert given.next_check_s((1.0, 2.0), 2.5, 0.01) == math.inf


@pytest.mark.parametrize("rates", [(3.0,), (3.0, -1.0), (-3.0, 1.0)])
def test_a_rigid_phalanx_touches_when_its_tip_falls_to_the_surface(
    rates: tuple[float, ...],
) -> None:
    """Against the velocity of a rigid rod's end, y. = - sum theta._j L_j cos theta_j."""
    finger = hcm.Finger((hcm.Phalanx(0.04, 0.01, 1e9, 1400.0, 4),) * len(rates))
    angles = (0.3, 0.9)[: len(rates)]
    chain, _ = build_chain(finger, hcm.Drive())
    q, v = rigid_motion(finger, chain, RigidStart(angles, rates, 0.0))
    height = 0.1
    gap = height - 0.04 * sum(np.sin(angles))
    speed = 0.04 * float(np.dot(rates, np.cos(angles)))
    expected = gap / speed if speed > 0.0 else math.inf
    assert next_touch_s(q, v, chain, height) == pytest.approx(expected, rel=1e-12)
    if math.isfinite(expected):  # a straight phalanx does not vibrate
        for within, touches in ((0.999 * expected, False), (1.001 * expected, True)):
            assert bent_touches(q, v, chain, height, finger.phalanges[-1], within) == touches


@pytest.mark.parametrize("slender", [True, False], ids=["slender", "thick"])
@pytest.mark.parametrize("rate", [-0.3, 0.0, 0.3])
@pytest.mark.parametrize(
    ("refined", "known"),
    [
        (hcm.Assumptions("refined"), 0.15),
        (hcm.Assumptions(rotary_inertia=True, shear=True), 0.015),
    ],
    ids=["half-ball", "cylinder"],
)
def test_a_bent_phalanx_touches_as_its_lowest_vibration_brings_it_back(
    slender: bool, rate: float, refined: hcm.Assumptions, known: float
) -> None:
    """Against its own beam's first mode with the refined assumptions, and that mode's frequency:
    with the half-ball it is 12 % lower than without, and the mode's shape is another.

    known : the time of the touch is known to this share.
    """
    phalanx = hcm.Phalanx(0.2 if slender else 0.06, 0.015, 1e9, 1400.0, 20, poisson_ratio=0.4)
    beams, chain = refined_beams(phalanx, refined)
    frequency, shape = lowest_mode(chain, phalanx)
    tip, speed = 1e-4, 0.1 * frequency * 1e-4
    q, v = rigid_motion(beams, chain, RigidStart((0.0,), (-speed / phalanx.length,), 0.0))
    speed = float(v[chain.tip + 1])
    q, v = q + tip * shape, v + rate * tip * frequency * shape
    above = 0.5 * tip

    def gap(t: float) -> float:
        swing = math.cos(frequency * t) - 1.0, rate * math.sin(frequency * t)
        return above + speed * t + tip * sum(swing)

    times = np.linspace(0.0, 2 * math.pi / frequency, 10_001)
    expected = float(times[np.flatnonzero([gap(t) <= 0.0 for t in times])[0]])
    height = above - float(q[chain.tip + 1])
    for within, touches in (((1 - known) * expected, False), ((1 + known) * expected, True)):
        assert bent_touches(q, v, chain, height, phalanx, within) == touches
    assert next_touch_s(q, v, chain, height) == math.inf or rate < 0.0


def refined_beams(phalanx: hcm.Phalanx, refined: hcm.Assumptions) -> tuple[hcm.Finger, Chain]:
    """A phalanx's beams, and their chain."""
    finger, drive = hcm.Finger((phalanx,)), hcm.Drive()
    beams = beams_of(finger, refined)
    return beams, refine_chain(build_chain(beams, drive)[0], finger, drive, refined)


def lowest_mode(chain: Chain, phalanx: hcm.Phalanx) -> tuple[float, Floats]:
    """Frequency, rad/s, and Y of the first bending mode of a hinged phalanx, 1 at its tip."""
    size = 2 * (phalanx.elements + 1)
    mass, bending = np.zeros((2, size, size))
    for e in range(phalanx.elements):
        at = slice(2 * e, 2 * e + 4)
        mass[at, at] += chain.mass[e]
        bending[at, at] += chain.bending[e]
    free = [n for n in range(size) if n != 0]
    squares, modes = eigh(bending[np.ix_(free, free)], mass[np.ix_(free, free)])
    found = np.zeros(chain.scale.size)
    mode = np.insert(modes[:, 1], 0, 0.0) / modes[-2, 1]  # the first turns it as a rigid body
    for e in range(phalanx.elements):
        first = int(chain.first[e])
        found[[first + 1, first + 3, first + 5, first + 7]] = mode[2 * e : 2 * e + 4]
    return math.sqrt(squares[1]), found


@pytest.mark.parametrize("length", [0.2, 0.1, 0.06])
def test_the_reference_knows_the_same_lowest_vibration(length: float) -> None:
    """Of a hinged phalanx with a half-ball, to 0.4 % from four diameters on."""
    phalanx = hcm.Phalanx(length, 0.015, 1e9, 1400.0, 20, poisson_ratio=0.3)
    _, chain = refined_beams(phalanx, hcm.Assumptions("refined"))
    frequency, _ = lowest_mode(chain, phalanx)
    rod, found = bending_frequency(length, 0.015, math.sqrt(1e9 / 1400.0))
    assert rod == length - 0.0025
    assert found == pytest.approx(frequency, rel=5e-3)


@pytest.mark.parametrize("rate", [-1.0, 1.0])
def test_a_swing_that_goes_up_first_comes_down_later(rate: float) -> None:
    """1e-3 + t/10 +- sin t: just after 0, or after half a turn."""
    for within, touches in ((0.1, rate < 0.0), (3.4, rate < 0.0), (3.7, True)):
        assert swings_down(1e-3, 0.1, 0.0, rate, 1.0, within) == touches


def test_a_short_dip_is_not_stepped_over() -> None:
    """0.99 + (cos t - 1)/2 is below 0 for 0.2 rad about half a turn."""
    assert swings_down(0.99, 0.0, 0.5, 0.0, 1.0, 3.5)
    assert not swings_down(1.001, 0.0, 0.5, 0.0, 1.0, 3.5)


def test_a_stubby_phalanx_is_not_told_to_bend() -> None:
    stub = hcm.Phalanx(0.04, 0.015, 1e9, 1400.0, 5, poisson_ratio=0.2)
    run = hcm.simulate(
        hcm.Finger((stub,) * 3), hcm.Surface(0.1, 0.5), hcm.Tip(1e6),
        settings=hcm.Settings(estimate=False, flight="rigid"),
        assumptions=hcm.Assumptions("refined"),
    )  # fmt: skip
    assert run.status is hcm.Status.COMPLETED
    assert not any("another tap" in caution for caution in run.cautions)


def bouncing(end_time: float | None = None, **switches: bool) -> hcm.TapResult:
    """A slender phalanx, which bends away from the surface and comes back within its tap."""
    return hcm.simulate(
        hcm.Finger((hcm.Phalanx(0.04, 0.004, 5e9, 3000.0, 12, poisson_ratio=0.35),)),
        hcm.Surface(height=0.02, friction=0.4),
        hcm.Tip(normal_stiffness=1e6),
        hcm.Drive(),
        hcm.Settings(estimate=False, flight="rigid", end_time=end_time),
        assumptions=hcm.Assumptions("refined", **switches),
    )


def test_a_whole_tap_has_all_its_touches() -> None:
    parts, whole = bouncing(whole_tap=False), bouncing()
    (start, end), touches = whole.taps[0], [e for e in whole.events if e.kind == "contact"]
    assert len(touches) == 2
    assert end > parts.taps[0][1]
    assert whole.summary.contact_duration_s == pytest.approx(end - start, rel=1e-12)
    time, force = whole.history.time_s, whole.history.normal_force_N
    total = float(np.trapezoid(force, time))  # the run ends after its tap
    assert whole.summary.normal_impulse_N_s == pytest.approx(total, rel=1e-12)
    # up to the first separation nothing is different
    until = int(time.searchsorted(parts.taps[0][1], side="right"))
    np.testing.assert_array_equal(force[:until], parts.history.normal_force_N[:until])
    assert whole.summary.energy_residual < 1e-3


def test_a_tap_until_a_given_time_has_the_touches_that_begin_until_then() -> None:
    """A soft phalanx touches three times; as a rigid body it moves up after the first."""
    phalanx = hcm.Phalanx(0.0933, 0.015, 4.4e7, 1000.0, 8, poisson_ratio=0.44)
    own, two, three = (
        hcm.simulate(
            hcm.Finger((phalanx,)), hcm.Surface(0.0387, 0.27), hcm.Tip(1e6),
            settings=hcm.Settings(estimate=False, flight="rigid", tap_until=time),
            assumptions=hcm.Assumptions(
                "refined", deforming_tip=False, growing_patch=False, radiating_tip=False
            ),
        )
        for time in (0.0, 1e-3, 2.5e-3)
    )  # fmt: skip
    touched = [event.time_s for event in three.events if event.kind == "contact"]
    left = [event.time_s for event in three.events if event.kind == "separation"]
    assert len(touched) == 3
    assert three.taps[0] == (touched[0], left[2])
    # looks at the tip end steps elsewhere, each with an error of 1e-11 m of 1e-4
    assert own.taps[0] == pytest.approx((touched[0], left[0]), rel=1e-6)
    # after the second touch the body comes down by itself, so that by the rule the tap would go on
    assert two.taps[0] == pytest.approx((touched[0], left[1]), rel=1e-6)
    assert len([event for event in two.events if event.kind == "contact"]) == 2
    kept = int(own.history.time_s.searchsorted(left[0], side="right"))
    force = three.history.normal_force_N[:kept]
    np.testing.assert_array_equal(own.history.normal_force_N[:kept], force)
    assert own.summary.normal_impulse_N_s < 0.5 * three.summary.normal_impulse_N_s
    told = [caution for caution in own.cautions if "may touch again" in caution]
    assert touched[1] - left[0] < 1e-3 * float(told[0].split("within ")[1].split()[0])
    assert touched[1] - touched[0] < float(told[0].split("tap_until = ")[1].split()[0])
    assert not any("touch" in c and "again" in c for c in two.cautions + three.cautions)


def test_an_end_time_between_two_touches_of_a_tap_is_said() -> None:
    whole = bouncing()
    left, again = [e.time_s for e in whole.events if e.kind in ("separation", "contact")][1:3]
    cut = bouncing(end_time=0.5 * (left + again))
    assert cut.summary.contact_duration_s == pytest.approx(left - whole.taps[0][0])
    assert any("end_time" in caution for caution in cut.cautions)
    assert not any("another tap" in caution for caution in cut.cautions)  # it is the same
    assert not any("end_time" in caution for caution in whole.cautions)


def test_a_tip_that_is_down_already_touches_at_once() -> None:
    """Bent below the surface by vibration: no time before now."""
    finger = hcm.Finger((hcm.Phalanx(0.04, 0.01, 1e9, 1400.0, 4),))
    chain, _ = build_chain(finger, hcm.Drive())
    q, v = rigid_motion(finger, chain, RigidStart((0.3,), (3.0,), 0.0))
    assert next_touch_s(q, v, chain, 0.04 * math.sin(0.3) - 1e-4) == 0.0
