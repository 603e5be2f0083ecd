"""The style that all figures share, and panels that are written atomically."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from validation.harness.files import atomic

# Okabe and Ito's palette: distinct in print and for colour-blind readers.
BLACK, ORANGE, BLUE, GREEN, GREY = "#111111", "#d55e00", "#0072b2", "#009e73", "#888888"
COLORS = (BLACK, ORANGE, BLUE, GREEN, "#cc79a7", "#e69f00", "#56b4e9")
TICKS = 5  # labels of a logarithmic axis, about: more run together

STYLE = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.titlelocation": "left",
    "axes.titlesize": 10,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.linewidth": 0.4,
    "grid.color": "#dddddd",
    "legend.frameon": False,
    "legend.fontsize": 8,
    "lines.linewidth": 1.4,
    "savefig.dpi": 160,
    "svg.hashsalt": "fingertap",  # the same figure gives the same file
    "figure.facecolor": "white",
}


@contextmanager
def panels(
    path: Path,
    columns: int,
    rows: int = 1,
    width: float = 4.1,
    height: float = 3.2,
    style: dict[str, Any] | None = None,
    **subplots: Any,
) -> Iterator[Any]:
    """Axes (rows, columns) of a figure, saved as PNG and SVG when the block ends without an error.

    width, height : of one panel, inches.
    style : matplotlib settings in addition to `STYLE`.
    subplots : further arguments of `matplotlib.pyplot.subplots`.
    """
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    with plt.rc_context({**STYLE, **(style or {})}):
        size = {"figsize": (width * columns, height * rows), "layout": "constrained"}
        figure, axes = plt.subplots(rows, columns, squeeze=False, **{**size, **subplots})
        try:
            yield axes
            with atomic(path) as temporary:
                figure.savefig(temporary, format="png")
            with atomic(path.with_suffix(".svg")) as temporary:
                figure.savefig(temporary, format="svg", metadata={"Date": None})
        finally:
            plt.close(figure)


def few_labels(axis: Any) -> None:
    """Label a logarithmic x axis at decades, or between them if it has less than two."""
    from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

    low, high = axis.get_xlim()
    between = (1, 2, 5) if high < 100.0 * low else (1,)
    few = MaxNLocator(TICKS) if high < 10.0 * low else LogLocator(subs=between, numticks=TICKS)
    axis.xaxis.set_major_locator(few)
    axis.xaxis.set_major_formatter("{x:g}")
    axis.xaxis.set_minor_formatter(NullFormatter())


def label(axis: Any, title: str, x: str, y: str) -> None:
    """Give an axis a title, axis labels, a line at zero and a legend."""
    axis.set(title=title, xlabel=x, ylabel=y)
    axis.axhline(0, color=BLACK, linewidth=0.6)
    axis.legend()


def legend(axes: Iterable[Any], columns: int) -> None:
    """One legend below the figure for the lines of these axes, some of which may lack a line."""
    named: dict[str, Any] = {}
    for axis in axes:
        for handle, name in zip(*axis.get_legend_handles_labels(), strict=True):
            named.setdefault(name, handle)
    if named:
        place = {"loc": "outside lower center", "ncols": columns}
        axis.figure.legend(list(named.values()), list(named), **place)
