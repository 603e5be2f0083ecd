"""A sweep's page: models against each other, errors over the variables, the worst scenes."""

import itertools
import shlex
from collections import Counter
from collections.abc import Hashable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray

from validation.harness import page
from validation.harness.files import remove
from validation.harness.quantities import OF_A_TAP, TAP_AND_STRESS
from validation.harness.uncertainty import two_digits, without_numbers
from validation.models import adapter, default_accuracy
from validation.scenes.load import changed_scene
from validation.scenes.solver_tables import NO_ACCURACY
from validation.sweep.dataset import Output, Pair, differences, numbers
from validation.sweep.figures import MOST_MAPPED, draw_distribution, draw_map, draw_parity
from validation.sweep.plan import Plan, assignment
from validation.sweep.points import PointTable
from validation.sweep.sensitivity import LEAST_POINTS, LEAST_Q2, MOST_MISSING, Floats, sobol

WORST = 10
STATED, BEYOND = "with stated errors", "beyond both stated errors (%)"
WITHIN = (0.02, 0.05)  # relative differences within which the table counts scenes
REPORT = (
    *("index.html", "endings.*", "differences.*", "distribution.*"),
    *("parity-*", "worst-*", "map-*", "sobol.*"),
)


def pairs(plan: Plan) -> list[Pair]:
    """Each reduced model with each reference; where there is only one kind, all with the first
    that the plan names.
    """
    kinds = [adapter(solver.model).kind for solver in plan.solvers]
    references = [i for i, kind in enumerate(kinds) if kind == "reference"]
    reduced = [i for i, kind in enumerate(kinds) if kind == "reduced"]
    places = list(itertools.product(reduced, references))
    if not places:
        places = [(i, 0) for i in range(1, len(kinds))]
    labels = [solver.label for solver in plan.solvers]
    return [Pair(own, base, f"{labels[own]} against {labels[base]}") for own, base in places]


def endings(data: xarray.Dataset, labels: Sequence[str]) -> Iterator[dict[str, Any]]:
    """A row per model and status; of runs that did not complete a message of the most frequent
    kind, whose numbers alone differ.
    """
    status, message = data["status"].values, data["message"].values
    for place, label in enumerate(labels):
        for name in np.unique(status[:, place]):
            ended = status[:, place] == name
            row: dict[str, Any] = {"model": label, "status": name, "scenes": int(ended.sum())}
            if name != "COMPLETED":
                said = message[ended, place].tolist()
                kinds = [without_numbers(text) for text in said]
                ((kind, _),) = Counter(kinds).most_common(1)
                row["most often"] = said[kinds.index(kind)]
            yield row


def table(data: xarray.Dataset, chosen: Sequence[Pair]) -> list[dict[str, Any]]:
    """A row per pair and quantity: how far the models are apart, how often beyond stated errors."""
    rows = []
    for pair, entry in itertools.product(chosen, TAP_AND_STRESS):
        found = differences(data, entry, pair)
        apart = np.abs(found[np.isfinite(found)])
        stated = np.hypot(*(numbers(data, entry, p, True) for p in (pair.own, pair.base)))
        known = np.isfinite(found) & np.isfinite(stated)
        beyond = np.abs(found * numbers(data, entry, pair.base)) > stated
        row: dict[str, Any] = {"models": pair.title, "quantity": entry.title, "scenes": apart.size}
        if apart.size:
            row |= {
                "median (%)": 100 * float(np.median(apart)),
                "95 of 100 below (%)": 100 * float(np.quantile(apart, 0.95)),
                "largest (%)": 100 * float(apart.max()),
                "bias (%)": 100 * float(np.nanmean(found)),
            }
            row |= {f"within {100 * w:g} % (%)": 100 * float(np.mean(apart <= w)) for w in WITHIN}
        if known.any():
            row[STATED] = int(known.sum())
            row[BEYOND] = 100 * float(np.mean(beyond[known]))
        rows.append(row)
    return rows


def _scenes(count: int) -> str:
    return f"{count} scene{'s' * (count != 1)}"


def _beyond(row: dict[str, Any]) -> str:
    if BEYOND not in row:
        return ""
    share = f"{row[BEYOND]:.0f} % differ by more than these together"
    return f"; of the {row[STATED]} with stated errors {share}"


def worst(
    plan: Plan, points: PointTable, data: xarray.Dataset, pair: Pair
) -> Iterator[dict[str, Any]]:
    """The scenes with the largest differences in force, impulse or duration; how to rerun them."""
    apart = np.array([np.abs(differences(data, entry, pair)) for entry in OF_A_TAP])
    largest = np.nan_to_num(apart, nan=-1.0).max(axis=0)
    for place in np.argsort(-largest)[:WORST].tolist():
        if largest[place] < 0.0:
            return
        entry = OF_A_TAP[int(np.nanargmax(apart[:, place]))]
        both = pair.own, pair.base
        told = [(plan.solvers[p].label, data["message"].values[place, p]) for p in both]
        yield {
            "scene": place,
            "largest of force, impulse, duration (%)": 100 * float(largest[place]),
            "in": entry.title,
            "models": pair.title,
            "what the runs caution against": "; ".join(
                f"{label}: {message}" for label, message in told if message
            ),
            "run again": " && ".join(
                f"{command(plan, points, place, solver)} --out out/{which}"
                for which, solver in (("own", pair.own), ("base", pair.base))
            ),
        }


def command(plan: Plan, points: PointTable, point: int, solver: int) -> str:
    """The command that runs a scene of the sweep again."""
    chosen = plan.solvers[solver]
    own = (assignment(key, value) for key, value in chosen.set.items())
    changes = [*plan.common, *own, *points.overrides(point)]
    words = ["fingertap", "run", plan.source, "--model", chosen.model]
    tables = changed_scene(plan.scene, plan.document, changes, plan.source).tables
    # unlike `run`, a sweep asks for no accuracy by default
    if default_accuracy(chosen.model, tables):
        words += ["--accuracy", NO_ACCURACY]
    return shlex.join([*words, *(word for change in changes for word in ("--set", change))])


def variables(points: PointTable) -> dict[str, Floats]:
    """What varies, by key, as numbers: for lists the component that tells them apart; for words and
    other lists their number in order of appearance.
    """
    found = {}
    for key, values in points.columns.items():
        names = [_hashable(value) for value in values]  # 1 and 1.0 are one level
        place = {name: n for n, name in enumerate(dict.fromkeys(names), 1)}
        if len(place) < 2:
            continue
        components = zip(*([v] if isinstance(v, int | float) else v for v in values), strict=False)
        telling = (
            column
            for column in components
            if all(isinstance(v, int | float) for v in column) and len(set(column)) == len(place)
        )
        of_values = next(telling, None)
        title = key if of_values else f"{key}, by its first appearance"
        found[title] = np.array(of_values or [place[name] for name in names], dtype=float)
    return found


def _hashable(value: Any) -> Hashable:
    parts = tuple(value.items()) if isinstance(value, dict) else value
    return tuple(map(_hashable, parts)) if isinstance(parts, list | tuple) else parts


def outputs(plan: Plan, data: xarray.Dataset, chosen: Sequence[Pair]) -> Iterator[Output]:
    """The pairs' differences in percent; without a pair, the single model's numbers."""
    for pair, entry in itertools.product(chosen, TAP_AND_STRESS):
        percent = 100 * differences(data, entry, pair)
        yield Output(f"{entry.title}: {pair.title}", "difference (%)", percent, signed=True)
    if not chosen:
        label = plan.solvers[0].label
        for entry in TAP_AND_STRESS:
            values = numbers(data, entry, 0)
            yield Output(f"{entry.title}: {label}", f"{entry.title} ({entry.unit})", values, False)


def sensitivities(columns: dict[str, Floats], found: Sequence[Output]) -> Iterator[dict[str, Any]]:
    """A row per output: Q^2 of its surrogate, then first-order and total indices by variable."""
    table = np.array(list(columns.values())).T
    for output in found:
        indices = sobol(table, output.values)
        if indices is None:
            continue
        count = int(np.isfinite(output.values).sum())
        scenes = f"{count} of {output.values.size}"
        row: dict[str, Any] = {"of": output.title, "scenes": scenes, "Q2": indices.q2}
        for place, name in enumerate(columns):
            row[f"{name} first"] = float(indices.first[place])
            row[f"{name} total"] = float(indices.total[place])
        yield row


SOBOL_NOTE = (
    "First-order and total indices by scipy.stats.sobol_indices, of a thin-plate spline fitted to"
    " the sweep's points over the variables' ranks. Q2 is the share of the variance of points left"
    f" out of the fit that it explains: below {LEAST_Q2:g} no index is shown, nor where more than"
    f" {100 * MOST_MISSING:g} % of the scenes have no number, as the variables of the rest may"
    " depend on each other. Differences are signed."
)


def clear_report(folder: Path) -> None:
    """Remove an older report, which does not fit the new dataset and may be of other models."""
    remove(folder, *REPORT)


def write_report(folder: Path, plan: Plan, points: PointTable, data: xarray.Dataset) -> Path:
    """Write figures, tables and ``index.html``; returns the page's path."""
    chosen, columns = pairs(plan), variables(points)
    labels = [solver.label for solver in plan.solvers]
    found = [o for o in outputs(plan, data, chosen) if np.isfinite(o.values).any()]
    sections: list[dict[str, Any]] = []
    clear_report(folder)

    def section(title: str, name: str, rows: Sequence[dict[str, Any]], *notes: str,
                figures: Sequence[Path] = ()) -> None:  # fmt: skip
        if rows or figures:
            sections.append(page.section(folder, title, name, rows, notes, figures))

    status = data["status"].values
    section("How the runs ended", "endings", list(endings(data, labels)))
    lead = [f"{int((status == 'COMPLETED').sum())} of {status.size} runs completed."]
    if chosen:
        apart = table(data, chosen)
        lead += [
            f"{row['models']}, {row['quantity']}: {two_digits(row['median (%)'])} % apart in the"
            f" median of {_scenes(row['scenes'])}, {two_digits(row['largest (%)'])} % at most"
            f"{_beyond(row)}."
            for row in apart
            if "median (%)" in row and row["quantity"] == TAP_AND_STRESS[0].title
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
        left = ", ".join(list(columns)[MOST_MAPPED:])
        notes = (f"Only the first {MOST_MAPPED} variables are drawn, not {left}.",) * bool(left)
        maps = [folder / f"map-{number}.png" for number in range(len(found))]
        for path, output in zip(maps, found, strict=True):
            draw_map(path, columns, output)
            section(f"Map: {output.title}", "", (), *notes, figures=[path])
    if plan.points.kind == "file":
        note = "No indices: a file's variables need not be independent."
        section("Sobol indices", "sobol", [{"of": note}])
    elif columns:
        none = (
            f"None: they need {LEAST_POINTS} completed points a variable, and numbers that differ."
        )
        rows = list(sensitivities(columns, found)) or [{"of": none}]
        section("Sobol indices", "sobol", rows, SOBOL_NOTE)
    part = f"{_scenes(len(points))}, {', '.join(labels)}"
    path = folder / "index.html"
    heading = f"Sweep: {plan.name}"
    context = {"sections": sections, "part": part, "heading": heading, "lead": lead}
    page.write_page(path, "sections.html.j2", context)
    return path
