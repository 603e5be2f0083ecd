"""A row of panels in the project's style, written atomically."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from validation.compare.figures import BLACK, BLUE, GREEN, ORANGE, STYLE
from validation.harness.files import atomic

COLORS = (BLACK, ORANGE, BLUE, GREEN)


@contextmanager
def panels(path: Path, columns: int, rows: int = 1, width: float = 4.1) -> Iterator[Any]:
    """Axes (rows, columns); the figure is saved when the block ends without an error."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(
            rows, columns, figsize=(width * columns, 3.2 * rows), layout="constrained",
            squeeze=False,
        )  # fmt: skip
        try:
            yield axes
            with atomic(path) as temporary:
                figure.savefig(temporary, format="png")
        finally:
            plt.close(figure)


def label(axis: Any, title: str, x: str, y: str) -> None:
    """Title at the left, axes named, a line at zero, a legend."""
    axis.set_title(title, fontsize=10, loc="left")
    axis.set_xlabel(x)
    axis.set_ylabel(y)
    axis.axhline(0, color=BLACK, linewidth=0.6)
    axis.legend()
