"""Section 4.2.1, fig. 10: the friction study of the soft finger."""

from validation.studies.paper.cases import ETA2, STRESS_VARIED, friction_case
from validation.studies.paper.ledger import Finding
from validation.studies.paper.readings import (
    CaseRuns,
    curve,
    event_times,
    largest_stress,
    scalar,
    sticks,
)

STEADY = 0.01  # largest relative spread of values that are called constant
NORMAL, TANGENTIAL = "peak_normal_force_N", "peak_tangential_force_N"


def _change(runs: CaseRuns, key: str, mu: float) -> float:
    """Relative change from mu = 0.3, percent."""
    return 100 * (scalar(runs, friction_case(mu), key) / scalar(runs, friction_case(0.3), key) - 1)


def _stress_change(runs: CaseRuns, mu: float, suffix: str = "") -> float:
    """Relative change of the largest stress at R from mu = 0.3, percent."""
    first = largest_stress(runs[friction_case(0.3) + suffix])
    return 100 * (largest_stress(runs[friction_case(mu) + suffix]) / first - 1)


def _slip_phase(runs: CaseRuns, mu: float, suffix: str = "") -> tuple[str, str]:
    """Phase in which stick gives way to slip, and the two times as text."""
    run = runs[friction_case(mu) + suffix]
    slip, turn = (
        event_times(run, kind) for kind in ("stick_to_slip", "compression_to_restitution")
    )
    if not slip or not turn:
        return "none", "no such transition"
    phase = "compression" if slip[0] < turn[0] else "restitution"
    return phase, (
        f"stick ends {1e6 * slip[0]:.1f} us after contact, compression {1e6 * turn[0]:.1f} us"
    )


def _gross_slip(printed_percent: float, mu: float, printed_fall: float) -> str:
    implied = 100 * (1 - (1 + printed_percent / 100) * 0.3 / mu)
    return (
        f"in gross slip Ft = mu Fn, so the printed +{printed_percent:g} % of Ft means"
        f" -{implied:.1f} % of Fn, not -{printed_fall:g} %"
    )


def _stress_reason(runs: CaseRuns) -> str:
    first, last = (1e-6 * largest_stress(runs[friction_case(mu)]) for mu in (0.3, 0.7))
    tried = ", ".join(f"{name} {_stress_change(runs, 0.7, f' {name}'):.2f} %"
                      for name in STRESS_VARIED)  # fmt: skip
    return (
        f"the two stresses, {first:.4f} and {last:.4f} MPa, are in the ratio {last / first:.4f}"
        f" against the printed 1.249 ({100 * (last / first / 1.249 - 1):+.2f} %), as far off as the"
        f" paper's other stresses at R are; mesh and steps move it by as much: {tried}"
    )


def _steady_stress(runs: CaseRuns) -> tuple[bool, str]:
    """Whether the largest stress is the same for mu = 0.9, 1.1, 1.3; how it depends on eta^2."""

    def stresses(suffix: str) -> list[float]:
        return [1e-6 * largest_stress(runs[friction_case(mu) + suffix]) for mu in (0.9, 1.1, 1.3)]

    def spread(values: list[float]) -> float:
        return max(values) / min(values) - 1

    ours, tried, both = stresses(""), [], []
    for eta2 in ETA2:
        suffix = f" eta^2={eta2:g}"
        change, phase = spread(stresses(suffix)), _slip_phase(runs, 0.9, suffix)[0]
        tried.append(f"{eta2:g}: {100 * change:.1f} %, slip at mu = 0.9 begins in {phase}")
        both += [eta2] if change < STEADY and phase == "compression" else []
    time, stress = curve(runs[friction_case(0.9)], "stress_R_Pa")
    return spread(ours) < STEADY, (
        f"MPa at mu = 0.9, 1.1, 1.3: {', '.join(f'{s:.3f}' for s in ours)}: they spread by"
        f" {100 * spread(ours):.1f} %, constant means {100 * STEADY:g} %. At 0.9"
        f" {_slip_phase(runs, 0.9)[1]}, and the stress peaks at"
        f" {1e6 * float(time[stress.argmax()]):.1f} us: to be constant from 0.9 on, the tip would"
        " have to stick nearly until then, while its slip begins in compression (F10.7). How much"
        f" the stress changes depends on eta^2, which the paper does not give: {'; '.join(tried)}."
        " Values at which the stress is constant and F10.7 holds:"
        f" {', '.join(f'{e:g}' for e in both) or 'none of these'}"
    )


def friction_findings(runs: CaseRuns) -> dict[str, Finding]:
    """Findings by claim."""
    rows = {
        "F10.1": Finding(-_change(runs, NORMAL, 0.5), "", _gross_slip(55.6, 0.5, 7.2)),
        "F10.2": Finding(-_change(runs, NORMAL, 0.7), "", _gross_slip(105.3, 0.7, 11.6)),
        "F10.3": Finding(_change(runs, TANGENTIAL, 0.5)),
        "F10.4": Finding(_change(runs, TANGENTIAL, 0.7)),
        "F10.5": Finding(not any(sticks(runs[friction_case(mu)]) for mu in (0.3, 0.5, 0.7))),
        "F10.10": Finding(_stress_change(runs, 0.5)),
        "F10.11": Finding(_stress_change(runs, 0.7), _stress_reason(runs)),
    }
    high = [scalar(runs, friction_case(mu), NORMAL) for mu in (1.1, 1.3)]
    rows["F10.6"] = Finding(
        abs(high[1] / high[0] - 1) < 1e-3, f"{high[0]:.4f} and {high[1]:.4f} N at mu = 1.1 and 1.3"
    )
    for id_, mu, expected in (
        ("F10.7", 0.9, "compression"), ("F10.8", 1.1, "restitution"), ("F10.9", 1.3, "restitution"),
    ):  # fmt: skip
        phase, text = _slip_phase(runs, mu)
        rows[id_] = Finding(phase == expected, text)
    steady, spreads = _steady_stress(runs)
    rows["F10.12"] = Finding(steady, spreads)
    return rows
