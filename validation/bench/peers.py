"""Peers on hcm's scene, in the same run: which there are, and what each is measured with."""

import importlib.util
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from validation.bench import truths
from validation.bench.measured import Point, Quantities, errors
from validation.bench.timing import shortest
from validation.bench.work_precision import BASE, Rung
from validation.bench.work_precision import measure as measure_hcm

if TYPE_CHECKING:
    import pandas as pd

STUDY = "tap"
OWN_STUDY = "tap, peer's own truth"
BUDGET_S = 0.8
# Flight and contact step, s: Exudyn's cheapest setting first.
STEPS = ((1e-3, 1e-5), (5e-4, 3e-6), (3e-4, 1e-6), (1e-4, 1e-6), (1e-4, 3e-7), (3e-5, 3e-7))
QUICK_STEPS = STEPS[:4]
# What stands for Exudyn's own truth. Its curvature r' x r''/|r'|^2 leaves out the gradient of
# stretch that the paper's |r''| counts, so its error against hcm's truth has a floor that neither
# step nor mesh removes: 4.9e-4 of the peak; 1.0e-4, 3e-5 at a half and a quarter of the diameter.
OWN_TRUTH = (3e-5, 1e-7)
LOOK_BEFORE_S = 1e-4
LEVELS = (1e-3, 1e-4, 1e-5)  # relative errors at which the cheapest settings are compared


@dataclass(frozen=True)
class Cheapest:
    """The cheapest settings of hcm and a peer that keep peak and duration within an error.

    study : whether the peer's error is taken against hcm's truth or against its own.
    """

    study: str
    error: float
    hcm: Point | None
    peer: Point | None

    @property
    def ratio(self) -> float | None:
        """Peer's time over hcm's; None where one of them has no such setting."""
        if self.hcm is None or self.peer is None:
            return None
        return self.peer.wall_time_s / self.hcm.wall_time_s


def absent() -> list[str]:
    """Peers that are not installed, with how to get them."""
    found = []
    if importlib.util.find_spec("exudyn") is None:
        found.append("Exudyn (pip install 'fingertap[bench]')")
    return found


def _exudyn(
    steps: tuple[float, float], located: bool, truths_of: dict[str, Quantities]
) -> list[Point]:
    """One timed setting, as a point of each study."""
    from validation.bench import exudyn_finger

    flight, contact = steps
    given = truths.arguments(truths.TAP_ELEMENTS)
    series = "located contact" if located else "unlocated contact"
    setting = f"{truths.TAP_ELEMENTS} elements, flight step {flight:g}, contact step {contact:g}"
    try:
        timed = shortest(lambda: _tap(given, steps, located), BUDGET_S)
    except exudyn_finger.PeerFailedError as error:
        nothing = float("nan")
        return [Point(STUDY, "Exudyn", series, setting, str(error), nothing, 0)]
    tap: Any = timed.result
    return [
        Point(
            study, "Exudyn", series, setting, "COMPLETED", timed.wall_time_s, timed.runs,
            tap.steps, errors(tap.quantities, truth),
        )
        for study, truth in truths_of.items()
    ]  # fmt: skip


def _tap(given: dict[str, Any], steps: tuple[float, float], located: bool) -> Any:
    from validation.bench import exudyn_finger

    # a helping hand: it is told when to look for contact
    look = truths.TAP.values.contact_time_s - LOOK_BEFORE_S
    return exudyn_finger.tap(given, *steps, located, look)


def hcm_rungs(quick: bool) -> list[Rung]:
    """Error-controlled settings of hcm, cheapest first."""
    pairs = [(1e-6, 1e-8), (3e-7, 3e-9), (1e-7, 1e-9), (1e-8, 1e-10)]
    if not quick:
        pairs += [(1e-9, 1e-11), (1e-10, 1e-12)]
    return [
        Rung(STUDY, "tolerances", n, {**BASE, "flight_tolerance": f, "contact_tolerance": c})
        for n in (3, truths.TAP_ELEMENTS)
        for f, c in pairs
    ]


def measure_all(quick: bool, progress: Callable[[float, str], None]) -> list[Point]:
    """hcm, then every peer that is there."""
    truth = truths.TAP.values
    points = []
    rungs = hcm_rungs(quick)
    for number, rung in enumerate(rungs):
        progress(0.5 * number / len(rungs), f"hcm, {rung.setting}")
        points.append(measure_hcm(rung, truth, BUDGET_S))
    if importlib.util.find_spec("exudyn") is None:
        return points
    own: Any = _tap(truths.arguments(truths.TAP_ELEMENTS), OWN_TRUTH, located=True)
    compared = {STUDY: truth, OWN_STUDY: own.quantities}
    cases = [(steps, located) for located in (True, False)
             for steps in (QUICK_STEPS if quick else STEPS)]  # fmt: skip
    for number, (steps, located) in enumerate(cases):
        progress(0.5 + 0.5 * number / len(cases), f"Exudyn, {steps}")
        points += _exudyn(steps, located, compared)
    return points


def cheapest(points: list[Point]) -> list[Cheapest]:
    """For either truth and every level of error, hcm's and Exudyn's cheapest that reach it."""

    def best(solver: str, study: str, level: float) -> Point | None:
        good = [
            p for p in points
            if (p.solver, p.study) == (solver, study) and p.errors is not None
            and max(p.errors.peak, p.errors.duration) <= level
        ]  # fmt: skip
        return min(good, key=lambda p: p.wall_time_s, default=None)

    return [
        Cheapest(study, level, best("hcm", STUDY, level), best("Exudyn", study, level))
        for study in (STUDY, OWN_STUDY)
        for level in LEVELS
    ]


def cheapest_table(rows: list[Cheapest]) -> "pd.DataFrame":
    """One row a truth and level."""
    import pandas as pd

    def described(name: str, point: Point | None) -> dict[str, Any]:
        if point is None:
            return {f"{name}_time_s": None, f"{name}_setting": "none of those tried"}
        return {
            f"{name}_time_s": point.wall_time_s,
            f"{name}_setting": f"{point.series}: {point.setting}",
        }

    return pd.DataFrame(
        {
            "exudyn_against": "hcm.truth" if row.study == STUDY else "its own finest run",
            "error_of_peak_and_duration": row.error,
            **described("hcm", row.hcm),
            **described("exudyn", row.peer),
            "exudyn_over_hcm": row.ratio,
        }
        for row in rows
    )
