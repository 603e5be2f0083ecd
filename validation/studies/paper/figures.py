"""The paper's figures from our own runs: 7 to 12 of the free finger, 13 to 16 of the driven one."""

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from string import ascii_uppercase
from typing import Any

import numpy as np

from validation.compare.figures import mesh_figure, overlay_figure
from validation.harness.figures import COLORS, GREY, label, panels
from validation.harness.record import RunRecord
from validation.studies.paper.cases import POSTURE_TIMES, PRINTED_TORQUES, friction_case
from validation.studies.paper.readings import (
    THREE,
    CaseRuns,
    curve,
    drawn_postures,
    particle_velocity,
    window,
)

SCENES = ("hard", "soft")
TIME = "$t - t_c$ (ms)"

Cases = Sequence[tuple[str, str]]  # names and legends

LOW, HIGH = (
    [(friction_case(mu), rf"$\mu$ = {mu:g}") for mu in frictions]
    for frictions in ((0.3, 0.5, 0.7), (0.9, 1.1, 1.3))
)
MODULI = [("soft E=0.01 GPa", "E = 0.01 GPa"), ("soft E=0.1 GPa", "E = 0.1 GPa"), ("soft", "1 GPa")]
SLENDER = [
    ("soft delta=32", r"$\delta$ = 32"),
    ("soft delta=16", r"$\delta$ = 16"),
    ("soft", r"$\delta$ = 10.7"),
]


def draw_forces_and_stress(
    forces: Any, stress: Any, runs: CaseRuns, cases: Cases, letters: str
) -> None:
    """Draw Fn (solid), Ft (dashed) on one axis, the stress at R on another, one colour per case."""
    lines = (
        (forces, "normal_force_N", 1.0, "-"),
        (forces, "tangential_force_N", 1.0, "--"),
        (stress, "stress_R_Pa", 1e-6, "-"),
    )
    for (name, legend), color in zip(cases, COLORS, strict=False):
        for axis, history, factor, line in lines:
            time, values = curve(runs[name], history)
            title = legend if line == "-" else None
            axis.plot(1e3 * time, factor * values, line, color=color, label=title)
    label(forces, f"({letters[0]})", TIME, "$F_n$ (solid), $F_t$ (dashed) (N)")
    label(stress, f"({letters[1]})", TIME, r"$\sigma_R$ (MPa)")


def two_studies(path: Path, runs: CaseRuns, left: Cases, right: Cases) -> None:
    """Draw two studies side by side: forces above, stress at R below."""
    with panels(path, 2, 2) as ((a, b), (c, d)):
        draw_forces_and_stress(a, c, runs, left, "ac")
        draw_forces_and_stress(b, d, runs, right, "bd")


def figure_7(path: Path, runs: CaseRuns) -> None:
    """Contact forces with different numbers of elements."""
    counts = {"": "N = 60", " N=30": "N = 30", " N=15": "N = 15"}
    lines = [(title, runs[f"{scene}{suffix}"].record) for scene in SCENES
             for suffix, title in counts.items()]  # fmt: skip
    mesh_figure(path, lines, SCENES)


def figure_12(path: Path, runs: CaseRuns) -> None:
    """Hysteresis loops of the normal element at e* = 0.8."""
    with panels(path, 2) as ((left, right),):
        for axis, cases, letter in ((left, MODULI, "a"), (right, SLENDER, "b")):
            for (name, legend), color in zip(cases, COLORS, strict=False):
                run = runs[name.replace("soft", "soft e*=0.8", 1)]
                _, force = curve(run, "normal_force_N")
                _, position = curve(run, "tip_position_m")
                axis.plot(1e3 * (position[0, 1] - position[:, 1]), force, color=color, label=legend)
            label(axis, f"({letter}) $e_*$ = 0.8", "deformation (mm)", "$F_n$ (N)")


CASES = [(name, f"case {name[-1]}") for name in PRINTED_TORQUES]
HEIGHT = 0.1  # m, of the first hinge above the surface
# Inside the factor's uncertainty case 3 has two kinds of contact: the other one is drawn too.
OTHER_FACTOR = ("driven-3 case 2 alone", "case 3, factor of case 2 alone")
DRAWN_TWICE = (THREE, OTHER_FACTOR[0])


def figure_13(path: Path, runs: CaseRuns) -> None:
    """Postures before, at and after contact."""
    with panels(path, 3, width=3.6) as (axes,):
        for axis, (name, legend) in zip(axes, CASES, strict=True):
            run = runs[name]
            frames = [p for p in run.frames if p.time_s in POSTURE_TIMES[name]]
            shown = sorted((*frames, run.event_postures[0]), key=lambda p: p.time_s)
            for posture, color in zip(shown, itertools.cycle(COLORS), strict=False):
                line = np.concatenate(posture.positions_m)
                axis.plot(*line.T, color=color, label=f"{1e3 * posture.time_s:.2f} ms")
                hinges = np.array([nodes[0] for nodes in posture.positions_m])
                axis.plot(*hinges.T, "o", color=color, markersize=3)
            axis.axhline(-HEIGHT, color=GREY, linewidth=2)
            axis.set_aspect("equal", adjustable="datalim")
            label(axis, legend, "X (m)", "Y (m)")
            axis.legend(loc="lower left", bbox_to_anchor=(0.0, 0.1))  # clear of the surface


def figure_14(path: Path, runs: CaseRuns) -> None:
    """Contact forces and stress at R."""
    with panels(path, 2) as ((forces, stress),):
        draw_forces_and_stress(forces, stress, runs, [*CASES, OTHER_FACTOR], "ab")


def figure_15(path: Path, runs: CaseRuns) -> None:
    """Bending deflection of the third phalanx at contact, reversals and separation."""
    with panels(path, 3, width=3.6) as (axes,):
        for axis, (name, legend) in zip(axes, CASES, strict=True):
            run = runs[name]
            start, _ = window(run)
            for letter, posture in zip(ascii_uppercase, drawn_postures(run), strict=False):
                axial, deflection = posture.deflection(2)
                moment = 1e3 * (posture.time_s - start)
                axis.plot(-axial, 1e3 * deflection, label=f"{letter}: {moment:.3f} ms")
            label(axis, legend, "axial position (m), tip at the left", "deflection (mm)")


def figure_16(path: Path, runs: CaseRuns) -> None:
    """Velocity of the contact particle P."""
    with panels(path, 3, width=3.6) as (axes,):
        for axis, (name, legend), color in zip(axes, CASES, COLORS, strict=False):
            lines = [(name, "$V_P$", color)] + [(*OTHER_FACTOR, COLORS[3])] * (name == THREE)
            for case, title, line_color in lines:
                time, velocity = particle_velocity(runs[case])
                axis.plot(1e3 * time, velocity, color=line_color, label=title)
            label(axis, legend, TIME, "tangential velocity (m/s)")


FIGURES: dict[str, tuple[str, Callable[[Path, CaseRuns], None]]] = {
    "fig-07": ("Fig. 7: reduced model with N elements in all", figure_7),
    "fig-10": ("Fig. 10: contact forces and stress at R under different friction",
               partial(two_studies, left=LOW, right=HIGH)),
    "fig-11": ("Fig. 11: contact forces and stress at R under different compliance",
               partial(two_studies, left=MODULI, right=SLENDER)),
    "fig-12": ("Fig. 12: hysteresis loops of the normal element", figure_12),
    "fig-13": ("Fig. 13: postures of the driven finger; the contact's own instant included",
               figure_13),
    "fig-14": ("Fig. 14: contact forces and stress at R of the driven finger", figure_14),
    "fig-15": ("Fig. 15: bending deflection of the third phalanx in its first node's frame",
               figure_15),
    "fig-16": ("Fig. 16: tangential velocity of the contact particle P", figure_16),
}  # fmt: skip


def draw_figures(
    folder: Path, runs: CaseRuns, references: Mapping[str, RunRecord]
) -> list[tuple[Path, str]]:
    """Draw all figures; returns paths and captions. references : the reference's runs by scene."""
    own = [replace(runs[scene].record, variant="") for scene in SCENES]
    overlay_figure(folder / "fig-09.png", [*own, *references.values()], (), SCENES)
    against = " against the ls-dyna-like reference (other model)" * bool(references)
    captions = {"fig-09": f"Fig. 9: reduced model{against}"}
    for name, (caption, draw) in FIGURES.items():
        draw(folder / f"{name}.png", runs)
        captions[name] = caption
    return [
        (folder / f"{name}.png", f"{caption}. Source: our own runs.")
        for name, caption in sorted(captions.items())
    ]
