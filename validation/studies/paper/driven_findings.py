"""Section 4.3, figs. 13 to 16: the driven cases, with the identified t_3 factor.

The torques act at once on a finger without damping: what follows rings at every frequency that the
mesh holds. Readings that depend on that ringing are given with their variations (`driven_cases`).
"""

from collections.abc import Callable

import numpy as np

from validation.compare.claims import Claim, read_claims
from validation.studies.paper import readings
from validation.studies.paper.case_runs import CaseRun
from validation.studies.paper.driven_cases import PRINTED_TORQUES, VARIED
from validation.studies.paper.ledger import Finding, printed_rounding
from validation.studies.paper.readings import Runs
from validation.studies.paper.torque_factor import IdentifiedTorque

FIRST = "first_peak_normal_force_N"
ONE, TWO, THREE = PRINTED_TORQUES
ARROW = {1: "right", -1: "left", 0: "stick"}


def _varied(read: Callable[[str], object]) -> str:
    """A reading under each variation, as text; ``read`` takes the case's suffix."""
    parts = []
    for label in VARIED:
        value = read(f" {label}")
        parts.append(f"{label} {value:.4g}" if isinstance(value, float) else f"{label} {value}")
    return "; ".join(parts)


def _ratio(runs: Runs, over: str, key: Callable[[CaseRun], float]) -> Callable[[str], float]:
    return lambda suffix: key(runs[over + suffix]) / key(runs[ONE + suffix])


def _stress(runs: Runs, case: str) -> Callable[[str], float]:
    return lambda suffix: 1e-6 * readings.largest_stress(runs[case + suffix])


def _first_peak(run: CaseRun) -> float:
    return run.record.value(FIRST) or float("nan")


def _first_tangential_peak(run: CaseRun) -> float:
    time, force = readings.curve(run, "tangential_force_N")
    turn = readings.event_times(run, "compression_to_restitution")[0]
    return float(np.abs(force[time <= turn]).max())


def duration_ms(run: CaseRun) -> float:
    """How long the first tap lasts."""
    return 1e3 * (run.record.value("contact_duration_s") or float("nan"))


def _band(read: Callable[[str], float], claim: Claim) -> str:
    """The reading over the factor's uncertainty, and whether the print lies inside."""
    values = [read(suffix) for suffix in (" low", "", " high")]
    low, high, rounding = min(values), max(values), printed_rounding(claim.paper_value)
    inside = low - rounding <= claim.number <= high + rounding
    return (
        f"over the factor's uncertainty {low:.4g} to {high:.4g}, the printed value"
        f" {'inside' if inside else 'outside'}"
    )


def _arrivals(runs: Runs, found: IdentifiedTorque) -> dict[str, Finding]:
    numerics = "; ".join(
        f"{name}: factor {fit.factor:.4g}, {fit.misfit_percent:.2g} %"
        for name, fit in found.by_numerics.items()
    )
    rows = {}
    for id_, case in (("F13.1", ONE), ("F13.2", TWO), ("F13.3", THREE)):
        own = found.by_case[case]
        text = (
            f"alone it asks for {own.factor:.4g} +- {own.half_width:.1g}"
            if own.factor is not None and own.half_width is not None
            else f"alone it fixes nothing: no factor brings it there, the nearest is"
            f" {1e3 * own.best_time_s:.3f} ms at {own.best_factor:.3g}"
        )
        rows[id_] = Finding(
            readings.scalar(runs, case, "contact_time_s"),
            "the t_3 factor was identified from these times, which it misses by"
            f" {found.common.misfit_percent:.2g} % (rms); {text}; with the article's numerics"
            f" {numerics}",
        )
    return rows


def driven_findings(runs: Runs, found: IdentifiedTorque) -> dict[str, Finding]:
    """Findings by claim."""
    rows = _arrivals(runs, found)
    for id_, case, concave in (("F13.4", ONE, True), ("F13.5", TWO, True), ("F13.6", THREE, False)):
        posture = runs[case].event_postures[0]
        rows[id_] = Finding(
            posture.is_concave == concave,
            f"at contact the hinges lie {'below' if posture.is_concave else 'above'}"
            " the line from the fixed hinge to the tip",
        )
    claims = read_claims()
    for id_, case, key in (
        ("F14.1", TWO, _first_peak), ("F14.2", TWO, _first_tangential_peak),
        ("F15.1", TWO, readings.largest_deflection), ("F15.2", THREE, readings.largest_deflection),
    ):  # fmt: skip
        read = _ratio(runs, case, key)
        reason = f"{_band(read, claims[id_])}; {_varied(read)}"
        if key is readings.largest_deflection:
            drawn = _ratio(runs, case, lambda run: readings.largest_deflection(run, drawn=True))("")
            reason += f"; at the instants that fig. 15 draws {drawn:.4g}"
        rows[id_] = Finding(read(""), reason)
    three = runs[THREE]
    rows["F14.3"] = Finding(
        readings.transitions(three),
        f"{readings.counting(three)}; with variations:"
        f" {_varied(lambda s: readings.transitions(runs[THREE + s]))}; the contact lasts"
        f" {duration_ms(three):.2f} ms, which jumps inside the factor's band"
        f" ({_varied(lambda s: duration_ms(runs[THREE + s]))}); fig. 14 shows about 0.9 ms",
    )
    for id_, case in (("F14.5", ONE), ("F14.6", TWO), ("F14.7", THREE)):
        read = _stress(runs, case)
        rows[id_] = Finding(read(""), f"{_band(read, claims[id_])}; {_varied(read)}")
    _, tangential = readings.curve(three, "tangential_force_N")
    rows["F14.4"] = Finding(
        bool(tangential.min() < 0 < tangential.max()),
        f"Ft between {tangential.min():.0f} and {tangential.max():.0f} N",
    )
    late = {
        c: readings.deflection_peaks_after_first_restitution(runs[c]) for c in (ONE, TWO, THREE)
    }
    rows["F15.3"] = Finding(
        all(late.values()),
        "among the instants that fig. 15 draws; "
        + "; ".join(
            f"{c}: {'yes' if ok else 'no'}, the largest of all"
            f" {100 * readings.share_of_largest_deflection(runs[c]):.0f} % through the contact"
            for c, ok in late.items()
        ),
    )
    for id_, case in (("F16.1", ONE), ("F16.2", TWO)):
        _, velocity = readings.particle_velocity(runs[case])
        rows[id_] = Finding(
            not readings.sticks(runs[case]),
            f"V_P between {velocity.min():.2f} and {velocity.max():.2f} m/s",
        )
    rows |= _stick_slip(runs)
    return rows


def _stick_slip(runs: Runs) -> dict[str, Finding]:
    three = runs[THREE]
    words = " ".join(ARROW[s] for s in readings.phases(three))
    shares = ", ".join(str(readings.slip_to_stick(three, share)) for share in (0.001, 0.01, 0.02))
    directions = _varied(lambda s: "".join("RL"[d < 0] for d in readings.slips(runs[THREE + s])))
    return {
        "F16.3": Finding(
            readings.slip_to_stick(three),
            "phases of at least 0.5 % of the contact are counted; with 0.1, 1, 2 %:"
            f" {shares}; located in all: {three.record.summary['slip_to_stick']}; with variations:"
            f" {_varied(lambda s: readings.slip_to_stick(runs[THREE + s]))}",
        ),
        "F16.4": Finding(
            readings.slips(three)[:4] == [1, -1, 1, -1],
            f"phases in order: {words}; slips with variations: {directions}",
        ),
    }
