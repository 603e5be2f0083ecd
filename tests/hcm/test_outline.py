"""What of the body is below the surface: against dense sections, and runs that end there."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hcm
from hcm.beam.outline import PARTS, build_outline, depth
from hcm.flight.rigid_chain import build_rods
from hcm.model import build_model
from hcm.results.posture import Postures, node_places
from hcm.start import start_beams
from tests.hcm.cases import HARD, HARD_TIP, SOFT, SURFACE, finger, straight_links

R = HARD.diameter / 2
BENT = 0.3
FLIGHTS: list[dict[str, str]] = [{}, {"flight": "rigid"}, {"flight_integrator": "gauss"}]


def depth_by_sections(body: hcm.Finger, posture: hcm.Posture, height: float) -> float:
    """The definition, on 400 sections an element: r(s) and r'(s) by Hermite's polynomials."""
    deepest, tip = 0.0, float(posture.positions_m[-1][-1, 1])
    s = np.linspace(0.0, 1.0, 401)[:, None]
    for w, phalanx in enumerate(body.phalanges):
        r, g, el = posture.positions_m[w], posture.slopes[w], phalanx.length / phalanx.elements
        for i in range(phalanx.elements):
            a, b, p, q = r[i], r[i + 1], el * g[i], el * g[i + 1]
            at = a + s * p + s**2 * (3 * (b - a) - 2 * p - q) + s**3 * (2 * (a - b) + p + q)
            d = p + 2 * s * (3 * (b - a) - 2 * p - q) + 3 * s**2 * (2 * (a - b) + p + q)
            reach = phalanx.diameter / 2 * np.abs(d[:, 0]) / np.linalg.norm(d, axis=1)
            low = at[:, 1] - reach
            if w == len(body.phalanges) - 1:
                root = -height - low[0] if i == 0 else 0.0
                deepest = max(deepest, root, float((min(-height, tip) - at[:, 1]).max()))
            else:
                deepest = max(deepest, float((-height - low).max()))
    return deepest


@pytest.mark.parametrize("seed", range(8))
def test_depth_is_that_of_the_lowest_section(seed: float) -> None:
    rng = np.random.default_rng(seed)
    body = hcm.Finger((HARD, replace(SOFT, diameter=0.01, elements=2), replace(HARD, elements=3)))
    angles = np.pi + rng.uniform(-0.5, 0.9, 3)
    chain, state = straight_links(body, angles, np.zeros(3))
    q = state.coordinates.copy()
    for place in {*chain.first.tolist(), *chain.second.tolist()}:
        turn = rng.uniform(-BENT, BENT)
        c, s = np.cos(turn), np.sin(turn)
        q[place + 2 : place + 4] = np.array([[c, -s], [s, c]]) @ q[place + 2 : place + 4]
    posture = Postures((0.0,), node_places(chain), q[None])[0]
    found = []
    # a cubic's curvature is at most 6 BENT/l where both slopes turn
    missed = max(6 * BENT * el / 8 / PARTS**2 for el in chain.length) * (1 + R / 0.008)
    for height in np.linspace(0.005, 0.11, 15):
        wanted = depth_by_sections(body, posture, height)
        below, element, _ = depth(q, chain, build_outline(body, height))
        assert wanted - missed <= below <= wanted + 1e-15
        assert (element >= 0) == (below > 0.0)
        found.append(below)
    assert min(found) == 0.0 < max(found)


def test_an_element_sags_between_its_nodes() -> None:
    """Slopes of -s and s at its ends, on one height, sag by s l/4 in the middle."""
    body = finger(HARD, 2, elements=1)
    chain, state = straight_links(body, np.array([np.pi, 0.5 * np.pi]), np.zeros(2))
    state.coordinates[chain.first[0] + 3], state.coordinates[chain.second[0] + 3] = -BENT, BENT
    lowest = BENT * HARD.length / 4 + R
    outline = build_outline(body, lowest - 1e-3)
    below, element, x = depth(state.coordinates, chain, outline)
    assert (element, x) == (0, pytest.approx(-HARD.length / 2))
    assert below == pytest.approx(1e-3, rel=1e-12)
    assert depth(state.coordinates, chain, build_outline(body, lowest + 1e-9))[1] == -1


def test_the_tip_itself_may_be_below() -> None:
    body = finger(HARD, 1)
    chain, state = straight_links(body, np.array([np.pi + 0.4]), np.zeros(1))
    below = HARD.length * np.sin(0.4) - 1e-3
    assert depth(state.coordinates, chain, build_outline(body, below))[0] == 0.0


FREE = ()
PUSHED = (-0.2, 0.0, 0.02)


@pytest.mark.parametrize(
    ("torques", "height", "tip", "flight", "touches"),
    [
        *((FREE, 0.01, HARD_TIP, flight, []) for flight in FLIGHTS),
        *((PUSHED, 0.05, HARD_TIP, flight, []) for flight in FLIGHTS),
        (FREE, 0.08, hcm.Tip(500.0), FLIGHTS[1], ["contact"]),
        (FREE, 0.08, hcm.Tip(1e4, 0.3), FLIGHTS[1], ["contact", "separation"]),
    ],
)
def test_a_run_ends_where_its_body_reaches_the_surface(
    torques: tuple[float, ...], height: float, tip: hcm.Tip, flight: Any, touches: list[str]
) -> None:
    """Above the surface in every frame but that at the end, which is one step through it."""
    scene = finger(HARD), hcm.Surface(height, 0.5), tip, hcm.Drive(torques)
    settings = hcm.Settings(end_time=0.2, estimate=False, **flight)
    ended = hcm.simulate(*scene, settings)
    assert ended.status is hcm.Status.BODY_TOUCHES
    assert [e.kind for e in ended.events if e.kind in ("contact", "separation")] == touches
    before, end = np.unique(ended.history.time_s)[-2:].tolist()
    times = (*np.linspace(0.0, before, 100).tolist(), end)
    seen = hcm.simulate(*scene, replace(settings, frame_times=times))
    *above, below = [depth_by_sections(scene[0], frame, height) for frame in seen.frames]
    assert len(above) == 100
    # 1e-5: what PARTS leave of a bent element's curve; 10 m/s: the fastest section comes with 6.1
    assert max(above) < 1e-5
    assert 0.0 < below < 10.0 * (end - before)


@pytest.mark.parametrize("count", [1, 3])
def test_a_surface_that_cuts_the_finger_at_rest_is_refused(count: int) -> None:
    with pytest.raises(hcm.ParameterError, match=r"height = 0\.001: the surface cuts 0\.0065 m"):
        hcm.simulate(finger(HARD, count), replace(SURFACE, height=0.001), HARD_TIP)


def test_rods_that_a_body_stops_have_the_drive_of_that_moment() -> None:
    """Torques that grow with time from zero: those of a later end would be larger."""
    body, surface = finger(HARD), hcm.Surface(0.05, 0.5)
    table = hcm.TorqueTable((0.0, 1.0), ((0.0, 0.0, 0.0), (-2.0, 0.0, 0.2)))
    drive, settings = hcm.Drive(table=table), hcm.Settings(flight="rigid")
    model = build_model(hcm.Scene(body, surface, HARD_TIP, drive, settings))
    begun = start_beams(model, build_rods(body, surface, drive))
    assert begun.status is hcm.Status.BODY_TOUCHES
    torques, rates = begun.motion.drive
    assert rates.all()
    np.testing.assert_allclose(torques, begun.segment.totals.time * rates, rtol=1e-12)


@pytest.mark.parametrize("thick", [1, 2])
def test_a_body_that_touches_is_named_by_its_phalanx(thick: int) -> None:
    """The thicker one at the hinge that two share, counted from 1, and where that hinge is."""
    phalanges = [replace(HARD, diameter=0.02 if w == thick else 0.01) for w in (1, 2)]
    start = hcm.RigidStart((0.3, -0.3), (5.0, 5.0))
    settings = hcm.Settings(flight="rigid", estimate=False)
    surface = hcm.Surface(0.04 * math.sin(0.3) + 0.0105, 0.5)
    run = hcm.simulate(
        hcm.Finger(tuple(phalanges)), surface, HARD_TIP, settings=settings, start=start
    )
    assert run.status is hcm.Status.BODY_TOUCHES
    assert f": phalanx {thick} is " in run.message
    # the section's end is its radius times the sine of its tilt off the hinge
    x = float(run.message.split("X = ")[1].removesuffix(" m"))
    assert abs(x + 0.04 * math.cos(0.3)) < 0.01 * math.sin(0.5)
