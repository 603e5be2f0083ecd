"""Where a rigid flight is not to be relied on, it says so; interrupts while it or the beams run."""

import subprocess
import sys

import pytest

import hcm
from tests.hcm.cases import SOFT, SOFT_TIP, SURFACE, finger

NAMES = ("peak_normal_force_N", "normal_impulse_N_s")


def change(elastic: hcm.TapResult, rigid: hcm.TapResult) -> float:
    return max(
        abs(getattr(rigid.summary, name) / getattr(elastic.summary, name) - 1) for name in NAMES
    )


def test_a_finger_that_its_spin_stretches_is_too_flexible() -> None:
    # E A = 530 N: 60 rad/s stretch it by 1 mm, and the tap's peak is 22 % higher without that
    rod = hcm.Finger((hcm.Phalanx(0.12, 0.015, 3e6, 1400.0, 6),))
    spun, still = hcm.RigidStart((0.0,), (60.0,)), hcm.Drive(gravity=0.0)
    elastic, rigid = (
        hcm.simulate(rod, SURFACE, hcm.Tip(1e3), still, hcm.Settings(flight=flight), start=spun)
        for flight in ("elastic", "rigid")
    )
    assert change(elastic, rigid) > 0.1
    assert rigid.status is hcm.Status.TOO_FLEXIBLE


def test_torques_that_cancel_on_a_rod_still_bend_it() -> None:
    thin = hcm.Finger(
        (hcm.Phalanx(0.04, 0.004, 1e9, 1400.0, 5), hcm.Phalanx(0.04, 0.015, 1e9, 1400.0, 5))
    )
    drive, low = hcm.Drive((0.002, 0.002), reaction=True), hcm.Surface(0.06, 0.5)
    elastic, rigid = (
        hcm.simulate(thin, low, SOFT_TIP, drive, hcm.Settings(flight=flight))
        for flight in ("elastic", "rigid")
    )
    assert change(elastic, rigid) > 0.01
    assert rigid.status is hcm.Status.TOO_FLEXIBLE


@pytest.mark.parametrize("end", [0.06, None])
def test_steps_too_long_for_the_rods_are_no_result(end: float | None) -> None:
    coarse = hcm.Settings(flight="rigid", flight_tolerance=0.0, flight_step=0.01, end_time=end)
    run = hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, hcm.Drive((0.05, 0.0, 0.02)), coarse)
    assert run.status is hcm.Status.UNBALANCED
    assert not run.summary.energy_residual <= 0.1


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
    child = subprocess.run(
        [sys.executable, "-c", CHILD.format(flight=flight)],
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert (child.returncode, child.stdout.strip()) == (0, "INTERRUPTED"), child.stderr
