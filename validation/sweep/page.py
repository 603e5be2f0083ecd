"""A sweep's page: models against each other, errors over the variables, the worst scenes."""

from __future__ import annotations

import itertools
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from validation.harness.figures import BLACK, BLUE, COLORS, panels
from validation.harness.page import write_page
from validation.harness.provenance import provenance
from validation.harness.quantities import OF_A_TAP, Quantity, quantities
from validation.harness.tables import write_table
from validation.models import adapter
from validation.sweep.plan import Plan, assignment, quantity_of
from validation.sweep.points import PointTable
from validation.sweep.sensitivity import LEAST_POINTS, LEAST_Q2, Floats, sobol

if TYPE_CHECKING:
    import xarray

COMPARED = (*OF_A_TAP, *quantities("peak_stress_R_Pa"))
WORST = 10
MOST_MAPPED = 8  # variables of a map: 28 panels
WITHIN = (0.02, 0.05)  # shares that the table counts


@dataclass(frozen=True)
class Pair:
    """A model beside the one that it is compared with, by their places."""

    own: int
    base: int
    title: str


@dataclass(frozen=True)
class Output:
    """What is mapped over the variables: (n,) numbers, NaN where there are none."""

    title: str
    short: str
    values: Floats
    signed: bool


def pairs(plan: Plan) -> list[Pair]:
    """Each reduced model with each reference; where there is only one kind, all with the first."""
    kinds = [adapter(solver.model).kind for solver in plan.solvers]
    references = [i for i, kind in enumerate(kinds) if kind == "reference"]
    reduced = [i for i, kind in enumerate(kinds) if kind == "reduced"]
    places = list(itertools.product(reduced, references))
    if not places:
        places = [(i, 0) for i in range(1, len(kinds))]
    labels = [solver.label for solver in plan.solvers]
    return [Pair(own, base, f"{labels[own]} against {labels[base]}") for own, base in places]


def numbers(data: xarray.Dataset, entry: Quantity, place: int, error: bool = False) -> Floats:
    """A quantity of one model in its shown unit, NaN where its run did not complete."""
    name = f"{entry.key}_error" if error else entry.key
    if name not in data:
        return np.full(data.sizes["scene"], np.nan)
    values = entry.factor * data[name].values[:, place]
    return np.where(data["status"].values[:, place] == "COMPLETED", values, np.nan)


def differences(data: xarray.Dataset, entry: Quantity, pair: Pair) -> Floats:
    """(own - base)/|base|."""
    own, base = (numbers(data, entry, place) for place in (pair.own, pair.base))
    return np.asarray((own - base) / np.where(base == 0.0, np.nan, np.abs(base)))


def table(data: xarray.Dataset, chosen: Sequence[Pair]) -> list[dict[str, Any]]:
    """A row a pair and a quantity: how far the models are apart, and what the stated errors say."""
    rows = []
    for pair, entry in itertools.product(chosen, COMPARED):
        found = differences(data, entry, pair)
        apart = np.abs(found[np.isfinite(found)])
        stated = np.hypot(
            *(np.nan_to_num(numbers(data, entry, p, True)) for p in (pair.own, pair.base))
        )
        base = np.abs(numbers(data, entry, pair.base))
        beyond = np.abs(found) * base > stated
        row: dict[str, Any] = {"models": pair.title, "quantity": entry.title, "scenes": apart.size}
        if apart.size:
            row |= {
                "median (%)": 100 * float(np.median(apart)),
                "95 of 100 below (%)": 100 * float(np.quantile(apart, 0.95)),
                "largest (%)": 100 * float(apart.max()),
                "bias (%)": 100 * float(np.nanmean(found)),
            }
            row |= {f"within {100 * w:g} % (%)": 100 * float(np.mean(apart <= w)) for w in WITHIN}
            row["beyond both stated errors (%)"] = 100 * float(beyond.sum() / apart.size)
        rows.append(row)
    return rows


def worst(
    plan: Plan, points: PointTable, data: xarray.Dataset, pair: Pair
) -> Iterator[dict[str, Any]]:
    """The scenes with the largest difference in force, impulse or duration, and how to rerun."""
    apart = np.array([np.abs(differences(data, entry, pair)) for entry in OF_A_TAP])
    largest = np.nan_to_num(apart, nan=-1.0).max(axis=0)
    for place in np.argsort(-largest)[:WORST].tolist():
        if largest[place] < 0.0:
            return
        entry = OF_A_TAP[int(np.nanargmax(apart[:, place]))]
        yield {
            "scene": place,
            "largest difference (%)": 100 * float(largest[place]),
            "in": entry.title,
            "models": pair.title,
            "run again": " && ".join(
                command(plan, points, place, solver) for solver in (pair.own, pair.base)
            ),
        }


def command(plan: Plan, points: PointTable, point: int, solver: int) -> str:
    """The command that runs a scene of the sweep again."""
    chosen = plan.solvers[solver]
    own = (assignment(key, value) for key, value in chosen.set.items())
    changes = [*plan.common, *own, *points.overrides(point)]
    words = ["fingertap", "run", plan.source, "--model", chosen.model]
    return shlex.join([*words, *(word for change in changes for word in ("--set", change))])


def draw_parity(path: Path, data: xarray.Dataset, pair: Pair, labels: Sequence[str]) -> None:
    """Each quantity of one model over the other's, with both stated errors."""
    with panels(path, 2, len(COMPARED) // 2, height=3.0) as axes:
        for axis, entry in zip(axes.flat, COMPARED, strict=True):
            own, base = (np.abs(numbers(data, entry, p)) for p in (pair.own, pair.base))
            bars = [_bars(numbers(data, entry, p, True)) for p in (pair.own, pair.base)]
            known = np.isfinite(own) & np.isfinite(base)
            axis.errorbar(
                base[known], own[known], bars[0][known], bars[1][known], ".", color=BLUE,
                markersize=3.5, elinewidth=0.6,
            )  # fmt: skip
            if known.any():
                ends = [min(own[known].min(), base[known].min()),
                        max(own[known].max(), base[known].max())]  # fmt: skip
                axis.plot(ends, ends, color=BLACK, linewidth=0.8)
                if ends[0] > 0.0 and ends[1] > 20.0 * ends[0]:
                    axis.set(xscale="log", yscale="log")
            axis.set_title(f"{entry.title} ({entry.unit})", fontsize=9, loc="left")
            axis.set(xlabel=labels[pair.base], ylabel=labels[pair.own])


def _bars(errors: Floats) -> Floats:
    return np.nan_to_num(errors, nan=0.0, posinf=0.0)


def draw_distribution(path: Path, data: xarray.Dataset, chosen: Sequence[Pair]) -> None:
    """Share of scenes whose difference is no larger, a panel a quantity, a line a pair."""
    with panels(path, 2, len(COMPARED) // 2, height=2.8, sharey=True) as axes:
        for axis, entry in zip(axes.flat, COMPARED, strict=True):
            for number, pair in enumerate(chosen):
                found = np.abs(differences(data, entry, pair))
                apart = np.sort(np.maximum(found[np.isfinite(found)], 1e-8))
                share = np.arange(1, apart.size + 1) / max(apart.size, 1)
                color = COLORS[number % len(COLORS)]
                axis.step(100 * apart, 100 * share, where="post", color=color, label=pair.title)
            axis.set_xscale("log")
            axis.set_title(entry.title, fontsize=9, loc="left")
            axis.set(xlabel="difference, at most (%)", ylabel="scenes (%)")
        axes[0, 0].legend()


def variables(points: PointTable) -> dict[str, Floats]:
    """Values by key of what varies and is a number; of a list of numbers its last one."""
    found = {}
    for key, values in points.columns.items():
        flat = [v[-1] if isinstance(v, list) and v else v for v in values]
        if all(isinstance(v, int | float) for v in flat) and len(set(flat)) > 1:
            found[key] = np.array(flat, dtype=float)
    return found


def draw_map(path: Path, columns: dict[str, Floats], output: Output) -> None:
    """An output over every two variables, one panel each."""
    names = list(columns)[:MOST_MAPPED]
    rows = max(len(names) - 1, 1)
    size = float(np.nanquantile(np.abs(output.values), 0.98)) or 1.0
    low, high = (-size, size) if output.signed else (np.nanmin(output.values), size)
    with panels(path, rows, rows, width=2.1, height=1.9, style={"font.size": 7}) as axes:
        for row, column in itertools.product(range(rows), repeat=2):
            axis = axes[row, column]
            if column > row:
                axis.set_visible(False)
                continue
            x, y = names[column], names[min(row + 1, len(names) - 1)]
            over = columns[y] if len(names) > 1 else output.values
            shown = axis.scatter(
                columns[x], over, c=output.values, s=9, vmin=low, vmax=high,
                cmap="RdBu_r" if output.signed else "viridis", edgecolors="none",
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
    """Whether half of the values lie near their ends' geometric mean, far from the other one."""
    low, high = values.min(), values.max()
    return bool(low > 0.0 and high > 30.0 * low and np.median(values) ** 2 < 10.0 * low * high)


def _with_unit(key: str) -> str:
    quantity = quantity_of(key)
    unit = quantity.unit if quantity else ""
    return f"{key.rpartition('.')[2]} ({unit})" if unit else key.rpartition(".")[2]


def outputs(plan: Plan, data: xarray.Dataset, chosen: Sequence[Pair]) -> Iterator[Output]:
    """Differences of the pairs; of a single model its numbers."""
    for pair, entry in itertools.product(chosen, COMPARED):
        percent = 100 * differences(data, entry, pair)
        yield Output(f"{entry.title}: {pair.title}", "difference (%)", percent, signed=True)
    if not chosen:
        label = plan.solvers[0].label
        for entry in COMPARED:
            values = numbers(data, entry, 0)
            yield Output(f"{entry.title}: {label}", f"{entry.title} ({entry.unit})", values, False)


def sensitivities(columns: dict[str, Floats], found: Sequence[Output]) -> Iterator[dict[str, Any]]:
    """A row an output: Q^2 of its surrogate, then first-order and total indices by variable."""
    table = np.array(list(columns.values())).T
    for output in found:
        indices = sobol(table, output.values)
        if indices is None:
            continue
        row: dict[str, Any] = {"of": output.title, "Q2": indices.q2}
        for place, name in enumerate(columns):
            row[f"{name} first"] = float(indices.first[place])
            row[f"{name} total"] = float(indices.total[place])
        yield row


SOBOL_NOTE = (
    "First-order and total indices by scipy.stats.sobol_indices, of a thin-plate spline fitted to"
    " the sweep's points over the variables' ranks. Q2 is the share of the variance of points left"
    f" out of the fit that it explains: below {LEAST_Q2:g} no index is shown. Differences are"
    " signed."
)


def write_report(folder: Path, plan: Plan, points: PointTable, data: xarray.Dataset) -> Path:
    """Figures, tables and ``index.html``; returns the page."""
    import pandas as pd

    chosen, columns = pairs(plan), variables(points)
    labels = [solver.label for solver in plan.solvers]
    found = [o for o in outputs(plan, data, chosen) if np.isfinite(o.values).any()]
    sections: list[dict[str, Any]] = []

    def section(title: str, name: str, rows: Sequence[dict[str, Any]], *notes: str,
                figures: Sequence[Path] = ()) -> None:  # fmt: skip
        tables = []
        if rows:
            write_table(folder, name, pd.DataFrame(rows), title)
            tables = [{"name": name, "rows": list(rows), "columns": list(rows[0])}]
        if rows or figures:
            entry = {"title": title, "notes": notes, "figures": figures, "tables": tables}
            sections.append(entry)

    status = data["status"].values
    section("How the runs ended", "endings", [
        {"model": label, "status": name, "scenes": int(count)}
        for place, label in enumerate(labels)
        for name, count in zip(*np.unique(status[:, place], return_counts=True), strict=True)
    ])  # fmt: skip
    lead = [f"{int((status == 'COMPLETED').sum())} of {status.size} runs completed."]
    if chosen:
        apart = table(data, chosen)
        lead += [
            f"{row['models']}, {row['quantity']}: {row['median (%)']:.2g} % apart in the median of"
            f" {row['scenes']} scenes, {row['largest (%)']:.2g} % at most."
            for row in apart
            if "median (%)" in row and row["quantity"] == COMPARED[0].title
        ]
        distribution = folder / "distribution.png"
        draw_distribution(distribution, data, chosen)
        section("How far the models are apart", "differences", apart,
                figures=[distribution])  # fmt: skip
    for number, pair in enumerate(chosen):
        parity = folder / f"parity-{number}.png"
        draw_parity(parity, data, pair, labels)
        section(f"Parity: {pair.title}", "", (), "Bars are the errors that the runs state.",
                figures=[parity])  # fmt: skip
        section(f"The worst scenes: {pair.title}", f"worst-{number}",
                list(worst(plan, points, data, pair)))  # fmt: skip
    if columns:
        maps = [folder / f"map-{number}.png" for number in range(len(found))]
        for path, output in zip(maps, found, strict=True):
            draw_map(path, columns, output)
            section(f"Map: {output.title}", "", (), figures=[path])
    if plan.points.kind == "file":
        note = "No indices: a file's variables need not be independent."
        section("Sobol indices", "sobol", [{"of": note}])
    elif columns:
        few = f"Fewer than {LEAST_POINTS} completed points a variable."
        rows = list(sensitivities(columns, found)) or [{"of": few}]
        section("Sobol indices", "sobol", rows, SOBOL_NOTE)
    machine = {"part": f"{len(points)} scenes, {', '.join(labels)}", "quick": False,
               "load_average_at_start": None, **provenance(plan.document)}  # fmt: skip
    path = folder / "index.html"
    heading = f"Sweep: {plan.name}"
    context = {"sections": sections, "machines": [machine], "heading": heading, "lead": lead}
    write_page(path, "bench.html.j2", context)
    return path
