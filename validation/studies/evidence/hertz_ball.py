"""An elastic ball that hits a rigid wall squarely: Chung and Ooi (2011), test 2."""

import math
from collections.abc import Iterator

import numpy as np

from hcm.arrays import Floats
from validation.harness.store import Store
from validation.models.adapter import Progress
from validation.studies.evidence.ball import COARSER, Bounce, bounces
from validation.studies.evidence.rows import EvidenceRow

RADIUS, YOUNG, POISSON, DENSITY, SPEED = 0.1, 70e9, 0.3, 2699.0, 0.2  # m, Pa, -, kg/m^3, m/s
WAVE = math.sqrt(YOUNG / DENSITY)  # m/s
# Names, units, printed values, half a unit of their last digits, remarks.
LARGEST = (
    ("largest approach", "um", 49.7, 0.05, ""),
    ("largest force", "N", 11370.0, 5.0, ""),
    ("duration", "us", 732.0, 0.5, ""),
)
# Approach (um) and force (N) during loading, by their finite elements; taken to be known to 1 % of
# their figure's axis of 12 kN.
LOADING = ((12.01, 1303.0), (21.03, 3101.0), (32.04, 5865.0), (40.98, 8360.0), (49.99, 11326.0))
READING = 120.0
STIFFNESS = 4.0 / 3.0 * YOUNG / (1.0 - POISSON**2) * math.sqrt(RADIUS)  # Hertz, N/m^1.5
SNAPSHOTS = 200
STEPS = 5e-4  # relative error of hcm's numbers: two of its 4,000 steps


def _loads(bounce: Bounce) -> Floats:
    """Force at each published approach during loading, N; NaN where the ball turns before it."""
    upto = slice(int(np.argmax(bounce.approach)) + 1)
    places = [1e-6 * micro / RADIUS for micro, _ in LOADING]
    force = np.interp(places, bounce.approach[upto], bounce.force[upto], right=np.nan)
    return np.asarray(force * YOUNG * RADIUS**2)


def _largest(bounce: Bounce) -> Floats:
    """Largest approach, um, largest force, N, and duration, us."""
    touch = bounce.time[bounce.force > 0.0]
    lasts = float(touch[-1] - touch[0]) * RADIUS / WAVE
    depth, force = bounce.approach.max() * RADIUS, bounce.force.max() * YOUNG * RADIUS**2
    return np.array([1e6 * depth, force, 1e6 * lasts])


def rows(model: str, loading: bool, progress: Progress, _: Store) -> Iterator[EvidenceRow]:
    """The force at each published approach during loading; or the largest values.

    The error of the stiffness due to edges h under a patch of radius a goes as h/a, so as one over
    the root of the approach, and enters the largest values with the power 2/5: in both cases two
    meshes are compared over all numbers, since they may agree by chance at a single one. At an
    approach that a ball does not reach there is no number of ours.
    """
    progress(0.0, f"Hertz's ball, {model}")
    both = bounces(model, SPEED / WAVE, 0.0, POISSON, SNAPSHOTS)
    fine, coarse = map(_loads if loading else _largest, both)
    patch = np.sqrt([micro for micro, _ in LOADING]) if loading else np.ones(len(LARGEST))
    apart = float(np.sqrt(np.nanmean(((fine - coarse) / fine * patch) ** 2))) / (COARSER - 1.0)
    error = fine * (STEPS if model == "hcm" else apart / patch)
    loads = (
        (f"force at an approach of {micro:g} um", "N", stated, READING,
         f"Hertz {STIFFNESS * (1e-6 * micro) ** 1.5:.4g} N")
        for micro, stated in LOADING
    )  # fmt: skip
    given = zip(loads if loading else LARGEST, fine.tolist(), error.tolist(), strict=True)
    turns = f"; not reached: ours turns at {1e6 * RADIUS * both[0].approach.max():.4g} um"
    for (name, unit, stated, read, remark), ours, known in given:
        own = (None, None, remark + turns) if math.isnan(ours) else (ours, known, remark)
        yield EvidenceRow(name, unit, model, stated, read, *own)
