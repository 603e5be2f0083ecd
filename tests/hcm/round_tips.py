"""A refined finger's round tip alone, pressed on the surface and moved along it."""

import numpy as np

import hcm
from hcm.arrays import Floats
from hcm.assumptions import Assumptions
from hcm.contact import round_tip_kinematics, round_tip_law, tip_compliance, tip_damping
from hcm.contact.build import law_of
from hcm.contact.law import COMPRESSION, IN_FLIGHT, SLIP, STICK, ContactState
from hcm.contact.round_tip import RoundTipLaw

R, E, NU, MU = 0.0075, 1e9, 0.3, 0.5
BALL = 1400.0 * 4 / 3 * np.pi * R**3  # kg
TOUCH = ContactState(COMPRESSION, STICK, 0.0, 0.0, 0.0, 0.0)


def law(restitution: float = 1.0, mu: float = MU, nu: float = NU, **switches: bool) -> RoundTipLaw:
    """A tip on a surface through the origin's height below its centre, R."""
    body = hcm.Finger((hcm.Phalanx(0.04, 2 * R, E, 1400.0, 4, poisson_ratio=nu),))
    off = dict.fromkeys(
        ("tip_compliance", "deforming_tip", "growing_patch", "radiating_tip"), False
    )
    on = Assumptions("refined", **{**off, **switches})
    found = law_of(body, hcm.Surface(0.02, mu), hcm.Tip(1e6, restitution), on)
    assert isinstance(found, RoundTipLaw)
    return found._replace(height=-R)


def at(x: float, depth: float, angle: float = -0.7) -> Floats:
    """Coordinates of a tip that is pressed in by `depth`, its phalanx turned from -X by -angle."""
    return np.array([x, R - depth, -np.cos(angle), np.sin(angle)])


def press(tip: RoundTipLaw, contact: ContactState, q: Floats) -> tuple[float, float]:
    """Forces at q, which is committed."""
    x, gap = tip_compliance.contact_position(q, 0, contact, tip)
    force = round_tip_law.contact_force(x, gap, contact, tip)
    round_tip_kinematics.commit_history(q, 0, contact, tip)
    return force


def touched(tip: RoundTipLaw, angle: float = -0.7) -> RoundTipLaw:
    """The tip as its touch begins."""
    round_tip_kinematics.begin_mode(at(0.0, 0.0, angle), 0, IN_FLIGHT, TOUCH, tip)
    return tip


def bounce(tip: RoundTipLaw, speed: float) -> tuple[float, float]:
    """What a ball that falls on this tip loses by rates, J, and its kinetic energy as it leaves."""
    y, v, step, lost = 0.0, -speed, 2e-8, 0.0
    contact = TOUCH._replace(tangential_mode=SLIP, slip_sign=1.0)
    while y <= 0.0:
        half = v
        for _ in range(3):  # the force depends on the speed: the midpoint rule, iterated
            q, rate = at(0.0, -(y + 0.5 * step * half)), np.array([0.0, half, 0.0, 0.0])
            force = tip_damping.tip_force(q, rate, 0, contact, tip)[1]
            half = v + 0.5 * step * force / BALL
        lost += step * tip_damping.rate_power(q, rate, 0, contact, tip)
        y, v = y + step * half, v + step * force / BALL
    return lost, 0.5 * BALL * v**2
