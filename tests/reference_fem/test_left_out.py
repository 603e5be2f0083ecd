"""What a rigid flight leaves out: closed forms, and flights of the elements themselves."""

import math
from dataclasses import replace

import numpy as np
import pytest

import meshes
import reference_fem as rf
from reference_fem.estimates.elastic_response import (
    STRETCH_SHARE,
    TORQUE_SHARE,
    WEIGHT_SHARE,
    ElasticResponse,
    elastic_response,
    loads,
)
from reference_fem.estimates.error_cautions import flight_doubts
from reference_fem.estimates.flight_error import (
    CHANGE,
    MAGNIFIED,
    SETTLING_EFFECT,
    Flight,
    FlightErrors,
    OmittedMotion,
    magnified,
    omitted_motion,
)
from reference_fem.flight.rigid_flight import Descent, descent, surface_gap
from reference_fem.model import build_model
from reference_fem.rigid.rigid_chain import ChainState, chain_and_start
from reference_fem.rigid.true_body import true_chain

R, L = 0.0075, 0.04
FINGER = meshes.FingerGeometry((L,) * 3, (2 * R,) * 3)
COARSE = meshes.Sizing(8e-3, 14e-3, 8e-3)
SURFACE = rf.Surface(0.1, 0.5)
DRIVEN = rf.Drive(torques=(0.02, 0.01, -0.005))
WHIRL = rf.Drive(torques=(0.2, 0.0, -0.05))
SOFT = rf.Material(1e9, 0.4, 1400.0)
RUBBER = rf.Material(1e7, 0.4, 1400.0)
G = 9.8


def held(links: int, seconds: float = 1.0, angle: float = 0.0) -> Descent:
    """So long a flight in which nothing moves."""
    angles, zeros = np.full(links, angle), np.zeros(links)
    return Descent(
        ChainState(angles, zeros, 0.0), seconds, lambda time: ChainState(angles, zeros, time)
    )


def of_rods(links: int, drive: rf.Drive, flown: Descent) -> ElasticResponse:
    rods = meshes.FingerGeometry((L,) * links, (2 * R,) * links, tip="flat")
    chain = true_chain(rods, (SOFT,) * links, drive, 3)
    return elastic_response(chain, flown, drive, rods, (SOFT,) * links)


AREA, STIFFNESS = math.pi * R**2, SOFT.youngs_modulus * math.pi * R**4 / 4
FIRST = (math.pi / L) ** 2 * math.sqrt(STIFFNESS / (SOFT.density * AREA))


@pytest.mark.parametrize("reaction", [False, True])
def test_vibrations_of_torques_that_change_on_the_way_add_up(reaction: bool) -> None:
    """A square wave of N jumps by 2 M bends as M and 2 N M; a kink as its change of rate over w."""

    def depth(times: list[float], torques: list[float]) -> float:
        table = rf.TorqueTable(tuple(times), tuple((0.0, t) for t in torques))
        drive = rf.Drive(gravity=0.0, reaction=reaction, table=table)
        return of_rods(2, drive, held(2)).depth - alone

    alone, torque, jumps = 0.0, 1e-3, 9
    bend = torque * L**2 / (9 * math.sqrt(3) * STIFFNESS)
    alone = depth([0.0], [torque])  # by the torque, and by the mass that it moves
    times = np.repeat(np.arange(1, jumps + 1) / 20, 2).tolist()
    wave = [torque * (-1) ** (n + side) for n in range(jumps) for side in (0, 1)]
    assert depth(times, wave) == pytest.approx(2 * jumps * bend, rel=1e-9)
    slow = depth([0.0, 0.5, 1.0], [torque, torque, 0.0])
    assert slow == pytest.approx(bend * 2.0 / FIRST, rel=1e-6)


def test_a_rod_sags_under_the_load_at_its_hinge() -> None:
    """At rest the hinge's end alone has no acceleration: p = ρ A g, and 5 p L⁴/384 E I."""
    of = of_rods(1, rf.Drive(), held(1))
    assert of.depth == pytest.approx(5 * 1400.0 * AREA * G * L**4 / (384 * STIFFNESS), rel=1e-6)
    assert of.angle == pytest.approx(of.depth / L, rel=1e-12)
    assert of.ringing_speed == pytest.approx(WEIGHT_SHARE * of.depth * FIRST, rel=1e-12)
    assert of.settling == pytest.approx(of.depth * FIRST, rel=1e-9)


@pytest.mark.parametrize("links", [1, 2])
def test_a_rod_that_hangs_stretches_under_its_weight_and_the_next_ones(links: int) -> None:
    """rho g L²/2 E, all in all of their length; the first one, with the next one's weight, at the
    speed of a quarter wave.
    """
    of = of_rods(links, rf.Drive(), held(links, angle=math.pi / 2))
    unit = SOFT.density * G * L**2 / SOFT.youngs_modulus
    assert of.depth == pytest.approx(0.5 * links**2 * unit, rel=1e-9)
    stretch = (0.5 + (links - 1)) * unit
    assert of.ringing_speed == pytest.approx(
        STRETCH_SHARE * stretch * SOFT.bar_speed * math.pi / (2 * L), rel=1e-9
    )
    assert of.settling == pytest.approx(of.ringing_speed / STRETCH_SHARE, rel=1e-9)
    assert of.angle < 1e-9


def test_a_rod_that_swings_has_yet_to_stretch_as_it_touches() -> None:
    """p = rho A omega² L at its end: rho omega² L³/2 E, at the speed of a quarter wave."""
    start, spin = ChainState(np.zeros(1), np.zeros(1), 0.0), 30.0
    swings = Descent(
        start, 1.0, lambda time: ChainState(np.zeros(1), np.full(1, spin * (time == 1.0)), time)
    )
    of = of_rods(1, rf.Drive(gravity=0.0), swings)
    stretch = SOFT.density * spin**2 * L**3 / (2 * SOFT.youngs_modulus)
    known = stretch * SOFT.bar_speed * math.pi / (2 * L)
    assert of.settling == pytest.approx(known, rel=1e-9)
    assert of.ringing_speed < 1e-9 * known


def test_a_torque_bends_a_rod_and_its_inertia() -> None:
    """Without gravity: t L²/(9 √3 E I), and p = ρ A α L at the end, α = t/J about the hinge."""
    mass, torque = 1400.0 * AREA * L, 0.01
    inertia = mass * (L**2 / 3 + R**2 / 4)
    load = mass / L * torque / inertia * L
    of = of_rods(1, rf.Drive(torques=(torque,), gravity=0.0), held(1))
    known = (5 * load * L**4 / 384 + torque * L**2 / (9 * math.sqrt(3))) / STIFFNESS
    assert of.depth == pytest.approx(known, rel=1e-5)
    assert of.ringing_speed == pytest.approx(TORQUE_SHARE * known * FIRST, rel=1e-5)


def test_torques_at_both_ends_of_a_phalanx_bend_it_though_they_cancel() -> None:
    """Motors in all hinges, each as strong: only the last phalanx has a net torque."""
    drive = rf.Drive(torques=(0.2,) * 3, reaction=True, gravity=0.0)
    chain = true_chain(FINGER, (SOFT,) * 3, drive, 3)
    np.testing.assert_allclose(chain.torques.at(0.0), [0.0, 0.0, 0.2], atol=1e-15)
    of = elastic_response(chain, held(3), drive, FINGER, (SOFT,) * 3)
    assert of.depth > 0.2 * L**2 / (8 * STIFFNESS)


def test_a_torque_between_two_samples_is_seen() -> None:
    jolt = rf.TorqueTable(
        (0.0, 0.501, 0.501, 0.502, 0.502), ((0.0,), (0.0,), (0.1,), (0.1,), (0.0,))
    )
    jolted, still = (of_rods(1, rf.Drive(table=table), held(1)).depth for table in (jolt, None))
    assert jolted > 10 * still


@pytest.mark.parametrize("angle", [0.0, math.pi / 2])
def test_nothing_bends_or_stretches_in_no_time(angle: float) -> None:
    """ω T of 0.02: a step's response is half its square of δ, and all of it of δ ω."""
    first = FIRST if angle == 0.0 else SOFT.bar_speed * math.pi / (2 * L)
    short, long = (
        of_rods(3, rf.Drive(), held(3, seconds, angle)) for seconds in (0.02 / first, 1.0)
    )
    assert short.depth == pytest.approx(2e-4 * long.depth, rel=1e-3)
    assert short.ringing_speed == pytest.approx(0.02 * long.ringing_speed, rel=1e-3)


STEEP = ChainState(np.array([0.80, 0.84, 0.87]), np.zeros(3), 0.0)


def flown(
    material: rf.Material,
    drive: rf.Drive,
    start: ChainState | None = None,
    sizing: meshes.Sizing = COARSE,
) -> tuple[meshes.FingerMesh, Flight]:
    mesh, settings = meshes.finger_hexahedra(FINGER, sizing), rf.Settings(contact="impulse")
    model = build_model(mesh, (material,) * 3, SURFACE, drive, settings)
    chain, first = chain_and_start(model.chain, start)
    gap = surface_gap(model, chain)
    down = descent(chain, gap, first, settings)
    assert down is not None
    return mesh, Flight(chain, gap, model.points[[model.pole]], down)


@pytest.mark.parametrize(
    ("material", "drive", "start"),
    [(SOFT, DRIVEN, None), (RUBBER, rf.Drive(), None), (RUBBER, rf.Drive(), STEEP)],
)
def test_elements_that_fly_arrive_within_what_is_left_out(
    material: rf.Material, drive: rf.Drive, start: ChainState | None
) -> None:
    """From a steep start what stretches is more than ten times what bends."""
    mesh, of = flown(material, drive, start)
    read = []
    for flight in ("rigid", "explicit"):
        settings = rf.Settings(contact="impulse", flight=flight, estimate=False)
        summary = rf.simulate(mesh, (material,) * 3, SURFACE, drive, settings, start=start).summary
        velocity = summary.tip_velocity_at_contact_m_per_s
        assert velocity is not None
        read.append((summary.contact_time_s, np.array(velocity)))
    late, apart, *_ = omitted_motion(
        of, "rigid", drive, FINGER, (material,) * 3, abs(read[0][1][1])
    )
    assert abs(read[0][0] - read[1][0]) < late
    found = np.abs(read[0][1] - read[1][1])
    assert (found < apart).all()
    # no more than a bound needs: the speed's error goes into every number of the tap
    assert apart.max() < 20 * found.max()


def test_elements_that_fly_lose_a_phase_and_not_the_arrival() -> None:
    """All of the bending's, and along the axis (π/2n)²/24 of the radians, n elements a phalanx. Of
    the bending's angle 1/n² is missed, n elements across: 0.04 here.
    """
    three = (RUBBER,) * 3
    _, of = flown(RUBBER, rf.Drive(), STEEP)
    coarse, explicit, fine = (
        omitted_motion(of, how, rf.Drive(), FINGER, three, 1.0, section)
        for how, section in (("coarse", 0.25), ("explicit", 0.2), ("explicit", 0.0))
    )
    assert 0.0 < explicit.late_s < 0.05 * coarse.late_s
    assert fine.late_s < 1e-12  # the flights' tolerance
    of_bending, whole = fine.ringing_speed, coarse.ringing_speed
    assert 0.0 < of_bending < 0.5 * whole
    radians = of.touch.time_s * RUBBER.bar_speed * np.pi / (2 * FINGER.lengths[0])
    n = FINGER.lengths[0] / (0.2 * 2 * FINGER.radii[0])
    phase = (np.pi / (2 * n)) ** 2 / 24 * radians
    assert phase < 1.0
    found = (explicit.ringing_speed - of_bending) / (whole - of_bending)
    assert found == pytest.approx(phase, rel=0.15)  # 0.1 % at a quarter was measured


def test_of_a_whirl_that_bending_leads_elsewhere_nothing_is_known() -> None:
    """The elements touch twice as late as the rods; another mesh comes to another touch again, 28
    stated errors away, until what its cells miss of the bending was in them.
    """
    _, of = flown(SOFT, WHIRL)
    for how in ("rigid", "coarse", "explicit"):
        late, apart, *_ = omitted_motion(of, how, WHIRL, FINGER, (SOFT,) * 3, 1.0, 0.2)
        assert late == np.inf
        assert np.isinf(apart).all()


def test_how_a_flight_magnifies_its_start() -> None:
    """A rod turns over from its angle a: v_y = l θ' cos θ, θ'^2 = w^2 + 2 C (sin θ - sin a), at one
    θ; so dv_y/v_y = -C cos a da/θ'^2. A rod that turns by less than π is not looked at, and a whirl
    comes to another touch.
    """
    finger, height = meshes.FingerGeometry((0.04,), (0.01,)), 0.03
    mesh = meshes.finger_hexahedra(finger, meshes.Sizing(3e-3, 5e-3, 3e-3))
    settings = rf.Settings(contact="impulse")
    model = build_model(mesh, (SOFT,), rf.Surface(height, 0.5), rf.Drive(), settings)
    found = []
    for angle, rate in ((-3.0, 60.0), (-0.5, 60.0)):
        start = ChainState(np.array([angle]), np.array([rate]), 0.0)
        chain, first = chain_and_start(model.chain, start)
        gap = surface_gap(model, chain)
        down = descent(chain, gap, first, settings)
        assert down is not None
        found.append(Flight(chain, gap, model.points[[model.pole]], down))
    over, plain = found
    (ends,), (turns,) = over.touch.angles, over.touch.rates
    gained = 0.5 * (turns**2 - 60.0**2) / (np.sin(ends) - np.sin(-3.0))  # C
    exact = CHANGE * abs(gained * np.cos(-3.0)) / turns**2
    # the flights' tolerance over the change, and the change's square
    assert magnified(over) == pytest.approx(exact, rel=1e-2)
    assert magnified(plain) == 0.0
    whirl = flown(SOFT, WHIRL)[1]
    assert magnified(whirl) > MAGNIFIED
    still = FlightErrors(0.0, np.zeros(2), 0.0, OmittedMotion(0.0, np.zeros(2)))
    (caution,) = flight_doubts(still, whirl, "rigid", 1.0, ())
    assert caution.startswith("the flight magnifies its start: angles changed by 1e-05 rad change")
    assert flight_doubts(still, plain, "rigid", 1.0, ()) == ()


@pytest.mark.parametrize(("material", "drive"), [(RUBBER, rf.Drive()), (SOFT, DRIVEN)])
def test_what_a_rigid_flight_leaves_out_is_known_before(
    material: rf.Material, drive: rf.Drive
) -> None:
    """By the true body's flight, as a run states it by its mesh's: to 0.4 % with edges of 3 mm as
    of 1.5, where nodes lie nearly as low as the round end (9 % with 8 mm)."""
    three = (material,) * 3
    _, of = flown(material, drive, sizing=meshes.Sizing(3e-3, 5e-3, 3e-3))
    approach_speed = abs(of.pole_velocity(of.touch)[1])
    omitted = omitted_motion(of, "rigid", drive, FINGER, three, approach_speed)
    stated = omitted.share("normal_impulse_N_s", approach_speed)
    told, lasts = rf.rod_flight(FINGER, three, SURFACE, drive, rf.Settings())
    assert told == pytest.approx(stated, rel=0.01)
    assert lasts == pytest.approx(of.touch.time_s, rel=1e-3)


@pytest.mark.parametrize(("time", "first", "last"), [(0.3, 0.0, -2.0), (0.0, -2.0, 0.0)])
def test_torques_that_act_after_the_touch_or_never_leave_out_nothing(
    time: float, first: float, last: float
) -> None:
    drive = rf.Drive(table=rf.TorqueTable((time, time), ((first,) * 3, (last,) * 3)))
    free, later = (
        rf.rod_flight(FINGER, (RUBBER,) * 3, SURFACE, of, rf.Settings()).left_out
        for of in (rf.Drive(), drive)
    )
    assert later == pytest.approx(free, rel=1e-6)


def test_where_a_rigid_flight_leads_elsewhere_or_nowhere() -> None:
    three = (SOFT,) * 3
    assert rf.rod_flight(FINGER, three, SURFACE, WHIRL, rf.Settings()).left_out == math.inf
    far, still = rf.Surface(1.0, 0.0), rf.Settings()
    assert rf.rod_flight(FINGER, three, far, rf.Drive(), still) == (0.0, 0.0)
    with pytest.raises(ValueError, match="2 given for 3 phalanges"):
        rf.rod_flight(FINGER, three[:2], SURFACE, rf.Drive(), still)


def test_a_tap_of_which_nothing_is_known_asks_for_no_finer_mesh(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    unknown = OmittedMotion(np.inf, np.full(2, np.inf))
    monkeypatch.setattr("reference_fem.estimates.estimate.omitted_motion", lambda *_: unknown)
    mesh = meshes.finger_hexahedra(FINGER, COARSE)
    smooth = rf.Surface(0.1, 0.0)
    run = rf.simulate(mesh, (SOFT,) * 3, smooth, rf.Drive(), rf.Settings(contact="impulse"))
    errors = dict(run.errors)
    assert errors.pop("peak_tangential_force_N") == 0.0
    assert all(np.isinf(error).all() for error in errors.values())
    assert run.mesh_errors == {}
    assert "refine the mesh" not in "".join(run.cautions)
    assert any("by an unknown share" in text for text in run.cautions)


@pytest.mark.parametrize("flight", ["rigid", "explicit"])
def test_what_is_left_out_is_in_every_error_and_said(
    flight: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """But in those that a finer mesh may lessen; flights of the run's mesh leave a phase out."""
    mesh = meshes.finger_hexahedra(FINGER, COARSE)
    settings = rf.Settings(contact="impulse", flight=flight)
    runs = []
    for share in (0.0, 0.1):
        monkeypatch.setattr(
            "reference_fem.estimates.estimate.omitted_motion",
            lambda *of, s=share: OmittedMotion(s, np.full(2, s * of[5]), s, 0.1 * s * of[5]),
        )
        runs.append(rf.simulate(mesh, (RUBBER,) * 3, SURFACE, rf.Drive(), settings))
    without, run = runs
    alike = replace(settings, flight_error=False)
    assert rf.simulate(mesh, (RUBBER,) * 3, SURFACE, rf.Drive(), alike).errors == without.errors

    def more(name: str) -> float:
        """What was added to the square of an error, its root."""
        return math.sqrt(run.errors[name] ** 2 - without.errors[name] ** 2)

    for name, power in (("peak_normal_force_N", 1.2), ("normal_impulse_N_s", 1.0)):
        changed = 0.1 * power + 0.01 * 0.36
        assert more(name) == pytest.approx(changed * getattr(run.summary, name), rel=1e-9)
    assert run.errors["contact_time_s"] - without.errors["contact_time_s"] == 0.1
    # what rings changes times by V/v, more than the speed's power 1/5
    approach_speed = abs(run.summary.tip_velocity_at_contact_m_per_s[1])
    longer = 0.1 / approach_speed + 0.01 * SETTLING_EFFECT["contact_duration_s"]
    longer *= run.summary.contact_duration_s
    assert more("contact_duration_s") == pytest.approx(longer, rel=1e-9)
    assert run.mesh_errors == without.mesh_errors
    (said,) = [text for text in run.cautions if "stretching and vibration in flight" in text]
    # a coarse flight would have the ringing in a phase of chance
    assert ("flight = 'explicit'" if flight == "rigid" else "refine the shafts") in said
    assert "flight = 'coarse'" not in "".join(said)
    waves = 2.0 * 0.1 * math.sqrt(RUBBER.youngs_modulus * RUBBER.density)
    of_speed = (0.12 + 0.01 * SETTLING_EFFECT["peak_stress_R_Pa"]) * run.summary.peak_stress_R_Pa
    assert more("peak_stress_R_Pa") == pytest.approx(of_speed + waves, rel=1e-9)


def test_what_hangs_on_a_phalanx_of_a_straight_chain_that_spins() -> None:
    """p = rho A omega² r at each end, and the next one's mass at its middle, 3/2 L from the axis.

    Without gravity, and with equal rates, nothing turns faster or slower.
    """
    rods, spin = meshes.FingerGeometry((L, L), (2 * R, 2 * R), tip="flat"), 30.0
    chain = true_chain(rods, (SOFT,) * 2, rf.Drive(gravity=0.0), 3)
    line = SOFT.density * AREA
    state = ChainState(np.zeros(2), np.full(2, spin), 0.0)
    across, along, pull = loads(chain, state, np.full(2, L), np.full(2, line))
    unit = line * spin**2 * L
    np.testing.assert_allclose(along, [unit, 2 * unit], rtol=1e-9)
    np.testing.assert_allclose(pull, [1.5 * unit * L, 0.0], rtol=1e-9, atol=1e-9 * unit * L)
    assert across.max() < 1e-9 * unit


def test_what_settles_is_bent_by_the_loads_at_the_touch() -> None:
    """A rod that lies until its touch, and then hangs, is no longer bent but stretched."""
    start = ChainState(np.zeros(1), np.zeros(1), 0.0)
    turns = Descent(
        start, 1.0,
        lambda time: ChainState(np.full(1, math.pi / 2 * (time == 1.0)), np.zeros(1), time),
    )  # fmt: skip
    of = of_rods(1, rf.Drive(), turns)
    stretch = SOFT.density * G * L**2 / (2 * SOFT.youngs_modulus)
    assert of.settling == pytest.approx(stretch * SOFT.bar_speed * math.pi / (2 * L), rel=1e-6)
    assert of.depth > 2 * stretch  # as it lay


def test_elements_that_fly_are_bent_already_as_they_touch() -> None:
    """Only rods take up their loads at the touch."""
    _, of = flown(RUBBER, rf.Drive(), STEEP)
    settled = [
        omitted_motion(of, how, rf.Drive(), FINGER, (RUBBER,) * 3, 1.0, 0.25).settling
        for how in ("rigid", "coarse", "explicit")
    ]
    assert settled[0] > 0.0
    assert settled[1:] == [0.0, 0.0]
