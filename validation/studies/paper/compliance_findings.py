"""Section 4.2.2, figs. 11 and 12: Young's modulus, slenderness and hysteresis."""

from __future__ import annotations

from validation.studies.paper.ledger import Finding
from validation.studies.paper.readings import (
    Runs,
    counting,
    curve,
    largest_stress,
    located,
    scalar,
    transitions,
)

FIRST = "first_peak_normal_force_N"
K, RESTITUTION = 0.78e6, 0.8
VARIED = ("N=15", "N=120", "tolerance 1 nm", "xi=0.5")


def loop_closure(runs: Runs, case: str) -> float:
    """Residual deformation at separation over (1 - e*^2) sum(u_Yc - u_Yr), less 1 (fig. 4).

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


def compliance_findings(runs: Runs) -> dict[str, Finding]:
    """Findings by claim."""
    cases = {"0.01": "soft E=0.01 GPa", "0.1": "soft E=0.1 GPa", "32": "soft delta=32",
             "16": "soft delta=16"}  # fmt: skip
    rows = {
        id_: Finding(transitions(runs[cases.get(which, "soft")]))
        for id_, which in (
            ("F11.1", "0.01"), ("F11.2", "0.1"), ("F11.3", "1"),
            ("F11.4", "32"), ("F11.5", "16"), ("F11.6", "10.7"),
        )
    }  # fmt: skip
    for id_, which in (("F11.1", "0.01"), ("F11.4", "32")):
        rows[id_] = Finding(rows[id_].value, counting(runs[cases[which]]))
    tried = ", ".join(f"{v} {located(runs[f'soft delta=32 {v}'])}" for v in VARIED)
    rows["F11.4"] = Finding(
        rows["F11.4"].value, f"{rows['F11.4'].reason}; located with other choices: {tried}"
    )
    first = {name: scalar(runs, case, FIRST) for name, case in cases.items()}
    soft = scalar(runs, "soft", FIRST)
    rows["F11.7"] = Finding(first["0.1"] / first["0.01"])
    rows["F11.8"] = Finding(soft / first["0.01"])
    rows["F11.9"] = Finding(first["16"] / first["32"])
    rows["F11.10"] = Finding(soft / first["32"])
    for id_, which in (
        ("F11.11", "0.01"), ("F11.12", "0.1"), ("F11.13", "1"),
        ("F11.14", "32"), ("F11.15", "16"), ("F11.16", "10.7"),
    ):  # fmt: skip
        rows[id_] = Finding(1e-6 * largest_stress(runs[cases.get(which, "soft")]))
    for id_, group in (("F12.1", ("E=0.01 GPa", "E=0.1 GPa")), ("F12.2", ("delta=32", "delta=16"))):
        names = ["soft e*=0.8", *(f"soft e*=0.8 {name}" for name in group)]
        worst = max(abs(loop_closure(runs, name)) for name in names)
        rows[id_] = Finding(
            worst < 1e-6,
            "residual deformation at separation against (1 - e*^2) sum(u_Yc - u_Yr): largest"
            f" relative difference {worst:.1g}",
        )
    counts = [transitions(runs[name]) for name in ("soft", *cases.values())]
    rows["A.1"] = Finding(
        min(counts) == 1 and max(counts) == 4, f"{min(counts)} to {max(counts)} transitions"
    )
    return rows
