"""Contact forces over t - t_c: the paper's figs. 7 and 9 from our own runs, every step."""

import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from validation.compare.differences import Difference
from validation.compare.force_curves import FORCES, contact_curve, first_tap
from validation.harness.figures import BLACK, BLUE, COLORS, GREEN, GREY, ORANGE, legend, panels
from validation.harness.record import RunRecord

Look = tuple[str, str, float]  # colour, style and width of a line
Line = tuple[RunRecord, str, Look]  # a run, its label and look
# File names may contain dollar signs.
AS_WRITTEN = {"text.parse_math": False}
LOOKS: Mapping[str, Look] = {  # of the lines in the overlay, by label
    "hcm": (BLACK, "-", 1.8),
    "hcm-refined": (BLACK, "--", 1.4),
    "fem3d contact": (ORANGE, "-", 1.6),
    "fem3d ls-dyna-like": (BLUE, "-", 1.2),
    "fem3d fast": (BLUE, "--", 1.2),
    "fem2d fast": (GREEN, "-.", 1.2),
}
# Looks of further labels, in turn: each has another colour and style than the one before, and
# none of the twelve is among LOOKS.
OTHER_COLORS, OTHER_STYLES, DOTS = (*COLORS[4:], GREY), ("-", "--", "-."), "o"
APART = 0.015  # of the axes' diagonal, between a data's dots: more samples would hide the lines
TICKS = 5  # most intervals of an axis of time: labels of more run together
SEEN = 0.1  # percent: what the page prints of a difference, and each of its axes shows at least
BAND = 800  # times of the shaded band: its edges are not simplified as lines are


def usable(run: RunRecord) -> bool:
    """Whether a run has contact curves to draw."""
    return run.value("contact_time_s") is not None and "normal_force_N" in run.contact_forces


def scenes_drawn(scenes: Iterable[str], runs: Sequence[RunRecord]) -> list[str]:
    """Those of the scenes of which a run has curves to draw."""
    return [scene for scene in scenes if any(r.scene == scene and usable(r) for r in runs)]


def looks(runs: Iterable[RunRecord]) -> dict[str, Look]:
    """The look of each label, its own or the next one of the others; data are dots."""
    found: dict[str, Look] = {}
    others = zip(itertools.cycle(OTHER_COLORS), itertools.cycle(OTHER_STYLES), strict=False)
    for label, run in {run.label: run for run in runs}.items():
        found[label] = LOOKS.get(label) or (*next(others), 1.4)
        if "data" in run.provenance:
            found[label] = (found[label][0], DOTS, 0.0)
    return found


def _draw_forces(axis: Any, lines: Sequence[Line], band: Sequence[RunRecord]) -> None:
    """Draw both forces over t - t_c, up to a little more than the longest first tap: of every run
    at every step, and the range of those of a band.
    """
    runs = [*(run for run, _, _ in lines), *band]
    longest = max((run.value("contact_duration_s") or 0.0 for run in runs), default=0.0) or 1e-3
    start, end = -0.04 * longest, 1.12 * longest
    axis.set_xlim(1e3 * start, 1e3 * end)
    if len(band) > 1:
        time, label = np.linspace(start, end, BAND), f"3D: {len(band)} meshes and penalties"
        for force, title in zip(FORCES, (label, None), strict=True):
            curves = [contact_curve(run, force, time) for run in band]
            lowest, highest = np.min(curves, axis=0), np.max(curves, axis=0)
            axis.fill_between(
                1e3 * time, lowest, highest, color=ORANGE, alpha=0.15, lw=0, label=title
            )
    for run, label, (color, style, width) in lines:
        time = 1e3 * (run.contact_forces["time_s"] - (run.value("contact_time_s") or 0.0))
        for force, title in zip(FORCES, (label, None), strict=True):
            values = run.contact_forces[force]
            if not np.isnan(values).all():  # data may have no tangential force
                axis.plot(
                    time, values, style, color=color, linewidth=width, label=title,
                    markersize=2.5, markevery=APART,
                )  # fmt: skip


def _panels(
    path: Path,
    scenes: Sequence[str],
    lines: Sequence[Line],
    spread_over: Sequence[RunRecord] = (),
    below: Callable[[Any, str], None] | None = None,
) -> None:
    """Draw one panel per scene, side by side, and a second one under each if `below` is given."""
    shape: dict[str, Any] = {"figsize": (4.1 * len(scenes), 3.3)}
    if below is not None:
        shape = {"figsize": (4.1 * len(scenes), 4.4), "height_ratios": (3, 1), "sharex": "col"}
    with panels(path, len(scenes), 1 if below is None else 2, style=AS_WRITTEN, **shape) as axes:
        for axis, scene in zip(axes[0], scenes, strict=True):
            drawn = [line for line in lines if line[0].scene == scene and usable(line[0])]
            band = [run for run in spread_over if run.scene == scene and usable(run)]
            _draw_forces(axis, drawn, band)
            axis.axhline(0, color=BLACK, linewidth=0.6)
            axis.set(title=f"{scene} finger", ylabel="contact force (N)")
            axis.annotate("$F_n$", (0.02, 0.93), xycoords="axes fraction", parse_math=True)
            axis.annotate("$F_t$", (0.02, 0.04), xycoords="axes fraction", parse_math=True)
        if below is not None:
            for axis, scene in zip(axes[1], scenes, strict=True):
                below(axis, scene)
        for axis in axes[-1]:
            axis.locator_params("x", nbins=TICKS)
            axis.set_xlabel(r"$t - t_c$ (ms)", parse_math=True)
        legend(axes[0], min(4, 2 * len(scenes)))


def assumption_bars(
    axes: Sequence[Any],
    titles: Sequence[str],
    names: Sequence[str],
    values: Any,
    split: int,
    starts: Any = 0.0,
) -> list[int]:
    """Draw horizontal bars, the first name's on top; returns their positions.

    axes, titles : one for each quantity.
    values, starts : (names, quantities), lengths of the bars and where they begin; NaN: no bar.
    split : index of the first name whose bars are grey and set apart.
    """
    places = [-n - (n >= split) for n in range(len(names))]
    colors = [BLUE if n < split else GREY for n in range(len(names))]
    starts = np.broadcast_to(starts, np.shape(values))
    for number, (axis, title) in enumerate(zip(axes, titles, strict=True)):
        axis.barh(places, np.array(values)[:, number], left=starts[:, number], color=colors)
        axis.set_yticks(places, [])
        axis.set_title(title)
    axes[0].set_yticks(places, [name.replace("_", " ") for name in names])
    return places


def difference_figure(
    path: Path,
    models: Sequence[Difference],
    stairs: Sequence[Sequence[Difference]],
    labels: Mapping[str, str],
) -> None:
    """Draw E of each model on a scene, with error bars u; between the first two, what steps add.

    models : all quantities of the first model, then of the next one, and so on.
    stairs : the same quantities after each step; the first entry is before any step.
    labels : titles by the model's name; under "" the title of the reference.
    """
    titles = list(dict.fromkeys(row.quantity.title for row in models))
    count = len(titles)
    rows = [models[n : n + count] for n in range(0, len(models), count)]
    after = np.array([[_percent(one) for one in step] for step in stairs]).reshape(-1, count)
    gained, begun = np.diff(after, axis=0), after[:-1]
    names = [labels[row[0].model] for row in rows]
    names[1:1] = [step[0].model for step in stairs[1:]]
    nothing = np.full((len(rows), count), np.nan)
    values, starts = (np.insert(nothing, 1, steps, axis=0) if len(steps) else nothing
                      for steps in (gained, begun))  # fmt: skip
    lines = [title.replace(" ", "\n", 1) for title in titles]
    with panels(
        path, count, width=1.45, height=1.05 + 0.145 * len(names), style=AS_WRITTEN
    ) as axes:
        places = assumption_bars(axes[0], lines, names, values, len(names), starts)
        ours = places[:1] + places[1 + len(gained) :]
        for axis, column in zip(axes[0], zip(*rows, strict=True), strict=True):
            errors = [_percent(one) for one in column]
            known = [(one.verdict and one.verdict.uncertainty) or 0.0 for one in column]
            axis.errorbar(errors, ours, None, known, "o", color=BLACK, markersize=4, capsize=3)
            axis.axvline(0, color=ORANGE, linewidth=1.2)
            axis.use_sticky_edges = False
            axis.margins(x=0.12)
            low, high = axis.get_xlim()
            axis.set_xlim(min(low, -SEEN), max(high, SEEN))
            axis.set_ylim(places[-1] - 0.6, 0.6)
            axis.locator_params("x", nbins=3)
            axis.set_title(axis.get_title("left"), fontsize=9)
        figure = axes[0][0].figure
        figure.suptitle(f"{models[0].scene} finger", x=0.01, ha="left", fontsize=10)
        figure.supxlabel(f"% from {labels['']} (line)", fontsize=9)


def _percent(one: Difference) -> float:
    return np.nan if one.error_percent is None else one.error_percent


def mesh_figure(path: Path, runs: Sequence[tuple[str, RunRecord]], scenes: Sequence[str]) -> None:
    """Fig. 7: the reduced model with different numbers of elements, a labelled line for each."""
    by_order = ((GREY, "-", 3.0), (ORANGE, "--", 1.6), (BLACK, ":", 1.4))
    lines: list[Line] = []
    for scene in scenes:
        drawn = [(run, label) for label, run in runs if run.scene == scene and usable(run)]
        lines += [(*line, look) for line, look in zip(drawn, by_order, strict=False)]
    _panels(path, scenes, lines)


def overlay_figure(
    path: Path,
    runs: Sequence[RunRecord],
    spread_over: Sequence[RunRecord],
    scenes: Sequence[str],
    compared: Mapping[str, Sequence[tuple[RunRecord, RunRecord]]] | None = None,
) -> None:
    """Fig. 9: the reduced model against the reference.

    spread_over : runs whose smallest and largest force at each time make the shaded band.
    compared : by scene, pairs of a reference and one of the runs, whose difference in F_n is drawn
        below the forces, in percent of the reference's peak.
    """
    by_label = looks(runs)

    def residuals(axis: Any, scene: str) -> None:
        for reference, run in (compared or {}).get(scene, ()):
            peak, both = reference.value("peak_normal_force_N"), usable(run) and usable(reference)
            tap = first_tap([run, reference], "normal_force_N") if both and peak else None
            if tap is not None and peak:
                time, (own, base) = tap
                color, line, width = by_label[run.label]
                axis.plot(1e3 * time, 100 * (own - base) / peak, line, color=color, linewidth=width)
        axis.axhline(0, color=BLACK, linewidth=0.6)
        axis.set_ylabel(r"$\Delta F_n$ (% of peak)", parse_math=True)

    lines = [(run, run.label, by_label[run.label]) for run in runs]
    _panels(path, scenes, lines, spread_over, residuals if compared else None)
