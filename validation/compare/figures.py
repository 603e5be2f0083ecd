"""Contact forces over t - t_c: the paper's figs. 7 and 9 from our own runs, every step."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from validation.compare.differences import Difference
from validation.compare.force_curves import FORCES, contact_curve, first_tap
from validation.harness.figures import BLACK, BLUE, COLORS, GREEN, GREY, ORANGE, panels
from validation.harness.record import RunRecord

Draw = Callable[[Any, str], None]
LOOKS = {  # by label, of each line in the overlay
    "hcm": (BLACK, "-", 1.8),
    "hcm-refined": (BLACK, "--", 1.4),
    "fem3d contact": (ORANGE, "-", 1.6),
    "fem3d ls-dyna-like": (BLUE, "-", 1.2),
    "fem3d fast": (BLUE, "--", 1.2),
    "fem2d fast": (GREEN, "-.", 1.2),
}
OTHER = (GREY, "-", 1.0)
BAND = 800  # times of the shaded band: its edges are not simplified as lines are
NOTHING: Mapping[str, Sequence[tuple[RunRecord, RunRecord]]] = MappingProxyType({})


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


def _panels(path: Path, scenes: Sequence[str], draw: Draw, below: Draw | None = None) -> None:
    """One panel per scene, side by side, another `below` each if there is one."""
    shape: dict[str, Any] = {"figsize": (4.1 * len(scenes), 3.3)}
    if below is not None:
        shape = {"figsize": (4.1 * len(scenes), 4.4), "height_ratios": (3, 1), "sharex": "col"}
    with panels(path, len(scenes), 1 if below is None else 2, **shape) as axes:
        for axis, scene in zip(axes[0], scenes, strict=True):
            draw(axis, scene)
            axis.axhline(0, color=BLACK, linewidth=0.6)
            axis.set_title(f"{scene} finger", fontsize=10, loc="left")
            axis.set_ylabel("contact force (N)")
            axis.annotate("$F_n$", (0.02, 0.93), xycoords="axes fraction")
            axis.annotate("$F_t$", (0.02, 0.04), xycoords="axes fraction")
        if below is not None:
            for axis, scene in zip(axes[1], scenes, strict=True):
                below(axis, scene)
        for axis in axes[-1]:
            axis.set_xlabel(r"$t - t_c$ (ms)")
        handles, labels = axes[0][0].get_legend_handles_labels()
        for axis in axes[0][1:]:  # a run may be missing on one scene only
            for handle, label in zip(*axis.get_legend_handles_labels(), strict=True):
                if label not in labels:
                    handles.append(handle)
                    labels.append(label)
        if handles:
            axes[0][0].figure.legend(handles, labels, loc="outside lower center", ncols=4)


def difference_figure(path: Path, rows: Sequence[Difference], scenes: Sequence[str]) -> None:
    """E of every model, with u as a bar where both runs state errors; a panel a scene."""
    models = list(dict.fromkeys(row.model for row in rows))
    titles = list(dict.fromkeys(row.quantity.title for row in rows))
    with panels(path, len(scenes), height=0.9 + 0.25 * len(titles), sharey=True) as axes:
        for axis, scene in zip(axes[0], scenes, strict=True):
            for number, model in enumerate(models):
                mine = [r for r in rows if (r.scene, r.model) == (scene, model) and r.verdict]
                places = [titles.index(r.quantity.title) + 0.2 * number for r in mine]
                bars = [(r.verdict and r.verdict.uncertainty) or 0.0 for r in mine]
                color = COLORS[number % len(COLORS)]
                errors = [r.error_percent for r in mine]
                axis.errorbar(errors, places, None, bars, "o", color=color, capsize=3, label=model)
            axis.axvline(0, color=BLACK, linewidth=0.8)
            axis.set_title(f"{scene} finger: difference from the reference", fontsize=9, loc="left")
            axis.set(xlabel="%", yticks=range(len(titles)), yticklabels=titles)
        axes[0, 0].invert_yaxis()
        axes[0, -1].legend()


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
    compared: Mapping[str, Sequence[tuple[RunRecord, RunRecord]]] = NOTHING,
) -> None:
    """Fig. 9: the reduced model against the reference.

    Parameters
    ----------
    runs : one line each.
    spread_over : runs whose smallest and largest force at each time make the shaded band.
    compared : by scene, references and runs whose difference from them is drawn below: of F_n, in
        percent of the reference's peak.
    """

    def residuals(axis: Any, scene: str) -> None:
        for reference, run in compared.get(scene, ()):
            peak, both = reference.value("peak_normal_force_N"), usable(run) and usable(reference)
            tap = first_tap([run, reference], "normal_force_N") if both and peak else None
            if tap is not None and peak:
                time, (own, base) = tap
                color, line, width = LOOKS.get(run.label, OTHER)
                axis.plot(1e3 * time, 100 * (own - base) / peak, line, color=color, linewidth=width)
        axis.axhline(0, color=BLACK, linewidth=0.6)
        axis.set_ylabel(r"$\Delta F_n$ (% of peak)")

    def draw(axis: Any, scene: str) -> None:
        drawn = [run for run in runs if run.scene == scene and usable(run)]
        band = [run for run in spread_over if run.scene == scene and usable(run)]
        start, end = _limit(axis, [*drawn, *band])
        if len(band) > 1:
            time = np.linspace(start, end, BAND)
            for force, label in zip(
                FORCES, (f"3D: {len(band)} meshes and penalties", None), strict=True
            ):
                curves = [contact_curve(run, force, time) for run in band]
                lowest, highest = np.min(curves, axis=0), np.max(curves, axis=0)
                axis.fill_between(
                    1e3 * time, lowest, highest, color=ORANGE, alpha=0.15, lw=0, label=label
                )
        for run in drawn:
            _plot_run(axis, run, run.label, LOOKS.get(run.label, OTHER))

    _panels(path, scenes, draw, residuals if compared else None)
