"""Section 4.3, figs. 13 to 16: the driven cases, with the identified t_3 factor.

The torques act suddenly on a finger without damping, which then rings at every frequency of the
mesh. Readings that depend on that ringing are given with their variations (`cases`).
"""

from validation.compare.claims import Claim, read_claims
from validation.studies.paper import readings
from validation.studies.paper.case_runs import CaseRun
from validation.studies.paper.cases import DRIVEN_VARIED
from validation.studies.paper.ledger import Finding, printed_rounding
from validation.studies.paper.ramp_outcome import kept_outcome, sentence
from validation.studies.paper.readings import (
    ONE,
    READINGS,
    THREE,
    TWO,
    CaseRuns,
    Reading,
    reading_of,
)
from validation.studies.paper.torque_factor import ARRIVAL_CLAIMS, IdentifiedTorque

ARROW = {1: "right", -1: "left", 0: "stick"}
BANDED = ("F14.1", "F14.2", "F14.5", "F14.6", "F14.7", "F15.1", "F15.2")


def _varied(runs: CaseRuns, read: Reading) -> str:
    """A reading under each variation, as text."""
    values = {label: read(runs, f" {label}") for label in DRIVEN_VARIED}
    return "; ".join(
        f"{label} {value:.4g}" if isinstance(value, float) else f"{label} {value}"
        for label, value in values.items()
    )


def _band(runs: CaseRuns, claim: Claim) -> str:
    """The reading's range over the factor's uncertainty; whether the printed value is inside."""
    values = [READINGS[claim.id](runs, suffix) for suffix in (" low", "", " high")]
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
    return {
        id_: "the t_3 factor was identified from these times, which it misses by"
        f" {found.common.misfit_percent:.2g} % (rms); the factor from this one alone:"
        f" {found.by_case[case].text}; with the article's numerics {numerics}"
        for case, id_ in ARRIVAL_CLAIMS.items()
    }


def _third_case(runs: CaseRuns) -> dict[str, str]:
    """Forces, phases and slips of the third case."""
    three = runs[THREE]
    _, tangential = readings.curve(three, "tangential_force_N")
    words = " ".join(ARROW[s] for s in readings.phases(three))
    shares = ", ".join(str(readings.slip_to_stick(three, share)) for share in (0.001, 0.01, 0.02))

    def directions(run: CaseRun) -> str:
        return "".join("RL"[slip < 0] for slip in readings.slips(run))

    return {
        "F14.3": (
            f"{readings.counting(three)}; with variations: {_varied(runs, READINGS['F14.3'])}; the"
            f" contact lasts {readings.duration_ms(three):.2f} ms"
            f" ({_varied(runs, reading_of(THREE, readings.duration_ms))}); fig. 14 shows about"
            " 0.9 ms"
        ),
        "F14.4": f"Ft between {tangential.min():.0f} and {tangential.max():.0f} N",
        "F16.3": (
            "phases of at least 0.5 % of the contact are counted; with 0.1, 1, 2 %:"
            f" {shares}; located in all: {three.record.summary['slip_to_stick']}; with variations:"
            f" {_varied(runs, READINGS['F16.3'])}"
        ),
        "F16.4": (
            f"phases in order: {words}; slips with variations:"
            f" {_varied(runs, reading_of(THREE, directions))}"
        ),
    }


def driven_findings(runs: CaseRuns, found: IdentifiedTorque) -> dict[str, Finding]:
    """Findings by claim."""
    values, outcome, claims = readings.driven_values(runs), kept_outcome(), read_claims()
    reasons = _arrivals(found) | _third_case(runs)
    for id_ in BANDED:
        reasons[id_] = f"{_band(runs, claims[id_])}; {_varied(runs, READINGS[id_])}"
    for id_, case in (("F13.4", ONE), ("F13.5", TWO), ("F13.6", THREE)):
        reasons[id_] = (
            f"at contact the hinges lie {'below' if readings.concave(runs[case]) else 'above'}"
            " the line from the fixed hinge to the tip"
        )
    for id_, case in (("F15.1", TWO), ("F15.2", THREE)):
        drawn = readings.over_case_1(case, readings.drawn_deflection)(runs, "")
        reasons[id_] += f"; at the instants that fig. 15 draws {drawn:.4g}"
    late = "; ".join(
        f"{c}: {'yes' if readings.deflection_peaks_after_first_restitution(runs[c]) else 'no'},"
        f" the largest of all {100 * readings.share_of_largest_deflection(runs[c]):.0f} % through"
        " the contact"
        for c in (ONE, TWO, THREE)
    )
    reasons["F15.3"] = f"among the contact's events; {late}"
    for id_, case in (("F16.1", ONE), ("F16.2", TWO)):
        _, velocity = readings.particle_velocity(runs[case])
        reasons[id_] = f"V_P between {velocity.min():.2f} and {velocity.max():.2f} m/s"
    return {
        id_: Finding(values[id_], f"{reason}; {sentence(id_, outcome)}")
        for id_, reason in reasons.items()
    }
