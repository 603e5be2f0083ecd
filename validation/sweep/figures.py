"""A sweep's figures: parity, distribution of differences, maps over two variables."""

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray

from validation.harness.figures import BLACK, BLUE, COLORS, GREY, TICKS, few_labels, legend, panels
from validation.harness.quantities import TAP_AND_STRESS
from validation.scenes.messages import known_keys
from validation.sweep.axis import scene_number_of
from validation.sweep.dataset import Output, Pair, differences, numbers
from validation.sweep.sensitivity import Floats

MOST_MAPPED = 8  # variables of a map: 28 panels
WIDE = 20.0  # ratio of the largest to the smallest magnitude above which axes are logarithmic
LINEAR = 1000.0  # axes with both signs are linear below the largest value over this, at least


def draw_parity(path: Path, data: xarray.Dataset, pair: Pair, labels: Sequence[str]) -> None:
    """Plot each quantity of one model over the other's, signed, with both stated errors."""
    with panels(path, 2, len(TAP_AND_STRESS) // 2, height=3.0) as axes:
        for axis, entry in zip(axes.flat, TAP_AND_STRESS, strict=True):
            own, base = (numbers(data, entry, place) for place in (pair.own, pair.base))
            bars = [_bars(numbers(data, entry, p, True)) for p in (pair.own, pair.base)]
            known = np.isfinite(own) & np.isfinite(base)
            axis.errorbar(
                base[known], own[known], bars[0][known], bars[1][known], ".", color=BLUE,
                markersize=3.5, elinewidth=0.6,
            )  # fmt: skip
            if known.any():
                _scale(axis, np.concatenate([own[known], base[known]]))
            axis.set_title(f"{entry.title} ({entry.unit})", fontsize=9)
            axis.set_xlabel(labels[pair.base], parse_math=False)
            axis.set_ylabel(labels[pair.own], parse_math=False)


def _scale(axis: Any, values: Floats) -> None:
    """Draw the line of equal numbers, and logarithmic axes if they are wide: to both sides of zero
    if there are both signs, so that models which bend to different sides lie in another quadrant.
    """
    ends, sizes = [values.min(), values.max()], np.abs(values)
    axis.plot(ends, ends, color=BLACK, linewidth=0.8)
    if sizes.max() > WIDE * sizes.min():
        linear = max(sizes.min(), sizes.max() / LINEAR)
        for set_scale in (axis.set_xscale, axis.set_yscale):
            if ends[0] > 0.0:
                set_scale("log")
            else:
                set_scale("symlog", linthresh=linear)
        axis.locator_params(numticks=TICKS)
    if ends[0] < 0.0:
        axis.axhline(0.0, color=GREY, linewidth=0.8)
        axis.axvline(0.0, color=GREY, linewidth=0.8)


def _bars(errors: Floats) -> Floats:
    return np.nan_to_num(errors, nan=0.0, posinf=0.0)


def draw_distribution(path: Path, data: xarray.Dataset, chosen: Sequence[Pair]) -> None:
    """Plot the share of scenes below each difference: a panel per quantity, a line per pair."""
    with panels(path, 2, len(TAP_AND_STRESS) // 2, height=2.8, sharey=True) as axes:
        for axis, entry in zip(axes.flat, TAP_AND_STRESS, strict=True):
            for number, pair in enumerate(chosen):
                found = np.abs(differences(data, entry, pair))
                apart = np.sort(np.maximum(found[np.isfinite(found)], 1e-8))
                color = COLORS[number % len(COLORS)]
                title = pair.title.replace("$", r"\$")  # a variant's name is not a formula
                rises = np.concatenate([apart[:1], apart])
                share = np.arange(rises.size) / max(apart.size, 1)
                axis.step(100 * rises, 100 * share, where="post", color=color, label=title)
            axis.set_title(entry.title, fontsize=9)
            axis.set(xlabel="difference, at most (%)", ylabel="scenes (%)", xscale="log")
            few_labels(axis)
        legend(axes.flat, 2)


def draw_map(path: Path, columns: dict[str, Floats], output: Output) -> None:
    """Plot an output over every pair of variables, one panel per pair."""
    names = list(columns)[:MOST_MAPPED]
    rows = max(len(names) - 1, 1)
    if output.signed:
        high = float(np.nanquantile(np.abs(output.values), 0.98)) or 1.0
        low = -high
    else:
        low, high = np.nanquantile(output.values, (0.0, 0.98))
    inches = max(2.1, 4.2 / rows)  # a single panel is as wide as two
    style = {"font.size": 8}
    with panels(path, rows, rows, width=inches, height=0.9 * inches, style=style) as axes:
        for row, column in itertools.product(range(rows), repeat=2):
            axis = axes[row, column]
            if column > row:
                axis.set_visible(False)
                continue
            x, y = names[column], names[min(row + 1, len(names) - 1)]
            over = columns[y] if len(names) > 1 else output.values
            shown = axis.scatter(
                columns[x], over, c=output.values, s=12, vmin=low, vmax=high,
                cmap="RdBu_r" if output.signed else "viridis", edgecolors=GREY, linewidths=0.3,
            )  # fmt: skip
            for name, side in ((x, "x"), (y, "y")):
                if (len(names) > 1 or side == "x") and _even_in_logarithm(columns[name]):
                    getattr(axis, f"set_{side}scale")("log")
            if row == rows - 1:
                axis.set_xlabel(_with_unit(x))
            if column == 0:
                axis.set_ylabel(_with_unit(y) if len(names) > 1 else output.short)
        axes[0, 0].figure.colorbar(shown, ax=axes, label=output.short, shrink=0.6)


def _even_in_logarithm(values: Floats) -> bool:
    """Whether the range is wide and the median near the geometric mean of its ends."""
    low, high = values.min(), values.max()
    return bool(low > 0.0 and high > 30.0 * low and np.median(values) ** 2 < 10.0 * low * high)


def _with_unit(name: str) -> str:
    """The last word of a variable's name (`page.variables`), with its unit if it is a key."""
    number = scene_number_of(name) if name in known_keys() else None
    unit = number.unit if number else ""
    return f"{name.rpartition('.')[2]} ({unit})" if unit else name.rpartition(".")[2]
