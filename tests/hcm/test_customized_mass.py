"""Masses with which a flight's vibrations keep time: waves, frequencies, a tap after a flight."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq

import hcm
from hcm.accuracy.coarser_run import ACCURACY_QUANTITIES
from hcm.arrays import Floats
from hcm.assumptions import Assumptions
from hcm.beam.chain import Chain
from hcm.beam.customized_mass import customized
from tests.hcm.cases import (
    SOFT,
    SOFT_TIP,
    SURFACE,
    finger,
    order_of,
    refined,
    timoshenko,
    transverse,
)

THICK = replace(SOFT, poisson_ratio=0.4)
BEAMS = (Assumptions(), Assumptions(shear=True), Assumptions(rotary_inertia=True),
         Assumptions(shear=True, rotary_inertia=True))  # fmt: skip
IDS = ("rigid sections", "shear", "rotary inertia", "both")


def body_of(elements: int, length: float) -> hcm.Finger:
    return hcm.Finger((replace(THICK, elements=elements, length=length),))


def consistent(elements: int, assumptions: Assumptions, length: float = SOFT.length) -> Chain:
    return refined(body_of(elements, length), assumptions)


def chain_of(elements: int, assumptions: Assumptions, length: float = SOFT.length) -> Chain:
    body = body_of(elements, length)
    return customized(refined(body, assumptions), body, assumptions)


def square_of(kappa: float, assumptions: Assumptions) -> float:
    """w^2 of that wave in an endless beam, shear by Hutchinson's coefficient (2001)."""
    nu, turning = 0.4, THICK.density * THICK.second_moment
    turning *= float(assumptions.has("rotary_inertia"))
    shear = 6 * (1 + nu) ** 2 / (7 + 12 * nu + 4 * nu**2) / (2 * (1 + nu))
    soft = 1.0 / (shear * THICK.youngs_modulus * THICK.area) if assumptions.has("shear") else 0.0
    return timoshenko(kappa, THICK.bending_stiffness, THICK.line_density, turning, soft)


def frequency_of_a_wave(chain: Chain, turn: float) -> float:
    """w^2 of the slower wave that turns by kappa l = `turn` an element, in an endless row."""
    away = np.vstack([np.eye(2), np.exp(1j * turn) * np.eye(2)])
    unit = np.array([1.0, 1.0 / chain.length[0], 1.0, 1.0 / chain.length[0]])
    stiff, mass = (m[0] * np.outer(unit, unit) for m in (chain.bending, chain.mass))
    row = [away.conj().T @ m @ away for m in (stiff, mass)]
    return float(eigh(*row, eigvals_only=True)[0])


@pytest.mark.parametrize("assumptions", BEAMS, ids=IDS)
def test_waves_in_a_long_row_are_the_beams_to_order_eight(assumptions: Assumptions) -> None:
    """At one length of element, as Phi and I/(A l^2) are then constant in the series in kappa l."""
    chain = chain_of(2, assumptions)
    length = float(chain.length[0])
    turns = np.array([0.25, 0.35, 0.5])
    errors = [
        abs(frequency_of_a_wave(chain, turn) / square_of(turn / length, assumptions) - 1)
        for turn in turns
    ]
    assert order_of(turns, errors) == pytest.approx(8, abs=0.5)


def hinged_frequencies(chain: Chain) -> Floats:
    """w (m,) of a beam on a hinge, its other end free, without its rigid turn."""
    stiff, mass = transverse(chain)
    squares: Floats = eigh(stiff[1:, 1:], mass[1:, 1:], eigvals_only=True)[1:]
    return np.sqrt(squares)


@pytest.mark.parametrize("elements", [3, 5, 12])
def test_frequencies_of_a_hinged_beam(elements: int) -> None:
    """tan b = tanh b, w = b^2/L^2 sqrt(E I/(rho A)): off by 5.5e-5 (kappa l)^6 at most up to a turn
    of 1.5 an element (measured), and less than by consistent masses.
    """
    roots = np.pi * (np.arange(1, 7) + 0.25)
    b = np.array([brentq(lambda x: np.tan(x) - np.tanh(x), r - 0.2, r + 0.2) for r in roots])
    wanted = (b / SOFT.length) ** 2 * np.sqrt(SOFT.bending_stiffness / SOFT.line_density)
    resolved = b / elements < 1.5
    assert resolved.any()
    error, plain = (
        np.abs(hinged_frequencies(chain)[: resolved.sum()] / wanted[resolved] - 1)
        for chain in (chain_of(elements, Assumptions()), consistent(elements, Assumptions()))
    )
    assert (error < 5.6e-5 * (b[resolved] / elements) ** 6).all()
    assert (error < plain / 5).all()


@pytest.mark.parametrize("assumptions", BEAMS[1::2], ids=IDS[1::2])
def test_frequencies_of_a_hinged_beam_with_shear(assumptions: Assumptions) -> None:
    """L/d = 4: off by (kappa l)^4/720 at most (of 64 elements, which are off by 1e-4 of that)."""
    fine = hinged_frequencies(chain_of(64, assumptions, 0.06))
    for elements in (4, 8):
        turns = np.pi * (np.arange(1, 4) + 0.25) / elements
        own = hinged_frequencies(chain_of(elements, assumptions, 0.06))[:3]
        plain = np.abs(
            hinged_frequencies(consistent(elements, assumptions, 0.06))[:3] / fine[:3] - 1
        )
        assert (np.abs(own / fine[:3] - 1) < np.minimum(turns**4 / 720, plain / 2))[turns < 2].all()


def test_five_elements_in_flight_are_as_good_as_twenty() -> None:
    """Peak, impulse, duration and arrival hang on a vibration of 8e-4 of the tap, in phase: five
    elements a phalanx leave 1.5e-6 of it, 20 consistent ones 0.5e-6 (to 44; measured).
    """
    settings = hcm.Settings(
        flight_integrator="gauss", flight_step=1e-4, flight_tolerance=1e-4, stages=8,
        contact_integrator="gauss", contact_step=5e-6, contact_tolerance=0.0, estimate=False,
        newton_tolerance=1e-7,
    )  # fmt: skip

    def tap(few: int) -> Floats:
        chosen = replace(settings, flight_elements=few)
        own = hcm.simulate(finger(SOFT, elements=20), SURFACE, SOFT_TIP, settings=chosen).summary
        return np.array([getattr(own, name) for name in ACCURACY_QUANTITIES])

    whole = tap(0)
    errors = {few: np.abs(tap(few) / whole - 1).max() for few in (2, 5)}
    assert errors[5] < 3e-6 < errors[2]
