"""Section 4.2.1, fig. 10: the friction study of the soft finger."""

from __future__ import annotations

from validation.paper.finding import (
    Finding,
    Runs,
    event_times,
    largest_stress,
    scalar,
    sticks,
)

NORMAL, TANGENTIAL = "peak_normal_force_N", "peak_tangential_force_N"


def _case(mu: float) -> str:
    return "soft" if mu == 0.5 else f"soft mu={mu:g}"


def _change(runs: Runs, key: str, mu: float) -> float:
    """Relative change from mu = 0.3, percent."""
    return 100 * (scalar(runs, _case(mu), key) / scalar(runs, _case(0.3), key) - 1)


def _stress_change(runs: Runs, mu: float, suffix: str = "") -> float:
    """Relative change of the largest stress at R from mu = 0.3, percent."""
    first = largest_stress(runs[_case(0.3) + suffix])
    return 100 * (largest_stress(runs[_case(mu) + suffix]) / first - 1)


def _slip_phase(runs: Runs, mu: float) -> tuple[str, str]:
    """Phase in which stick gives way to slip, and the two times as text."""
    run = runs[_case(mu)]
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


def measure(runs: Runs) -> dict[str, Finding]:
    """Findings by claim."""
    rows = {
        "F10.1": Finding(-_change(runs, NORMAL, 0.5), "", _gross_slip(55.6, 0.5, 7.2)),
        "F10.2": Finding(-_change(runs, NORMAL, 0.7), "", _gross_slip(105.3, 0.7, 11.6)),
        "F10.3": Finding(_change(runs, TANGENTIAL, 0.5)),
        "F10.4": Finding(_change(runs, TANGENTIAL, 0.7)),
        "F10.5": Finding(not any(sticks(runs[_case(mu)]) for mu in (0.3, 0.5, 0.7))),
        "F10.10": Finding(_stress_change(runs, 0.5)),
        "F10.11": Finding(
            _stress_change(runs, 0.7),
            "the stress at R depends on the mesh: its element holds a linear curvature; with N = 15"
            f" the increase is {_stress_change(runs, 0.7, ' N=15'):.2f} %",
        ),
    }
    high = [scalar(runs, _case(mu), NORMAL) for mu in (1.1, 1.3)]
    rows["F10.6"] = Finding(
        abs(high[1] / high[0] - 1) < 1e-3, f"{high[0]:.4f} and {high[1]:.4f} N at mu = 1.1 and 1.3"
    )
    for id_, mu, expected in (
        ("F10.7", 0.9, "compression"), ("F10.8", 1.1, "restitution"), ("F10.9", 1.3, "restitution"),
    ):  # fmt: skip
        phase, text = _slip_phase(runs, mu)
        rows[id_] = Finding(phase == expected, text)
    stress = {mu: 1e-6 * largest_stress(runs[_case(mu)]) for mu in (0.9, 1.1, 1.3)}
    tried = "; ".join(
        f"eta^2 = {eta2:g}: "
        + " and ".join(
            f"{1e-6 * largest_stress(runs[f'soft mu={mu:g} eta^2={eta2:g}']):.3f}"
            for mu in (0.9, 1.1)
        )
        for eta2 in (1.0, 1.5, 2.0)
    )
    rows["F10.12"] = Finding(
        max(stress.values()) / min(stress.values()) - 1 < 0.01,
        "MPa at mu = 0.9, 1.1, 1.3: "
        + ", ".join(f"{s:.3f}" for s in stress.values())
        + ". At 0.9 the tip slips before the peak, so the stress still depends on mu; how much"
        f" depends on eta^2, which the paper does not give (mu = 0.9 and 1.1; {tried})",
    )
    return rows
