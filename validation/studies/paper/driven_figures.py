"""Figs. 13 to 16: postures, forces, deflection and stick-slip of the driven finger."""

from __future__ import annotations

from pathlib import Path
from string import ascii_uppercase

import numpy as np

from validation.harness.figures import COLORS, label, panels
from validation.studies.paper.driven_cases import POSTURE_TIMES, PRINTED_TORQUES
from validation.studies.paper.finding import Runs, curve, particle_velocity, window
from validation.studies.paper.stored_cases import CaseRun
from validation.studies.paper.undriven_figures import TIME, draw_forces, draw_stress

THREE = "driven-3"
CASES = [(name, f"case {name[-1]}") for name in PRINTED_TORQUES]
SHARE = 0.05
# Inside the factor's uncertainty case 3 has two kinds of contact: the other one is drawn too.
OTHER = ("driven-3 case 2 alone", "case 3, factor of case 2 alone")
DRAWN_TWICE = (THREE, OTHER[0])


def figure_13(path: Path, runs: Runs, height: float = 0.1) -> None:
    """Postures before, at and after contact."""
    with panels(path, 3, width=3.6) as axes:
        for axis, (name, legend) in zip(axes[0], CASES, strict=True):
            run = runs[name]
            frames = [p for p in run.frames if p.time_s in POSTURE_TIMES[name]]
            shown = sorted((*frames, run.event_postures[0]), key=lambda p: p.time_s)
            for shade, posture in enumerate(shown):
                line = np.concatenate(posture.positions_m)
                axis.plot(
                    *line.T, color=COLORS[shade % len(COLORS)],
                    label=f"{1e3 * posture.time_s:.2f} ms",
                )  # fmt: skip
                hinges = np.array([nodes[0] for nodes in posture.positions_m])
                axis.plot(*hinges.T, "o", color=COLORS[shade % len(COLORS)], markersize=3)
            axis.axhline(-height, color="#888888", linewidth=2)
            axis.set_aspect("equal", adjustable="datalim")
            label(axis, f"{legend}", "X (m)", "Y (m)")
            axis.legend(loc="lower left", bbox_to_anchor=(0.0, 0.1))  # clear of the surface


def figure_14(path: Path, runs: Runs) -> None:
    """Contact forces and stress at R."""
    with panels(path, 2) as axes:
        draw_forces(axes[0][0], runs, [*CASES, OTHER])
        label(axes[0][0], "(a)", TIME, "$F_n$ (solid), $F_t$ (dashed) (N)")
        draw_stress(axes[0][1], runs, [*CASES, OTHER])
        label(axes[0][1], "(b)", TIME, r"$\sigma_R$ (MPa)")


def _drawn_events(run: CaseRun) -> list[int]:
    """Indices of contact, separation, and the reversals that part peaks of Fn.

    A peak stands out by a twentieth of the largest force: smaller ones are ripples on it.
    """
    from scipy.signal import find_peaks

    time, force = curve(run, "normal_force_N")
    least = SHARE * float(force.max())
    turns = [time[find_peaks(side, prominence=least)[0]] for side in (force, -force)]
    wanted = window(run.record)[0] + np.sort(np.concatenate([[0.0, time[-1]], *turns]))
    instants = np.array([event.time_s for event in run.record.events])
    return [int(np.abs(instants - t).argmin()) for t in wanted]


def figure_15(path: Path, runs: Runs) -> None:
    """Bending deflection of the third phalanx at contact, reversals and separation."""
    with panels(path, 3, width=3.6) as axes:
        for axis, (name, legend) in zip(axes[0], CASES, strict=True):
            run = runs[name]
            start = run.record.value("contact_time_s") or 0.0
            for letter, i in zip(ascii_uppercase, _drawn_events(run), strict=False):
                axial, deflection = run.event_postures[i].deflection(2)
                moment = 1e3 * (run.record.events[i].time_s - start)
                axis.plot(-axial, 1e3 * deflection, label=f"{letter}: {moment:.3f} ms")
            label(axis, legend, "axial position (m), tip at the left", "deflection (mm)")


def figure_16(path: Path, runs: Runs) -> None:
    """Velocity of the contact particle P."""
    with panels(path, 3, width=3.6) as axes:
        for axis, (name, legend), color in zip(axes[0], CASES, COLORS, strict=False):
            time, velocity = particle_velocity(runs[name])
            axis.plot(1e3 * time, velocity, color=color, label="$V_P$")
            if name == THREE:
                time, velocity = particle_velocity(runs[OTHER[0]])
                axis.plot(1e3 * time, velocity, color=COLORS[3], label=OTHER[1])
            label(axis, legend, TIME, "tangential velocity (m/s)")
