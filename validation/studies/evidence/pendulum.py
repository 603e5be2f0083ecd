"""PyElastica's swinging flexible pendulum: a hinged rod, let go from the horizontal.

hcm's beam is integrated by `hcm.reference_solution` to a tolerance of 1e-8: the error is that of
its elements. PyElastica's staggered grid is of second order (40, 80, 160 elements: 4.3 to 1); two
are extrapolated.
"""

from collections.abc import Iterator

import numpy as np

import hcm
from hcm.arrays import Floats
from hcm.assembly.statics import NOWHERE
from hcm.beam.chain import build_chain
from hcm.reference_solution import ChainStart, solve_chain
from validation.harness.provenance import installed
from validation.harness.store import Store
from validation.models.adapter import Progress
from validation.studies.evidence.rows import EvidenceRow

LENGTH, RADIUS, DENSITY, POISSON, GRAVITY = 1.0, 5e-3, 1100.0, 0.5, 9.80665
YOUNGS = (5e6, 5e7)  # Pa; the example's, and a rod of a tenth of its axial strain
TIMES = np.array([0.5, 1.0])
OURS, THEIRS = (20, 40), (80, 160)  # elements; the coarser's error bounds our finer's
RTOL, ATOL = 1e-8, 1e-12


def by_hcm(young: float, elements: int) -> Floats:
    """Tip position (n, 2) at `TIMES`, m."""
    rod = hcm.Phalanx(LENGTH, 2.0 * RADIUS, young, DENSITY, elements)
    chain, rest = build_chain(hcm.Finger((rod,)), hcm.Drive(gravity=GRAVITY))
    now, found = ChainStart(rest, np.zeros_like(rest)), []
    for time in TIMES.tolist():
        now = solve_chain(chain, NOWHERE, now, RTOL, ATOL, end_time=time).end
        found.append(now.coordinates[chain.tip : chain.tip + 2])
    return np.array(found)


def rows(progress: Progress, _: Store) -> Iterator[EvidenceRow]:
    """Both coordinates of the tip at both times, for both stiffnesses."""
    from validation.peers.pyelastica_pendulum import swing

    for young in YOUNGS:
        progress(0.0, f"PyElastica's pendulum, E {young:g} Pa")
        body = LENGTH, RADIUS, DENSITY, young, POISSON, GRAVITY
        half, whole = (swing(*body, elements, TIMES) for elements in THEIRS)
        last = (whole - half) / 3.0  # for an error that falls with the square of an edge
        progress(0.5, f"the pendulum by hcm, E {young:g} Pa")
        coarse, ours = (by_hcm(young, n) for n in OURS)
        error, outside = np.abs(ours - coarse), whole + last
        names = [f"{axis} of the tip at {time:g} s" for time in TIMES for axis in "xy"]
        numbers = np.stack([outside, np.abs(last), ours, error], axis=-1).reshape(-1, 4)
        for name, (theirs, known, own, off) in zip(names, numbers.tolist(), strict=True):
            remark = f"{1e3 * (own - theirs):+.2g} mm"
            name += f", E {young:g} Pa"
            yield EvidenceRow(name, "m", "hcm", theirs, known, own, off, remark)


def absent() -> str:
    """Why it cannot be run; empty if it can."""
    missing = "PyElastica is not installed: pip install 'fingertap[bench]'"
    return "" if installed("elastica") else missing
