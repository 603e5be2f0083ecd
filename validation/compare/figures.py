"""Contact forces over t - t_c: the paper's figs. 7 and 9 from our own runs, every step."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from validation.compare.force_curves import FORCES, contact_curve, steps_within
from validation.harness.figures import BLACK, BLUE, GREEN, GREY, ORANGE, panels
from validation.harness.record import RunRecord

Draw = Callable[[Any, str], None]


def usable(run: RunRecord) -> bool:
    """Whether a run has contact curves to draw."""
    return run.value("contact_time_s") is not None and "normal_force_N" in run.contact_forces


def _limit(axis: Any, runs: Sequence[RunRecord]) -> tuple[float, float]:
    """Draw a little more than the longest first tap; returns these times t - t_c, s."""
    longest = max((run.value("contact_duration_s") or 0.0 for run in runs), default=0.0) or 1e-3
    start, end = -0.04 * longest, 1.12 * longest
    axis.set_xlim(1e3 * start, 1e3 * end)
    return start, end


def _plot_run(axis: Any, run: RunRecord, label: str, look: tuple[str, str, float]) -> None:
    """Both forces of every step over t - t_c."""
    color, line, width = look
    time = 1e3 * (run.contact_forces["time_s"] - (run.value("contact_time_s") or 0.0))
    for force, title in zip(FORCES, (label, None), strict=True):
        axis.plot(time, run.contact_forces[force], line, color=color, linewidth=width, label=title)


def _panels(path: Path, scenes: Sequence[str], draw: Draw) -> None:
    """One panel per scene, side by side, written atomically."""
    with panels(path, len(scenes), height=3.3) as axes:
        for axis, scene in zip(axes[0], scenes, strict=True):
            draw(axis, scene)
            axis.axhline(0, color=BLACK, linewidth=0.6)
            axis.set_title(f"{scene} finger", fontsize=10, loc="left")
            axis.set_xlabel(r"$t - t_c$ (ms)")
            axis.set_ylabel("contact force (N)")
            axis.annotate("$F_n$", (0.02, 0.93), xycoords="axes fraction")
            axis.annotate("$F_t$", (0.02, 0.04), xycoords="axes fraction")
        handles, labels = axes[0][0].get_legend_handles_labels()
        for axis in axes[0][1:]:  # a run may be missing on one scene only
            for handle, label in zip(*axis.get_legend_handles_labels(), strict=True):
                if label not in labels:
                    handles.append(handle)
                    labels.append(label)
        if handles:
            axes[0][0].figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))


def mesh_figure(path: Path, runs: Sequence[tuple[str, RunRecord]], scenes: Sequence[str]) -> None:
    """Fig. 7: the reduced model with different numbers of elements.

    Parameters
    ----------
    runs : label and run of each line.
    """
    looks = ((GREY, "-", 3.0), (ORANGE, "--", 1.6), (BLACK, ":", 1.4))

    def draw(axis: Any, scene: str) -> None:
        drawn = [(label, run) for label, run in runs if run.scene == scene and usable(run)]
        for (label, run), look in zip(drawn, looks, strict=False):
            _plot_run(axis, run, label, look)
        _limit(axis, [run for _, run in drawn])

    _panels(path, scenes, draw)


def overlay_figure(
    path: Path,
    runs: Sequence[RunRecord],
    spread_over: Sequence[RunRecord],
    scenes: Sequence[str],
) -> None:
    """Fig. 9: the reduced model against the reference.

    Parameters
    ----------
    runs : one line each.
    spread_over : runs whose smallest and largest force at each time make the shaded band.
    """
    looks = {
        "hcm": (BLACK, "-", 1.8),
        "hcm-refined": (BLACK, "--", 1.4),
        "fem3d contact": (ORANGE, "-", 1.6),
        "fem3d ls-dyna-like": (BLUE, "-", 1.2),
        "fem3d fast": (BLUE, "--", 1.2),
        "fem2d fast": (GREEN, "-.", 1.2),
    }

    def draw(axis: Any, scene: str) -> None:
        drawn = [run for run in runs if run.scene == scene and usable(run)]
        band = [run for run in spread_over if run.scene == scene and usable(run)]
        start, end = _limit(axis, [*drawn, *band])
        if len(band) > 1:
            time = np.concatenate([[start], steps_within(end, band)])
            for force, label in zip(
                FORCES, (f"3D: {len(band)} meshes and penalties", None), strict=True
            ):
                curves = [contact_curve(run, force, time) for run in band]
                lowest, highest = np.min(curves, axis=0), np.max(curves, axis=0)
                axis.fill_between(
                    1e3 * time, lowest, highest, color=ORANGE, alpha=0.15, lw=0, label=label
                )
        for run in drawn:
            _plot_run(axis, run, run.label, looks.get(run.label, (GREY, "-", 1.0)))

    _panels(path, scenes, draw)
