"""Figs. 10, 11 and 12: friction, compliance and hysteresis of the soft finger."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from validation.harness.figures import COLORS, label, panels
from validation.studies.paper.finding import Runs, curve

TIME = "$t - t_c$ (ms)"


def draw_forces(axis: Any, runs: Runs, cases: Sequence[tuple[str, str]]) -> None:
    """Fn solid and Ft dashed, one colour a case; `cases` are (name, legend)."""
    for (name, legend), color in zip(cases, COLORS, strict=False):
        for history, line in (("normal_force_N", "-"), ("tangential_force_N", "--")):
            time, force = curve(runs[name], history)
            axis.plot(1e3 * time, force, line, color=color, label=legend if line == "-" else None)


def draw_stress(axis: Any, runs: Runs, cases: Sequence[tuple[str, str]]) -> None:
    """Stress at R, one colour a case."""
    for (name, legend), color in zip(cases, COLORS, strict=False):
        time, stress = curve(runs[name], "stress_R_Pa")
        axis.plot(1e3 * time, 1e-6 * stress, color=color, label=legend)


def _friction(mu: float) -> tuple[str, str]:
    return ("soft" if mu == 0.5 else f"soft mu={mu:g}"), rf"$\mu$ = {mu:g}"


def figure_10(path: Path, runs: Runs) -> None:
    """Forces and stress at R under different friction."""
    with panels(path, 2, 2) as axes:
        for column, frictions in enumerate(((0.3, 0.5, 0.7), (0.9, 1.1, 1.3))):
            cases = [_friction(mu) for mu in frictions]
            draw_forces(axes[0][column], runs, cases)
            label(axes[0][column], f"({'ab'[column]})", TIME, "$F_n$ (solid), $F_t$ (dashed) (N)")
            draw_stress(axes[1][column], runs, cases)
            label(axes[1][column], f"({'cd'[column]})", TIME, r"$\sigma_R$ (MPa)")


MODULI = [("soft E=0.01 GPa", "E = 0.01 GPa"), ("soft E=0.1 GPa", "E = 0.1 GPa"), ("soft", "1 GPa")]
SLENDER = [
    ("soft delta=32", r"$\delta$ = 32"),
    ("soft delta=16", r"$\delta$ = 16"),
    ("soft", r"$\delta$ = 10.7"),
]


def figure_11(path: Path, runs: Runs) -> None:
    """Forces and stress at R under different compliance."""
    with panels(path, 2, 2) as axes:
        for column, cases in enumerate((MODULI, SLENDER)):
            draw_forces(axes[0][column], runs, cases)
            label(axes[0][column], f"({'ab'[column]})", TIME, "$F_n$ (solid), $F_t$ (dashed) (N)")
            draw_stress(axes[1][column], runs, cases)
            label(axes[1][column], f"({'cd'[column]})", TIME, r"$\sigma_R$ (MPa)")


def figure_12(path: Path, runs: Runs) -> None:
    """Hysteresis loops of the normal element at e* = 0.8."""
    with panels(path, 2) as axes:
        for column, cases in enumerate((MODULI, SLENDER)):
            axis = axes[0][column]
            for (name, legend), color in zip(cases, COLORS, strict=False):
                run = runs[name.replace("soft", "soft e*=0.8", 1)]
                _, force = curve(run, "normal_force_N")
                _, position = curve(run, "tip_position_m")
                axis.plot(1e3 * (position[0, 1] - position[:, 1]), force, color=color, label=legend)
            label(axis, f"({'ab'[column]}) $e_*$ = 0.8", "deformation (mm)", "$F_n$ (N)")
