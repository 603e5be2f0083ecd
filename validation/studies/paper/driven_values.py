"""Values of the driven cases for each of the article's claims in figs. 13 to 16."""

from collections.abc import Callable

import numpy as np

from validation.studies.paper import readings
from validation.studies.paper.case_runs import CaseRun
from validation.studies.paper.driven_cases import PRINTED_TORQUES
from validation.studies.paper.readings import CaseRuns

ONE, TWO, THREE = PRINTED_TORQUES
STRESSES = {"F14.5": ONE, "F14.6": TWO, "F14.7": THREE}
CONCAVE = {"F13.4": (ONE, True), "F13.5": (TWO, True), "F13.6": (THREE, False)}


def first_peak(run: CaseRun) -> float:
    """First peak of F_n, N."""
    return run.record.value("first_peak_normal_force_N") or float("nan")


def first_tangential_peak(run: CaseRun) -> float:
    """Largest |F_t| up to the first restitution, N."""
    time, force = readings.curve(run, "tangential_force_N")
    turn = readings.event_times(run, "compression_to_restitution")[0]
    return float(np.abs(force[time <= turn]).max())


RATIOS: dict[str, tuple[str, Callable[[CaseRun], float]]] = {
    "F14.1": (TWO, first_peak),
    "F14.2": (TWO, first_tangential_peak),
    "F15.1": (TWO, readings.largest_deflection),
    "F15.2": (THREE, readings.largest_deflection),
}


def ratio(runs: CaseRuns, over: str, key: Callable[[CaseRun], float], suffix: str = "") -> float:
    """A case's reading over that of case 1."""
    return key(runs[over + suffix]) / key(runs[ONE + suffix])


def stress_MPa(run: CaseRun) -> float:
    """Largest stress at R, MPa."""
    return 1e-6 * readings.largest_stress(run)


def driven_values(runs: CaseRuns) -> dict[str, float | bool]:
    """Values by claim, from the cases that `runs` holds under the scenes' names."""
    three = runs[THREE]
    _, tangential = readings.curve(three, "tangential_force_N")
    return {
        "F13.1": readings.scalar(runs, ONE, "contact_time_s"),
        "F13.2": readings.scalar(runs, TWO, "contact_time_s"),
        "F13.3": readings.scalar(runs, THREE, "contact_time_s"),
        **{
            id_: runs[case].event_postures[0].is_concave == concave
            for id_, (case, concave) in CONCAVE.items()
        },
        **{id_: ratio(runs, case, key) for id_, (case, key) in RATIOS.items()},
        "F14.3": readings.transitions(three),
        "F14.4": bool(tangential.min() < 0 < tangential.max()),
        **{id_: stress_MPa(runs[case]) for id_, case in STRESSES.items()},
        "F15.3": all(
            readings.deflection_peaks_after_first_restitution(runs[case])
            for case in PRINTED_TORQUES
        ),
        "F16.1": not readings.sticks(runs[ONE]),
        "F16.2": not readings.sticks(runs[TWO]),
        "F16.3": readings.slip_to_stick(three),
        "F16.4": readings.slips(three)[:4] == [1, -1, 1, -1],
    }
