"""Stability maps as pictures: one colour an answer, panels side by side."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from validation.harness.figures import BLUE, GREEN, GREY, ORANGE, STYLE
from validation.harness.files import atomic
from validation.studies.stress.stability_map import (
    ANSWERS,
    FLAGGED,
    REFUSED,
    RIGHT,
    SMALLER,
    STOPPED,
    WRONG,
    Map,
)

COLORS = {RIGHT: GREEN, SMALLER: "#7fcfb5", REFUSED: GREY, STOPPED: BLUE, WRONG: ORANGE,
          FLAGGED: "#f0e442"}  # fmt: skip
Answers = Mapping[tuple[float, float, float], str]


def _ticks(values: Sequence[float], most: int) -> tuple[list[int], list[str]]:
    every = max(1, -(-len(values) // most))
    places = list(range(0, len(values), every))
    return places, [f"{values[i]:.2g}" for i in places]


def draw_map(path: Path, wanted: Map, answers: Answers, limit: str) -> None:
    """Draw one map under what limits it; cells that are not finished stay white."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    colors = ListedColormap([COLORS[answer] for answer in ANSWERS])
    with plt.rc_context({**STYLE, "axes.grid": False}):
        figure, axes = plt.subplots(
            1, len(wanted.panels), figsize=(1.2 + 2.9 * len(wanted.panels), 3.6),
            layout="constrained", squeeze=False, sharey=True,
        )  # fmt: skip
        for axis, panel in zip(axes[0], wanted.panels, strict=True):
            codes = np.full((len(wanted.y), len(wanted.x)), np.nan)
            for j, y in enumerate(wanted.y):
                for i, x in enumerate(wanted.x):
                    if (x, y, panel) in answers:
                        codes[j, i] = ANSWERS.index(answers[x, y, panel])
            axis.imshow(codes, origin="lower", aspect="auto", cmap=colors, vmin=-0.5,
                        vmax=len(ANSWERS) - 0.5, interpolation="nearest")  # fmt: skip
            axis.set_xticks(*_ticks(wanted.x, 4))
            axis.set_yticks(*_ticks(wanted.y, 6))
            axis.set_xlabel(wanted.x_name)
            if wanted.panel_name:
                axis.set_title(f"{wanted.panel_name} = {panel:g}", fontsize=9, loc="left")
        axes[0][0].set_ylabel(wanted.y_name)
        seen = [answer for answer in ANSWERS if answer in set(answers.values())]
        patches = [Patch(color=COLORS[answer], label=answer) for answer in seen]
        figure.legend(handles=patches, loc="outside lower center", ncols=len(patches) or 1)
        width = int(16 * figure.get_figwidth())
        title = textwrap.fill(f"{wanted.name}: {limit}", width)
        figure.suptitle(title, fontsize=8, x=0.01, ha="left")
        with atomic(path) as temporary:
            figure.savefig(temporary, format="png")
        plt.close(figure)
