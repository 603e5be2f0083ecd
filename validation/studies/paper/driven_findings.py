"""Section 4.3, figs. 13 to 16: the driven cases, with the identified t_3 factor.

The torques act suddenly on a finger without damping, which then rings at every frequency of the
mesh. Readings that depend on that ringing are given with their variations (`driven_cases`).
"""

from collections.abc import Callable
from functools import partial

from validation.compare.claims import Claim, read_claims
from validation.studies.paper import readings
from validation.studies.paper.case_runs import CaseRun
from validation.studies.paper.driven_cases import VARIED
from validation.studies.paper.driven_values import (
    CONCAVE,
    ONE,
    RATIOS,
    STRESSES,
    THREE,
    TWO,
    driven_values,
    ratio,
    stress_MPa,
)
from validation.studies.paper.ledger import Finding, printed_rounding
from validation.studies.paper.ramp_outcome import kept_outcome, sentence
from validation.studies.paper.readings import CaseRuns
from validation.studies.paper.torque_factor import IdentifiedTorque

ARROW = {1: "right", -1: "left", 0: "stick"}


def _varied(read: Callable[[str], object]) -> str:
    """A reading under each variation, as text; ``read`` takes the case's suffix."""
    parts = []
    for label in VARIED:
        value = read(f" {label}")
        parts.append(f"{label} {value:.4g}" if isinstance(value, float) else f"{label} {value}")
    return "; ".join(parts)


def duration_ms(run: CaseRun) -> float:
    """Duration of the first tap, ms."""
    return 1e3 * (run.record.value("contact_duration_s") or float("nan"))


def _band(read: Callable[[str], float], claim: Claim) -> str:
    """The reading's range over the factor's uncertainty; whether the printed value is inside."""
    values = [read(suffix) for suffix in (" low", "", " high")]
    low, high, rounding = min(values), max(values), printed_rounding(claim.paper_value)
    inside = low - rounding <= claim.number <= high + rounding
    return (
        f"over the factor's uncertainty {low:.4g} to {high:.4g}, the printed value"
        f" {'inside' if inside else 'outside'}"
    )


def _arrivals(found: IdentifiedTorque) -> dict[str, str]:
    numerics = "; ".join(
        f"{name}: factor {fit.factor:.4g}, {fit.misfit_percent:.2g} %"
        for name, fit in found.by_numerics.items()
    )
    reasons = {}
    for id_, case in (("F13.1", ONE), ("F13.2", TWO), ("F13.3", THREE)):
        own = found.by_case[case]
        text = (
            f"alone it asks for {own.factor:.4g} +- {own.half_width:.1g}"
            if own.factor is not None and own.half_width is not None
            else f"alone it fixes nothing: no factor brings it there, the nearest is"
            f" {1e3 * own.best_time_s:.3f} ms at {own.best_factor:.3g}"
        )
        reasons[id_] = (
            "the t_3 factor was identified from these times, which it misses by"
            f" {found.common.misfit_percent:.2g} % (rms); {text}; with the article's numerics"
            f" {numerics}"
        )
    return reasons


def _ratios(runs: CaseRuns) -> dict[str, str]:
    claims, reasons = read_claims(), {}
    for id_, (case, key) in RATIOS.items():
        read = partial(ratio, runs, case, key)
        reasons[id_] = f"{_band(read, claims[id_])}; {_varied(read)}"
        if key is readings.largest_deflection:
            drawn = ratio(runs, case, lambda run: readings.largest_deflection(run, drawn=True))
            reasons[id_] += f"; at the instants that fig. 15 draws {drawn:.4g}"
    for id_, case in STRESSES.items():
        own = lambda suffix, case=case: stress_MPa(runs[case + suffix])  # noqa: E731
        reasons[id_] = f"{_band(own, claims[id_])}; {_varied(own)}"
    return reasons


def _third_case(runs: CaseRuns) -> dict[str, str]:
    """Forces, phases and slips of the third case."""
    three = runs[THREE]
    _, tangential = readings.curve(three, "tangential_force_N")
    words = " ".join(ARROW[s] for s in readings.phases(three))
    shares = ", ".join(str(readings.slip_to_stick(three, share)) for share in (0.001, 0.01, 0.02))
    directions = _varied(lambda s: "".join("RL"[d < 0] for d in readings.slips(runs[THREE + s])))
    return {
        "F14.3": (
            f"{readings.counting(three)}; with variations:"
            f" {_varied(lambda s: readings.transitions(runs[THREE + s]))}; the contact lasts"
            f" {duration_ms(three):.2f} ms, which jumps inside the factor's band"
            f" ({_varied(lambda s: duration_ms(runs[THREE + s]))}); fig. 14 shows about 0.9 ms"
        ),
        "F14.4": f"Ft between {tangential.min():.0f} and {tangential.max():.0f} N",
        "F16.3": (
            "phases of at least 0.5 % of the contact are counted; with 0.1, 1, 2 %:"
            f" {shares}; located in all: {three.record.summary['slip_to_stick']}; with variations:"
            f" {_varied(lambda s: readings.slip_to_stick(runs[THREE + s]))}"
        ),
        "F16.4": f"phases in order: {words}; slips with variations: {directions}",
    }


def driven_findings(runs: CaseRuns, found: IdentifiedTorque) -> dict[str, Finding]:
    """Findings by claim."""
    values, outcome = driven_values(runs), kept_outcome()
    reasons = _arrivals(found) | _ratios(runs) | _third_case(runs)
    for id_, (case, _) in CONCAVE.items():
        below = runs[case].event_postures[0].is_concave
        reasons[id_] = (
            f"at contact the hinges lie {'below' if below else 'above'}"
            " the line from the fixed hinge to the tip"
        )
    late = "; ".join(
        f"{c}: {'yes' if readings.deflection_peaks_after_first_restitution(runs[c]) else 'no'},"
        f" the largest of all {100 * readings.share_of_largest_deflection(runs[c]):.0f} % through"
        " the contact"
        for c in (ONE, TWO, THREE)
    )
    reasons["F15.3"] = f"among the instants that fig. 15 draws; {late}"
    for id_, case in (("F16.1", ONE), ("F16.2", TWO)):
        _, velocity = readings.particle_velocity(runs[case])
        reasons[id_] = f"V_P between {velocity.min():.2f} and {velocity.max():.2f} m/s"
    return {
        id_: Finding(values[id_], f"{reason}; {sentence(id_, outcome)}")
        for id_, reason in reasons.items()
    }
