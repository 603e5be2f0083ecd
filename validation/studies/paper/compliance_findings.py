"""Section 4.2.2, figs. 11 and 12: Young's modulus, slenderness and hysteresis."""

from validation.studies.paper.ledger import Finding
from validation.studies.paper.readings import (
    CaseRuns,
    counting,
    curve,
    largest_stress,
    located,
    scalar,
    transitions,
)

FIRST = "first_peak_normal_force_N"
K, RESTITUTION = 0.78e6, 0.8
# In the order of fig. 11's claims: transitions F11.1 to F11.6, stresses F11.11 to F11.16.
SOFTEST, SLENDEREST = "soft E=0.01 GPa", "soft delta=32"
CASES = (SOFTEST, "soft E=0.1 GPa", "soft", SLENDEREST, "soft delta=16", "soft")
VARIED = ("N=15", "N=120", "tolerance 1 nm", "xi=0.5")


def loop_closure(runs: CaseRuns, case: str) -> float:
    """Residual deformation at separation over (1 - e*^2) sum(u_Yc - u_Yr), minus 1 (fig. 4).

    u_Yc = Fn/k at the end of each compression and u_Yr at the end of each restitution but the last.
    """
    run = runs[case]
    time, force = curve(run, "normal_force_N")
    _, position = curve(run, "tip_position_m")
    start = run.record.value("contact_time_s") or 0.0
    total = 0.0
    for event in run.record.events:
        sign = {"compression_to_restitution": 1, "restitution_to_compression": -1}.get(event.kind)
        if sign is not None and 0 <= event.time_s - start <= time[-1]:
            total += sign * force[abs(time - (event.time_s - start)).argmin()] / K
    residual = position[0, 1] - position[-1, 1]
    return float(residual / ((1 - RESTITUTION**2) * total) - 1)


def compliance_findings(runs: CaseRuns) -> dict[str, Finding]:
    """Findings by claim."""
    rows = {}
    for number, case in enumerate(CASES, start=1):
        reason = counting(runs[case]) if case in (SOFTEST, SLENDEREST) else ""
        if case == SLENDEREST:
            tried = ", ".join(f"{v} {located(runs[f'{case} {v}'])}" for v in VARIED)
            reason += f"; located with other choices: {tried}"
        rows[f"F11.{number}"] = Finding(transitions(runs[case]), reason)
        rows[f"F11.{number + 10}"] = Finding(1e-6 * largest_stress(runs[case]))
    first = {case: scalar(runs, case, FIRST) for case in CASES}
    rows["F11.7"] = Finding(first["soft E=0.1 GPa"] / first[SOFTEST])
    rows["F11.8"] = Finding(first["soft"] / first[SOFTEST])
    rows["F11.9"] = Finding(first["soft delta=16"] / first[SLENDEREST])
    rows["F11.10"] = Finding(first["soft"] / first[SLENDEREST])
    for id_, group in (("F12.1", ("E=0.01 GPa", "E=0.1 GPa")), ("F12.2", ("delta=32", "delta=16"))):
        names = ["soft e*=0.8", *(f"soft e*=0.8 {name}" for name in group)]
        worst = max(abs(loop_closure(runs, name)) for name in names)
        rows[id_] = Finding(
            worst < 1e-6,
            "residual deformation at separation against (1 - e*^2) sum(u_Yc - u_Yr): largest"
            f" relative difference {worst:.1g}",
        )
    counts = [transitions(runs[case]) for case in CASES]
    rows["A.1"] = Finding(
        min(counts) == 1 and max(counts) == 4, f"{min(counts)} to {max(counts)} transitions"
    )
    return rows
