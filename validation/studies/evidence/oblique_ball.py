"""An elastic ball that hits a rigid wall obliquely: Chung and Ooi (2011), test 5, and the theory.

x = v_t/(mu v_n), y = R w'/(mu v_n), e = 1, mu = 0.3.
"""

from collections.abc import Iterator
from itertools import starmap

import numpy as np

from validation.harness.store import Store
from validation.models.adapter import Progress
from validation.studies.evidence.ball import COARSER, bounces, by_elements, mesh_error
from validation.studies.evidence.mindlin import spin
from validation.studies.evidence.rows import EvidenceRow

# x, y from published finite elements; taken to be known to 1 % of the figure's axis.
POINTS = {
    0.318: 0.187, 0.595: 0.406, 0.890: 0.665, 1.185: 0.982, 1.532: 1.355, 1.896: 1.793,
    2.277: 2.321, 2.763: 2.856, 3.301: 3.441, 3.890: 4.041, 4.688: 4.569, 5.659: 4.941,
    9.040: 4.972,
}  # fmt: skip
READING = 0.05
BY_ELEMENTS = (0.890, 2.277, 4.688, 9.040)  # the points that the reference solves
POISSON, SPEED = 0.3, 1e-3  # v_n over a bar's wave
SMALL_SPEED = 1e-5  # where the patch is as small as the theory assumes
LIMIT_X, LIMIT_SPEEDS = 0.890, (3e-3, 1e-3, 3e-4)  # where the patch is extrapolated to zero
# Relative errors of y; hcm's has 22 of its springs under a patch of a/R = 0.013.
THEORY, SPRINGS = 1e-3, 2e-3


def _row(
    x: float, outside: float, error: float, model: str, speed: float, remark: str = ""
) -> EvidenceRow:
    ours, coarse = (bounce.spin for bounce in bounces(model, speed, x, POISSON))
    known = SPRINGS * ours if model == "hcm" else mesh_error(ours, coarse)
    name = f"R w'/(mu v_n) at x = {x:g}"
    return EvidenceRow(name, "1", model, outside, error, ours, known, remark)


def published_rows(model: str, progress: Progress, _: Store) -> Iterator[EvidenceRow]:
    """A model against the published values, with the theory's beside them."""
    places = BY_ELEMENTS if model == "fem3d" else tuple(POINTS)
    for number, x in enumerate(places):
        progress(number / len(places), f"oblique ball, {model}, x = {x:g}")
        theory = f"theory {spin(x, POISSON):.4g}"
        yield _row(x, POINTS[x], READING, model, SPEED, theory)


def theory_rows(progress: Progress, _: Store) -> Iterator[EvidenceRow]:
    """The law of hcm against the theory."""
    progress(0.0, "oblique ball, theory")
    for x in BY_ELEMENTS:
        yield _row(x, spin(x, POISSON), THEORY, "hcm", SMALL_SPEED)


def limit_rows(progress: Progress, _: Store) -> Iterator[EvidenceRow]:
    """The reference's spin with its patch extrapolated to zero, by a line in a/R.

    Its error is the difference from a parabola through the three points plus that from a coarser
    mesh's line; both meshes are coarser than in other rows, as small patches take many elements.
    """
    for poisson in (POISSON, 0.45):  # nearer to 0.5 steps get short
        lines = []
        for by in (COARSER, COARSER**2):
            progress(0.0, f"oblique ball, nu = {poisson}")
            tried = [by_elements(speed, LIMIT_X, poisson, coarser=by) for speed in LIMIT_SPEEDS]
            patch, y = np.array([(one.patch, one.spin) for one in tried]).T
            line, curve = (float(np.polynomial.Polynomial.fit(patch, y, n)(0.0)) for n in (1, 2))
            lines.append((line, curve, patch, y))
        (line, curve, patch, y), (coarse, *_others) = lines
        said = ", ".join(starmap("{:.3f} at a/R = {:.3f}".format, zip(y, patch, strict=True)))
        targets = {"theory of like bodies": (spin(LIMIT_X, poisson), THEORY)}
        if poisson == POISSON:
            targets["published"] = POINTS[LIMIT_X], READING
        error = abs(line - curve) + mesh_error(line, coarse)
        for which, target in targets.items():
            name = f"at x = {LIMIT_X:g}, nu = {poisson}, a/R to 0; {which}"
            yield EvidenceRow(name, "1", "fem3d", *target, line, error, said)
