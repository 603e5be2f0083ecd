"""A run of CalculiX: what it prints, how it ended, when it is killed."""

from pathlib import Path

import pytest

from tests.validation.commands import Patch
from validation.peers import calculix, calculix_impact
from validation.peers.calculix import COMPLETED, NOT_CONVERGED, TIMED_OUT

# As version 2.20 prints two increments of a block of two nodes.
PRINTED = """
 total force (fx,fy,fz) for set FLOOR and time  0.1000000E-04

       -1.000000E+00  0.000000E+00  0.000000E+00

 velocities (vx,vy,vz) for set BODY and time  0.1000000E-04

         1  5.000000E-01 -1.000000E+00  0.000000E+00
         2  5.000000E-01 -1.000000E+00  0.000000E+00

 total force (fx,fy,fz) for set FLOOR and time  0.3000000E-04

       -1.000000E+00  1.622533E+00  3.950000E-18

 velocities (vx,vy,vz) for set BODY and time  0.3000000E-04

         1  5.000000E-01  1.250000E+00  0.000000E+00
         2  5.000000E-01 -1.250000E-03  0.000000E+00
"""


def test_what_it_prints_is_read() -> None:
    times, forces = calculix_impact.floor_forces(PRINTED)
    assert times.tolist() == [1e-5, 3e-5]
    assert forces.tolist() == [0.0, 1.622533]
    velocity = calculix_impact.last_velocities(PRINTED)
    assert velocity.tolist() == [[0.5, 1.25, 0.0], [0.5, -0.00125, 0.0]]


def test_nothing_printed_is_no_force() -> None:
    times, forces = calculix_impact.floor_forces("")
    assert times.size == forces.size == 0
    assert calculix_impact.last_velocities("") is None


@pytest.mark.parametrize(
    ("code", "said", "answer"),
    [
        (0, " Job finished\n", COMPLETED),
        (None, "", TIMED_OUT),
        (201, " *ERROR: too many cutbacks\n best solution and residuals", NOT_CONVERGED),
        (0, "no convergence", NOT_CONVERGED),
        (201, "x\n *ERROR in e_c3d: nonpositive jacobian\n", "stopped: *ERROR in e_c3d: nonpositive"
         " jacobian"),
        (-11, "", "stopped: exit code -11"),
    ],
)  # fmt: skip
def test_how_it_ended(code: int | None, said: str, answer: str) -> None:
    assert calculix.answer(code, said) == answer


def program(folder: Path, body: str) -> None:
    """A stand-in for ccx."""
    path = folder / calculix.PROGRAM
    path.write_text(f"#!/bin/sh\n{body}\n", encoding="ascii")
    path.chmod(0o755)


def test_a_run_that_takes_too_long_is_killed(tmp_path: Path, monkeypatch: Patch) -> None:
    (tmp_path / "printed").write_text(PRINTED, encoding="ascii")
    program(tmp_path, f"/bin/cp {tmp_path}/printed job.dat\nexec /bin/sleep 60")
    monkeypatch.setenv("PATH", str(tmp_path))
    ran = calculix.run_calculix("", timeout_s=0.5)
    assert (ran.answer, calculix_impact.floor_forces(ran.printed)[0].size) == (TIMED_OUT, 2)
