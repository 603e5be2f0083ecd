"""Figures of the benchmark; failures are drawn as failures."""

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from validation.compare.tap_errors import tap_errors
from validation.harness.figures import BLACK, BLUE, COLORS, GREY, ORANGE, few_labels, panels
from validation.harness.uncertainty import two_digits
from validation.studies.bench.bar import OWN, BarRow
from validation.studies.bench.hcm_speed import Size, exponent
from validation.studies.bench.kernels import Speed
from validation.studies.bench.shortcuts import Entry
from validation.studies.bench.truths import TRUTHS, Truth
from validation.studies.bench.work_precision import Point, front

MARKERS = "osD^vPX"
SMALLEST = 1e-12  # drawn for an error of zero
HEADROOM = 6.0  # above the highest point, for the crosses of failed runs
ERRORS = (
    ("peak", r"error of peak $F_n$"),
    ("impulse", "error of impulse"),
    ("duration", "error of duration"),
    ("event_s", "error of event times (s)"),
)
MODELS = {
    "hcm": ("hcm", BLACK, "o"),
    "fem3d": ("3D reference", ORANGE, "s"),
    "fem2d": ("plane stress", BLUE, "^"),
}


def _draw_series(
    axis: Any, points: Sequence[Point], quantity: str, scale: float, style: dict[str, Any],
    line: dict[str, Any],
) -> None:  # fmt: skip
    """Draw a line through the settings that none beats, the others pale, failures as crosses.

    Times are multiplied by `scale`; failures are at the top, at the time that they took.
    """
    every = [(p.wall_time_s, float(getattr(p.errors, quantity))) for p in points if p.ok]
    for pairs, given in (
        (every, {"linestyle": "", "alpha": 0.35, "markeredgewidth": 0}),
        (front(points, quantity), line),
    ):
        times, errors = [scale * time for time, _ in pairs], [max(e, SMALLEST) for _, e in pairs]
        axis.plot(times, errors, **{"markersize": 4, **style, **given})
    for point in points:
        if not point.ok:
            axis.plot(point.wall_time_s * scale, 0.97, "x", color=style["color"], markersize=7,
                      transform=axis.get_xaxis_transform(), clip_on=False)  # fmt: skip


def _logarithmic(axis: Any, title: str, x: str, size: int) -> None:
    axis.set(xscale="log", yscale="log", xlabel=x)
    axis.set_title(title, fontsize=size)


def work_precision(path: Path, points: Sequence[Point]) -> None:
    """Draw a row per study, a column per quantity; a dotted line is the truth's own error."""
    studies = list(dict.fromkeys(point.study for point in points))
    with panels(path, len(ERRORS), len(studies), width=3.4) as axes:
        for row, study in zip(axes, studies, strict=True):
            mine = [p for p in points if p.study == study]
            groups = list(dict.fromkeys((p.solver, p.series) for p in mine))
            for axis, (quantity, title) in zip(row, ERRORS, strict=True):
                for number, (solver, series) in enumerate(groups):
                    own = solver in ("hcm", study)
                    style = {
                        "color": COLORS[number % len(COLORS)],
                        "marker": MARKERS[number % len(MARKERS)],
                        "linewidth": 1.0,
                    }
                    line = {"linestyle": "-" if own else "--",
                            "label": series if own else f"{solver}, {series}"}  # fmt: skip
                    group = [p for p in mine if (p.solver, p.series) == (solver, series)]
                    _draw_series(axis, group, quantity, 1e3, style, line)
                if study in TRUTHS and quantity != "event_s":
                    axis.axhline(TRUTHS[study].own_error, color=GREY, linewidth=0.8, linestyle=":")
                _logarithmic(axis, f"{study}: {title}", "time (ms)", 9)
                few_labels(axis)
                if axis.lines:
                    axis.legend(fontsize=6, frameon=True, framealpha=0.7, edgecolor="none")


def both_models(path: Path, points: Sequence[Point], truths: Mapping[str, Truth]) -> None:
    """Draw the cost of an error against each model's own truth, and the gap between the truths.

    No refinement brings one model nearer to the other than the gap between their truths: a point
    below the gap is exact as far as the comparison is concerned.

    points : `Point.solver` is the model.
    truths : by model; ``hcm``, ``fem3d`` and ``fem2d``.
    """
    gap = tap_errors(truths["hcm"].values, truths["fem3d"].values)
    with panels(path, 2, 2, width=5.0) as axes:
        for axis, (quantity, title) in zip(axes.flat, ERRORS, strict=True):
            for model, (name, color, marker) in MODELS.items():
                style = {"color": color, "marker": marker}
                line = {"linestyle": "-", "linewidth": 1.2, "label": name}
                mine = [p for p in points if p.solver == model]
                _draw_series(axis, mine, quantity, 1.0, style, line)
                if quantity != "event_s":
                    axis.axhline(truths[model].own_error, color=color, linewidth=0.7, linestyle=":")
            difference = getattr(gap, quantity)
            axis.axhline(difference, color=GREY, linewidth=1.2, linestyle="--")
            text = (
                f"{1e3 * difference:.2g} ms"
                if quantity == "event_s"
                else f"{two_digits(100 * difference)} %"
            )
            axis.annotate(f"gap between the models' truths: {text}", (0.01, difference),
                          xycoords=("axes fraction", "data"), ha="left", va="bottom",
                          fontsize=7, color="#555555")  # fmt: skip
            _logarithmic(axis, title, "time of a run (s)", 10)
            axis.set_ylim(top=HEADROOM * axis.get_ylim()[1])
        axes[0][0].legend(fontsize=8)


def scaling(path: Path, sizes: Sequence[Size]) -> None:
    """Draw the time of a step against elements and phalanges, with the fitted exponent."""
    groups = list(dict.fromkeys(size.what for size in sizes))
    with panels(path, len(groups)) as axes:
        for axis, what in zip(axes[0], groups, strict=True):
            mine = [size for size in sizes if size.what == what]
            n, t = [s.size for s in mine], [s.step_time_us for s in mine]
            axis.plot(n, t, "o", color=COLORS[0], label="measured")
            line = [t[-1] * (x / n[-1]) for x in n]
            axis.plot(n, line, "--", color=COLORS[1], linewidth=1, label="linear")
            unit = "elements a phalanx" if what == "elements" else what
            _logarithmic(axis, f"hcm: exponent {exponent(n, t):.2f}", unit, 10)
            axis.set_ylabel("time of a step (us)")
            axis.legend()


@contextmanager
def _bars(
    path: Path, names: Sequence[str], x: str, title: str, width: float = 5.6
) -> Iterator[Any]:
    """An axis for horizontal bars, the first name at the top."""
    with panels(path, 1, width=width) as axes:
        axis = axes[0][0]
        yield axis
        axis.set_yticks(range(len(names)), names, fontsize=7)
        axis.invert_yaxis()
        axis.set_axisbelow(True)
        axis.set(title=title, xlabel=x)


def kernels(path: Path, speeds: Sequence[Speed]) -> None:
    """Draw updates per second of the reference's kernels, alone and in the whole step."""
    names = [f"{s.element}, {s.threads} thread{'s' if s.threads > 1 else ''}" for s in speeds]
    title = f"{speeds[0].elements:,} elements"
    with _bars(path, names, "million element updates/s", title) as axis:
        for label, values, shift, color in (
            ("force alone", [s.million_updates_per_s for s in speeds], -0.2, COLORS[2]),
            ("whole step", [s.million_step_updates_per_s for s in speeds], 0.2, GREY),
        ):
            places = [number + shift for number in range(len(speeds))]
            axis.barh(places, values, height=0.38, color=color, label=label)
            for place, value in zip(places, values, strict=True):
                axis.annotate(f" {value:.3g}", (value, place), va="center", fontsize=7)
        axis.margins(x=0.12)
        axis.legend()


def bar_peers(path: Path, rows: Sequence[BarRow]) -> None:
    """Draw updates per second of every code on the bar; a failed peer is named, without a bar."""
    bar = rows[0].bar
    names = [
        f"{row.code} {row.version}\n{row.element[:30]}"
        + f", {row.bar.threads} thread" * (row.bar.threads != bar.threads)
        for row in rows
    ]
    title = f"{bar.elements} hexahedra, {bar.threads} threads"
    with _bars(path, names, "million element updates/s, whole steps", title) as axis:
        speeds = [row.updates_per_s / 1e6 for row in rows]
        colors = [COLORS[2] if row.code == OWN else GREY for row in rows]
        axis.barh(range(len(rows)), speeds, color=colors)
        for number, (row, speed) in enumerate(zip(rows, speeds, strict=True)):
            text = f" {speed:.3g}" if row.ran is not None else f" {row.status[:40]}"
            axis.annotate(text, (speed or 0.02, number), va="center", fontsize=8)
        axis.set_xscale("log")
        axis.margins(x=0.15)


def shortcuts(path: Path, entries: Sequence[Entry]) -> None:
    """Draw the speed-up by every shortcut, with the largest change that it makes."""
    names = [textwrap.shorten(f"{e.model}: {e.shortcut}", 54, placeholder=" ...") for e in entries]
    x = "time without the shortcut over the time with it"
    with _bars(path, names, x, "", width=7.0) as axis:
        axis.barh(range(len(entries)), [e.speedup for e in entries], color=COLORS[2])
        for number, entry in enumerate(entries):
            changes = entry.changes
            text = f" {entry.speedup:.3g}x, changes {changes.largest:.1g}" if changes else ""
            axis.annotate(text, (max(entry.speedup, 1.0), number), va="center", fontsize=7)
        axis.axvline(1.0, color=GREY, linewidth=0.8)
        axis.set_xscale("log")
        axis.margins(x=0.25)
