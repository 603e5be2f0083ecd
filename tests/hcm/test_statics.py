"""Static equilibrium: the cantilever of Bisshopp and Drucker, and the joint torque."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

import hcm
from hcm.assembly.equations import residual
from hcm.assembly.statics import equilibrium
from hcm.beam.chain import build_chain
from hcm.beam.joint_torque import torque_force, torque_tangent, turned_angle
from hcm.contact.law import IN_FLIGHT, ContactLaw
from hcm.results.posture import Posture
from tests.hcm.cases import SOFT, finger

LAW = ContactLaw(1.0, 1.0, 0.75, 0.0, 10.0)

# P L^2/(E I): w/L, u/L (Bisshopp and Drucker 1945)
PRINTED = {
    1: (0.30172, 0.05643),
    2: (0.49346, 0.16064),
    5: (0.71379, 0.38763),
    10: (0.81061, 0.55500),
}


def elastica(load: float) -> tuple[float, float]:
    """(w/L, u/L) of the inextensible cantilever, Bisshopp and Drucker (1945), eqs. 4-12."""

    def modulus(tip_angle: float) -> tuple[float, float]:
        k2 = (1 + np.sin(tip_angle)) / 2
        return k2, np.arcsin(1 / np.sqrt(2 * k2))

    def length(tip_angle: float) -> float:
        k2, phi = modulus(tip_angle)
        return ellipk(k2) - ellipkinc(phi, k2) - np.sqrt(load)

    angle = brentq(length, 1e-9, np.pi / 2 - 1e-9, xtol=1e-15)
    k2, phi = modulus(angle)
    down = 1 - 2 * (ellipe(k2) - ellipeinc(phi, k2)) / np.sqrt(load)
    return down, 1 - np.sqrt(2 * np.sin(angle) / load)


def cantilever(load: float, elements: int) -> tuple[float, float]:
    """(w/L, u/L) with all four coordinates of the first node held."""
    # E A L^2/(E I) = 16 (L/d)^2 = 1.6e7: the elastica's axial force stretches by load/1.6e7
    phalanx = hcm.Phalanx(1.0, 1e-3, 1e12, 1.0, elements)
    chain, q = build_chain(hcm.Finger((phalanx,)), hcm.Drive(gravity=0.0))
    weight = np.zeros(q.size)
    weight[chain.tip + 1] = -load * phalanx.youngs_modulus * phalanx.second_moment
    q = equilibrium(chain, q, np.arange(6), weight)
    return -q[chain.tip + 1], 1 + q[chain.tip]


@pytest.mark.parametrize("load", PRINTED)
def test_elastica_agrees_with_the_printed_values(load: int) -> None:
    np.testing.assert_allclose(elastica(load), PRINTED[load], atol=0.6e-5)


@pytest.mark.parametrize("load", PRINTED)
def test_cantilever_reaches_the_elastica(load: int) -> None:
    # the remaining stretch (up to 10/1.6e7) and the last mesh error, 1e-7 at load 2
    np.testing.assert_allclose(cantilever(load, 64), elastica(load), atol=1e-5, rtol=0)


def test_cantilever_order() -> None:
    """Cubic deflections: a displacement converges with l^4, and faster while locking fades."""
    exact = np.array(elastica(2))
    sizes = (16, 32, 64)
    errors = [np.abs(np.array(cantilever(2, n)) - exact).max() for n in sizes]
    order = -np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    assert order > 3.9, (order, errors)


def test_torque_is_the_gradient_of_its_work() -> None:
    tau, slope, step = 0.7, np.array([-0.8, 0.55]), 1e-6
    work = [
        tau * (turned_angle(*slope, *(slope + d)) - turned_angle(*slope, *(slope - d))) / (2 * step)
        for d in step * np.eye(2)
    ]
    np.testing.assert_allclose(torque_force(tau, *slope), work, rtol=1e-9)


def test_torque_tangent() -> None:
    tau, slope, step = 0.7, np.array([-0.8, 0.55]), 1e-6
    columns = [
        (np.array(torque_force(tau, *(slope + d))) - torque_force(tau, *(slope - d))) / (2 * step)
        for d in step * np.eye(2)
    ]
    dxx, dxy = torque_tangent(tau, *slope)
    np.testing.assert_allclose([[dxx, dxy], [dxy, -dxx]], np.transpose(columns), rtol=1e-8)


def test_work_of_a_torque_through_a_full_turn() -> None:
    angles = np.linspace(0, 2 * np.pi, 8)
    stretch = np.linspace(1, 1.3, 8)  # a stretch does no work
    slopes = stretch[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    turned = sum(turned_angle(*a, *b) for a, b in pairwise(slopes))
    assert turned == pytest.approx(2 * np.pi, rel=1e-14)


@pytest.mark.parametrize("reaction", [False, True])
def test_torques_act_on_first_nodes_and_react_only_when_asked(reaction: bool) -> None:
    drive = hcm.Drive((0.3, 0.5), gravity=0.0, reaction=reaction)
    chain, q = build_chain(finger(SOFT, 2, elements=2), drive)
    out = np.zeros(q.size)
    residual(q, np.zeros(q.size), np.zeros(q.size), chain, IN_FLIGHT, LAW, out)
    # slopes (-1, 0): the generalized force of tau is (0, -tau), and the residual its negative
    expected = np.zeros(q.size)
    expected[chain.hinge_outer[0] + 3] += 0.3
    expected[chain.hinge_outer[1] + 3] += 0.5
    if reaction:
        expected[chain.hinge_inner[1] + 3] -= 0.5
    np.testing.assert_allclose(out, expected, atol=1e-9)


def test_no_equilibrium_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hcm.assembly.statics.ITERATIONS", 1)
    with pytest.raises(ArithmeticError, match=r"no equilibrium at 0\.05 of the load"):
        cantilever(2, 4)


def test_deflection_is_positive_away_from_the_surface() -> None:
    places = np.array([[0.0, 0.0], [-0.02, 1e-3], [-0.04, 0.0]])
    slopes = np.tile([-1.0, 0.0], (3, 1))
    along, off = Posture(0.0, (places,), (slopes,)).deflection(0)
    assert along == pytest.approx([0.0, 0.02, 0.04])
    assert off == pytest.approx([0.0, 1e-3, 0.0])
