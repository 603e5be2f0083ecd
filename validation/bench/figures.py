"""Log-log figures of the benchmark, in the project's style; failures drawn as failures."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from validation.bench.kernels import Speed
from validation.bench.measured import Point
from validation.bench.scaling import Size, exponent
from validation.figures import GREY
from validation.paper.figure_panels import COLORS, panels

MARKERS = "osD^vP"
QUANTITIES = (
    ("peak", r"error of peak $F_n$"),
    ("impulse", "error of impulse"),
    ("duration", "error of duration"),
    ("event_s", "error of event times (s)"),
)


def _label(point: Point) -> str:
    return point.series if point.solver == "hcm" else f"{point.solver}, {point.series}"


def _ladder(axis: Any, points: Sequence[Point], quantity: str, style: dict[str, Any]) -> None:
    good = sorted(
        (p for p in points if p.ok), key=lambda p: (p.wall_time_s, getattr(p.errors, quantity))
    )
    axis.plot(
        [p.wall_time_s * 1e3 for p in good],
        [max(getattr(p.errors, quantity), 1e-12) for p in good],
        linestyle="--" if points[0].solver != "hcm" else "-",
        linewidth=1.0,
        markersize=4,
        label=_label(points[0]),
        **style,
    )
    for point in points:
        if point.errors is None and point.status != "FINEST":
            # no error to speak of: a cross at the top, where it spent its time
            axis.plot(point.wall_time_s * 1e3, 0.97, "x", color=style["color"], markersize=7,
                      transform=axis.get_xaxis_transform(), clip_on=False)  # fmt: skip


def plain_ticks(axis: Any) -> None:
    """Ticks 1, 2, 5 of every decade, written plainly: times often span less than a decade."""
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
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
                    axis.legend(fontsize=6)


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
    """Updates per second of the reference's kernels."""
    with panels(path, 1, width=5.0) as axes:
        axis = axes[0][0]
        names = [f"{s.element}\n{s.threads} thread{'s' if s.threads > 1 else ''}" for s in speeds]
        axis.bar(range(len(speeds)), [s.updates_per_s / 1e6 for s in speeds], color=COLORS[2])
        axis.set_xticks(range(len(speeds)), names, fontsize=7)
        axis.set_yscale("log")
        axis.set_ylabel("million element updates/s")
        axis.set_title("force kernels, 60,000 elements", fontsize=10, loc="left")
