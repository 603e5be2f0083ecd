"""Section 4.2, figs. 10 to 12: the soft finger's friction, modulus, slenderness, hysteresis."""

from collections.abc import Callable, Sequence
from functools import partial

from validation.compare.claims import Claim, read_claims
from validation.studies.paper import cases, readings
from validation.studies.paper.case_runs import CaseRun
from validation.studies.paper.ledger import Finding
from validation.studies.paper.readings import CaseRuns, scalar

PEAK_NORMAL = partial(scalar, key="peak_normal_force_N")
PEAK_TANGENTIAL = partial(scalar, key="peak_tangential_force_N")
STEADY = 0.01  # largest relative spread of values that are called constant
K, RESTITUTION = 0.78e6, 0.8  # of the soft tip, N/m, and of fig. 12
# In the order of fig. 11's claims: transitions F11.1 to F11.6, stresses F11.11 to F11.16.
SOFTEST, SLENDEREST = "soft E=0.01 GPa", "soft delta=32"
CASES = (SOFTEST, "soft E=0.1 GPa", "soft", SLENDEREST, "soft delta=16", "soft")


def _with_friction(runs: CaseRuns, mus: Sequence[float], suffix: str = "") -> list[CaseRun]:
    """The soft finger's runs with these coefficients of friction, of cases whose names end so."""
    return [runs[cases.friction_case(mu) + suffix] for mu in mus]


def _change(runs: CaseRuns, read: Callable[[CaseRun], float], mu: float, suffix: str = "") -> float:
    """Relative change of a reading from mu = 0.3, percent."""
    first, last = map(read, _with_friction(runs, (0.3, mu), suffix))
    return 100 * (last / first - 1)


def _slip_phase(run: CaseRun) -> tuple[str, str]:
    """Phase in which stick gives way to slip, and the two times as text."""
    slip, turn = (
        readings.event_times(run, kind) for kind in ("stick_to_slip", "compression_to_restitution")
    )
    if not slip or not turn:
        return "none", "no such transition"
    phase = "compression" if slip[0] < turn[0] else "restitution"
    return phase, (
        f"stick ends {1e6 * slip[0]:.1f} us after contact, compression {1e6 * turn[0]:.1f} us"
    )


def _gross_slip(normal: Claim, tangential: Claim, mu: float) -> str:
    implied = 100 * (1 - (1 + tangential.number / 100) * 0.3 / mu)
    return (
        f"in gross slip Ft = mu Fn, so the printed +{tangential.paper_value} % of Ft means"
        f" -{implied:.1f} % of Fn, not -{normal.paper_value} %"
    )


def _stress_reason(runs: CaseRuns, printed: Claim) -> str:
    first, last = map(readings.largest_stress_MPa, _with_friction(runs, (0.3, 0.7)))
    tried = ", ".join(
        f"{name} {_change(runs, readings.largest_stress_MPa, 0.7, f' {name}'):.2f} %"
        for name in cases.STRESS_VARIED
    )
    ratio = 1 + printed.number / 100
    return (
        f"the two stresses, {first:.4f} and {last:.4f} MPa, are in the ratio {last / first:.4f}"
        f" against the printed {ratio:g} ({100 * (last / first / ratio - 1):+.2f} %);"
        f" other meshes and steps: {tried}"
    )


def _steady_stress(runs: CaseRuns) -> Finding:
    """Whether the largest stress is the same for mu = 0.9, 1.1, 1.3; how it depends on eta^2."""

    def read(suffix: str) -> tuple[list[float], float, tuple[str, str]]:
        """The stresses, MPa, their relative spread, and when slip begins at mu = 0.9."""
        found = _with_friction(runs, (0.9, 1.1, 1.3), suffix)
        stresses = [readings.largest_stress_MPa(run) for run in found]
        return stresses, max(stresses) / min(stresses) - 1, _slip_phase(found[0])

    ours, spread, (_, text) = read("")
    tried, both = [], []
    for name in cases.STIFFNESSES:
        eta2 = name.removeprefix("eta^2=")
        _, change, (phase, _) = read(f" {name}")
        tried.append(f"{eta2}: {100 * change:.1f} %, slip at mu = 0.9 begins in {phase}")
        both += [eta2] if change < STEADY and phase == "compression" else []
    time, stress = readings.curve(runs[cases.friction_case(0.9)], "stress_R_Pa")
    return Finding(
        spread < STEADY,
        f"MPa at mu = 0.9, 1.1, 1.3: {', '.join(f'{s:.3f}' for s in ours)}: they spread by"
        f" {100 * spread:.1f} %, constant means {100 * STEADY:g} %. At 0.9"
        f" {text}, and the stress peaks at"
        f" {1e6 * float(time[stress.argmax()]):.1f} us: to be constant from 0.9 on, the tip would"
        " have to stick nearly until then, while its slip begins in compression (F10.7). How much"
        f" the stress changes depends on eta^2, which the paper does not give: {'; '.join(tried)}."
        " Values at which the stress is constant and F10.7 holds:"
        f" {', '.join(both) or 'none of these'}",
    )


def friction_findings(runs: CaseRuns) -> dict[str, Finding]:
    """Findings of fig. 10 by claim."""
    first, second = map(PEAK_NORMAL, _with_friction(runs, (1.1, 1.3)))
    claims = read_claims()
    slips = {
        mu: _gross_slip(claims[normal], claims[tangential], mu)
        for normal, tangential, mu in (("F10.1", "F10.3", 0.5), ("F10.2", "F10.4", 0.7))
    }
    rows = {
        "F10.1": Finding(-_change(runs, PEAK_NORMAL, 0.5), "", slips[0.5]),
        "F10.2": Finding(-_change(runs, PEAK_NORMAL, 0.7), "", slips[0.7]),
        "F10.3": Finding(_change(runs, PEAK_TANGENTIAL, 0.5)),
        "F10.4": Finding(_change(runs, PEAK_TANGENTIAL, 0.7)),
        "F10.5": Finding(all(map(readings.slides, _with_friction(runs, (0.3, 0.5, 0.7))))),
        "F10.6": Finding(
            abs(second / first - 1) < 1e-3,
            f"{first:.4f} and {second:.4f} N at mu = 1.1 and 1.3",
        ),
        "F10.10": Finding(_change(runs, readings.largest_stress_MPa, 0.5)),
        "F10.11": Finding(
            _change(runs, readings.largest_stress_MPa, 0.7), _stress_reason(runs, claims["F10.11"])
        ),
        "F10.12": _steady_stress(runs),
    }
    for id_, mu, expected in (
        ("F10.7", 0.9, "compression"), ("F10.8", 1.1, "restitution"), ("F10.9", 1.3, "restitution"),
    ):  # fmt: skip
        phase, text = _slip_phase(runs[cases.friction_case(mu)])
        rows[id_] = Finding(phase == expected, text)
    return rows


def loop_closure(run: CaseRun) -> float:
    """Residual deformation at separation over (1 - e*^2) sum(u_Yc - u_Yr), minus 1 (fig. 4).

    u_Yc = Fn/k at the end of each compression and u_Yr at the end of each restitution but the last.
    """
    time, force = readings.curve(run, "normal_force_N")
    _, position = readings.curve(run, "tip_position_m")
    start = scalar(run, "contact_time_s")
    total = 0.0
    for event in run.record.events:
        sign = {"compression_to_restitution": 1, "restitution_to_compression": -1}.get(event.kind)
        if sign is not None and 0 <= event.time_s - start <= time[-1]:
            total += sign * force[abs(time - (event.time_s - start)).argmin()] / K
    residual = position[0, 1] - position[-1, 1]
    return float(residual / ((1 - RESTITUTION**2) * total) - 1)


def compliance_findings(runs: CaseRuns) -> dict[str, Finding]:
    """Findings of figs. 11 and 12, and of the abstract's range, by claim."""
    rows = {}
    counts = [readings.transitions(runs[case]) for case in CASES]
    for number, (case, count) in enumerate(zip(CASES, counts, strict=True), start=1):
        reason = readings.counting(runs[case]) if case in (SOFTEST, SLENDEREST) else ""
        if case == SLENDEREST:
            others = {name: runs[f"{case} {name}"] for name in cases.SLENDEREST_VARIED}
            tried = ", ".join(f"{name} {readings.located(run)}" for name, run in others.items())
            reason += f"; located with other choices: {tried}"
        rows[f"F11.{number}"] = Finding(count, reason)
        rows[f"F11.{number + 10}"] = Finding(readings.largest_stress_MPa(runs[case]))
    for id_, case, base in (
        ("F11.7", "soft E=0.1 GPa", SOFTEST), ("F11.8", "soft", SOFTEST),
        ("F11.9", "soft delta=16", SLENDEREST), ("F11.10", "soft", SLENDEREST),
    ):  # fmt: skip
        own, least = (scalar(runs[one], "first_peak_normal_force_N") for one in (case, base))
        rows[id_] = Finding(own / least)
    for id_, group in (("F12.1", ("E=0.01 GPa", "E=0.1 GPa")), ("F12.2", ("delta=32", "delta=16"))):
        names = ["soft e*=0.8", *(f"soft e*=0.8 {name}" for name in group)]
        worst = max(abs(loop_closure(runs[name])) for name in names)
        rows[id_] = Finding(
            worst < 1e-6,
            "residual deformation at separation against (1 - e*^2) sum(u_Yc - u_Yr): largest"
            f" relative difference {worst:.1g}",
        )
    rows["A.1"] = Finding(
        min(counts) == 1 and max(counts) == 4, f"{min(counts)} to {max(counts)} transitions"
    )
    return rows
