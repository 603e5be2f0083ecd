"""SciPy's defaults on a tap."""

from dataclasses import replace

import hcm
from tests.validation.studies.stress.taps import SOFT, TAP
from validation.peers.scipy_ivp import solve_first_tap
from validation.studies.stress.hcm.hard_cells import peak_and_impulse
from validation.studies.stress.judging import largest_difference


def test_a_users_solve_ivp_taps() -> None:
    """SciPy's defaults find the tap of a soft rod, a few per cent off."""
    soft = replace(TAP, finger=hcm.Finger((replace(SOFT, youngs_modulus=1e7, elements=1),)),
                   tip=hcm.Tip(1e4))  # fmt: skip
    ending, tap = solve_first_tap(soft, 60.0)
    assert ending == "completed"
    own = peak_and_impulse(hcm.simulate_scene(soft))
    assert largest_difference(tap, own) < 0.5
    assert solve_first_tap(soft, 1e-9)[1] is None
