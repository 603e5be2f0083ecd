"""Where a rigid flight is not to be relied on, it says so; interrupts while it or the beams run."""

from dataclasses import replace
from typing import Any

import pytest

import hcm
from tests.hcm.cases import SOFT, SOFT_TIP, SURFACE, finger
from tests.processes import python

NAMES = ("peak_normal_force_N", "normal_impulse_N_s")


def change(elastic: hcm.TapResult, rigid: hcm.TapResult) -> float:
    return max(
        abs(getattr(rigid.summary, name) / getattr(elastic.summary, name) - 1) for name in NAMES
    )


# E A = 530 N: 60 rad/s stretch it by 1 mm, and the tap's peak is 22 % higher without that.
SPUN = {
    "finger": finger(SOFT, 1, length=0.12, youngs_modulus=3e6, elements=6), "surface": SURFACE,
    "tip": hcm.Tip(1e3), "drive": hcm.Drive(gravity=0.0), "start": hcm.RigidStart((0.0,), (60.0,)),
}  # fmt: skip
# Torques that cancel on a rod still bend it.
BENT = {
    "finger": hcm.Finger((replace(SOFT, diameter=0.004), SOFT)), "surface": hcm.Surface(0.06, 0.5),
    "tip": SOFT_TIP, "drive": hcm.Drive((0.002, 0.002), reaction=True),
}  # fmt: skip


@pytest.mark.parametrize(("scene", "least"), [(SPUN, 0.1), (BENT, 0.01)], ids=["spun", "bent"])
def test_a_finger_that_deforms_on_its_way_is_too_flexible(scene: Any, least: float) -> None:
    elastic, rigid = (
        hcm.simulate(**scene, settings=hcm.Settings(flight=flight))
        for flight in ("elastic", "rigid")
    )
    assert change(elastic, rigid) > least
    assert rigid.status is hcm.Status.TOO_FLEXIBLE


@pytest.mark.parametrize("end", [0.06, None])
def test_steps_too_long_for_the_rods_are_shortened(end: float | None) -> None:
    """From rest the torques would turn a rod by more than a step may, within the first one: the
    audit was off by over 10 %. Steps of 0.6 rad of order 5 leave some 1e-4 each.
    """
    coarse = hcm.Settings(flight="rigid", flight_tolerance=0.0, flight_step=0.01, end_time=end)
    run = hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, hcm.Drive((0.2, 0.0, 0.08)), coarse)
    # on to the touch the beams would bend too much
    assert run.status is (hcm.Status.COMPLETED if end else hcm.Status.TOO_FLEXIBLE)
    assert run.summary.energy_residual < 5e-3


CHILD = """
import os, signal, threading
import hcm
signal.signal(signal.SIGINT, signal.default_int_handler)
finger = hcm.Finger((hcm.Phalanx(0.04, 0.015, 1e9, 1400.0, 5),) * 3)
surface, tip = hcm.Surface(0.1, 0.5), hcm.Tip(0.78e6)
hcm.simulate(finger, surface, tip, settings=hcm.Settings(flight={flight!r}))
threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
endless = hcm.Settings(flight_step=1e-6, flight_tolerance=0, flight={flight!r}, max_steps=4_000_000)
print(hcm.simulate(finger, surface, tip, hcm.Drive(gravity=-9.8), endless).status.name)
"""


@pytest.mark.parametrize("flight", ["elastic", "rigid"])
def test_an_interrupt_while_compiled_code_runs_keeps_the_process(flight: str) -> None:
    # it is pending until the results are made: two named tuples among them were a segfault
    child = python("-c", CHILD.format(flight=flight), timeout=300)
    assert (child.returncode, child.stdout.strip()) == (0, "INTERRUPTED"), child.stderr
