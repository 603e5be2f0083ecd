"""Log-log figures of the benchmark, in the project's style; failures drawn as failures."""

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from validation.harness.figures import COLORS, GREY, panels
from validation.studies.bench.bar import OWN, BarRow
from validation.studies.bench.kernels import Speed
from validation.studies.bench.ledger import Entry
from validation.studies.bench.measured import Point, front
from validation.studies.bench.scaling import Size, exponent

MARKERS = "osD^vPX"
SMALLEST = 1e-12  # what is drawn of an error that is zero
MANY = 300.0  # times a range's low end: too wide for three ticks a decade
QUANTITIES = (
    ("peak", r"error of peak $F_n$"),
    ("impulse", "error of impulse"),
    ("duration", "error of duration"),
    ("event_s", "error of event times (s)"),
)


def _label(point: Point) -> str:
    alone = point.solver in ("hcm", point.study)
    return point.series if alone else f"{point.solver}, {point.series}"


def crosses(axis: Any, points: Sequence[Point], color: str, scale: float) -> None:
    """Failed settings as crosses at the top, where they spent their time (times `scale`)."""
    for point in points:
        if not point.ok:
            axis.plot(point.wall_time_s * scale, 0.97, "x", color=color, markersize=7,
                      transform=axis.get_xaxis_transform(), clip_on=False)  # fmt: skip


def _ladder(axis: Any, points: Sequence[Point], quantity: str, style: dict[str, Any]) -> None:
    """A line through the settings that no other of the series beats; the others pale."""
    line = "-" if points[0].solver in ("hcm", points[0].study) else "--"
    every = [(p.wall_time_s, float(getattr(p.errors, quantity))) for p in points if p.ok]
    for pairs, given in (
        (every, {"linestyle": "", "alpha": 0.35, "markeredgewidth": 0}),
        (front(points, quantity), {"linestyle": line, "label": _label(points[0])}),
    ):
        times, errors = [1e3 * time for time, _ in pairs], [max(e, SMALLEST) for _, e in pairs]
        axis.plot(times, errors, linewidth=1.0, markersize=4, **given, **style)
    crosses(axis, points, style["color"], 1e3)


def plain_ticks(axis: Any) -> None:
    """Ticks written plainly; 1, 2, 5 of every decade where there is room: few decades."""
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    low, high = axis.get_view_interval()
    axis.set_major_locator(LogLocator(subs=(1, 2, 5) if high < MANY * low else (1,)))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(NullFormatter())


def work_precision(path: Path, points: Sequence[Point], floor: dict[str, float]) -> None:
    """One row a study, one column a quantity; `floor` is the truth's own relative error."""
    studies = list(dict.fromkeys(point.study for point in points))
    with panels(path, len(QUANTITIES), len(studies), width=3.4) as axes:
        for row, study in zip(axes, studies, strict=True):
            mine = [p for p in points if p.study == study]
            groups = list(dict.fromkeys((p.solver, p.series) for p in mine))
            for axis, (quantity, title) in zip(row, QUANTITIES, strict=True):
                for number, group in enumerate(groups):
                    style = {
                        "color": COLORS[number % len(COLORS)],
                        "marker": MARKERS[number % len(MARKERS)],
                    }
                    ladder = [p for p in mine if (p.solver, p.series) == group]
                    _ladder(axis, ladder, quantity, style)
                if study in floor and quantity != "event_s":
                    axis.axhline(floor[study], color=GREY, linewidth=0.8, linestyle=":")
                axis.set_xscale("log")
                axis.set_yscale("log")
                plain_ticks(axis.xaxis)
                axis.set_title(f"{study}: {title}", fontsize=9, loc="left")
                axis.set_xlabel("time (ms)")
                if axis.lines:
                    axis.legend(fontsize=6, frameon=True, framealpha=0.7, edgecolor="none")


def scaling(path: Path, sizes: Sequence[Size]) -> None:
    """Time of a step against elements and phalanges, with the fitted exponent."""
    groups = list(dict.fromkeys(size.what for size in sizes))
    with panels(path, len(groups)) as axes:
        for axis, what in zip(axes[0], groups, strict=True):
            mine = [size for size in sizes if size.what == what]
            n, t = [s.size for s in mine], [s.step_time_s for s in mine]
            fit = exponent(n, t)
            axis.loglog(n, [x * 1e6 for x in t], "o", color=COLORS[0], label="measured")
            line = [t[-1] * 1e6 * (x / n[-1]) for x in n]
            axis.loglog(n, line, "--", color=COLORS[1], linewidth=1, label="linear")
            unit = "elements a phalanx" if what == "elements" else what
            axis.set_title(f"hcm: exponent {fit:.2f}", fontsize=10, loc="left")
            axis.set_xlabel(unit)
            axis.set_ylabel("time of a step (us)")
            axis.legend()


def kernels(path: Path, speeds: Sequence[Speed]) -> None:
    """Updates per second of the reference's kernels, alone and in the whole step."""
    with panels(path, 1, width=5.6) as axes:
        axis = axes[0][0]
        names = [f"{s.element}, {s.threads} thread{'s' if s.threads > 1 else ''}" for s in speeds]
        alone = [s.updates_per_s / 1e6 for s in speeds]
        whole = [s.step_updates_per_s / 1e6 for s in speeds]
        for label, values, shift, color in (
            ("force alone", alone, -0.2, COLORS[2]),
            ("whole step", whole, 0.2, GREY),
        ):
            places = [number + shift for number in range(len(speeds))]
            axis.barh(places, values, height=0.38, color=color, label=label)
            for place, value in zip(places, values, strict=True):
                axis.annotate(f" {value:.3g}", (value, place), va="center", fontsize=7)
        axis.set_yticks(range(len(speeds)), names, fontsize=7)
        axis.invert_yaxis()
        axis.set_axisbelow(True)
        axis.margins(x=0.12)
        axis.legend()
        axis.set_xlabel("million element updates/s")
        axis.set_title(f"{speeds[0].elements:,} elements", fontsize=10, loc="left")


def bar_peers(path: Path, rows: Sequence[BarRow]) -> None:
    """Updates per second of every code on the bar; a peer that failed is named, without a bar."""
    with panels(path, 1, width=5.6) as axes:
        axis = axes[0][0]
        names = [f"{row.code} {row.version}\n{row.element[:30]}" for row in rows]
        speeds = [(row.updates_per_s or 0.0) / 1e6 for row in rows]
        colors = [COLORS[2] if row.code == OWN else GREY for row in rows]
        axis.barh(range(len(rows)), speeds, color=colors)
        for number, (row, speed) in enumerate(zip(rows, speeds, strict=True)):
            text = f" {speed:.3g}" if row.ran is not None else f" {row.status[:40]}"
            axis.annotate(text, (speed or 0.02, number), va="center", fontsize=8)
        axis.set_yticks(range(len(rows)), names, fontsize=7)
        axis.invert_yaxis()
        axis.set_xscale("log")
        axis.margins(x=0.15)
        axis.set_axisbelow(True)
        axis.set_xlabel("million element updates/s, whole steps")
        bar = rows[0].bar
        axis.set_title(f"{bar.elements} hexahedra, {bar.threads} threads", fontsize=10, loc="left")


def skips(path: Path, entries: Sequence[Entry]) -> None:
    """Speed-up of every shortcut against the largest change that it makes."""
    shown = [entry for entry in entries if entry.speedup is not None]
    with panels(path, 1, width=7.0) as axes:
        axis = axes[0][0]
        axis.barh(range(len(shown)), [e.speedup for e in shown], color=COLORS[2])
        for number, entry in enumerate(shown):
            change = entry.largest_change
            text = "" if change is None else f" {entry.speedup:.3g}x, changes {change:.1g}"
            axis.annotate(text, (max(entry.speedup or 1.0, 1.0), number), va="center", fontsize=7)
        names = [
            textwrap.shorten(f"{e.model}: {e.shortcut}", 54, placeholder=" ...") for e in shown
        ]
        axis.set_yticks(range(len(shown)), names, fontsize=7)
        axis.invert_yaxis()
        axis.axvline(1.0, color=GREY, linewidth=0.8)
        axis.set_xscale("log")
        axis.margins(x=0.25)
        axis.set_axisbelow(True)
        axis.set_xlabel("time without the shortcut over the time with it")
