"""``fingertap converge``: mesh, penalty and step, each refined alone, from one impact state.

At the end the preset `converged` is compared with the limit of the tip's refinement.
"""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Literal

from validation.converge import verdicts
from validation.converge.refinement_runs import OF_MESH, LevelRuns, Values
from validation.converge.refinements import (
    NO_ACCURACY,
    PRESET_KEY,
    Refinement,
    check_given,
    refinements,
)
from validation.converge.verdicts import RefinedRuns
from validation.errors import RunFailedError
from validation.harness.command_line import AsJson, Flag, Overrides, Source
from validation.harness.console import output, progress_bar, say
from validation.harness.figures import BLUE, GREEN, ORANGE, legend, panels
from validation.harness.files import exclusive_folder, json_text, output_folder, write_json
from validation.harness.quantities import OF_A_TAP, Quantity, quantity
from validation.harness.store import Store
from validation.harness.tables import table_of, write_table
from validation.harness.uncertainty import with_error
from validation.models.adapter import Progress
from validation.models.solid_mesh import size_scale
from validation.runs.execute import warm_up
from validation.scenes.solver_tables import SIZES


def run_levels(
    runs: LevelRuns, wanted: Sequence[Refinement], progress: Progress
) -> tuple[list[RefinedRuns], list[str]]:
    """Run every level; returns their values, and the names and errors of levels that failed.

    One whose mesh is that of the level before fails, too: it would say that both are converged.
    """
    results, failures = [], []
    done, total = itertools.count(), sum(len(refinement.levels) for refinement in wanted)
    for refinement in wanted:
        found: dict[float, Values] = {}
        for size, overrides in refinement.levels.items():
            text = f"{refinement.name}: {refinement.size_name} {size:.3g}"
            number = next(done)
            progress(number / total, text)
            try:
                values = runs.run(overrides)
            except KeyboardInterrupt:
                say(f"stopped at level {number + 1} of {total}: the same command goes on there")
                raise
            except RunFailedError as error:
                failures.append(f"{text}: {error}")
                continue
            last = next(reversed(found.values()), {})
            if refinement.of_mesh and all(values[key] == last.get(key) for key in OF_MESH):
                failures.append(f"{text}: its mesh is that of the level before")
                continue
            found[size] = values
        results.append(RefinedRuns(refinement, found))
    return results, failures


def draw(path: Path, results: Sequence[RefinedRuns], title: str) -> None:
    """Draw the deviation from the finest level, one panel per refinement."""
    with panels(path, len(results), width=2.9, height=3.1) as axes:
        for axis, found in zip(axes[0], results, strict=True):
            for entry, color, mark in zip(OF_A_TAP, (ORANGE, BLUE, GREEN), "os^", strict=True):
                if numbers := found.numbers(entry):
                    change = [100 * (value / numbers[-1] - 1) for value in numbers]
                    axis.plot(found.sizes, change, mark + "-", color=color, label=entry.title)
            axis.axhspan(-1, 1, color="#dddddd", alpha=0.5, linewidth=0)
            axis.set_xscale("log")
            axis.minorticks_off()
            axis.set_xticks(found.sizes, [f"{size:.2g}" for size in found.sizes])
            axis.set_title(found.refinement.name)
            axis.set_xlabel(found.refinement.size_name)
        axes[0][0].set_ylabel("change from the finest level (%)")
        legend(axes[0], 3)
        axes[0][0].figure.suptitle(title, fontsize=10, x=0.01, ha="left")


def run_converge(
    scene: Source,
    /,
    *,
    model: Literal["fem3d", "fem2d"] = "fem3d",
    overrides: Overrides = (),
    quick: Flag = False,
    out: Path = Path("out"),
    as_json: AsJson = False,
) -> None:
    """Refine, tabulate, draw, and say how sure the finest values are.

    Parameters
    ----------
    model
        fem3d or fem2d.
    quick
        Coarser levels: a minute instead of five for soft, and a wider error bar.
    out
        Folder for converge/SCENE-MODEL/: levels.csv, convergence.csv, convergence.png,
        scene.json.
    """
    output_folder(out / "converge")
    with ExitStack() as alone:
        with progress_bar("converge") as progress:
            progress(0.0, "impact state")
            runs = LevelRuns(scene, overrides, model, Store(out / "store"))
            wanted = refinements(size_scale(runs.scene.tables), runs.patch, quick)
            check_given(overrides, wanted)
            name = verdicts.study_name(runs.scene.name, model, quick)
            folder = alone.enter_context(exclusive_folder(out / "converge" / name))
            progress(0.0, "compiling")
            warm_up(model)  # the default element: else it is in the first level's time
            results, failures = run_levels(runs, wanted, progress)
            progress(0.98, "preset converged")
            preset = None
            stated = runs.scene.tables.solver.fem.model_fields_set.intersection(SIZES)
            number = sum(len(refinement.levels) for refinement in wanted)
            if not quick and not stated:
                number += 1
                try:
                    preset = runs.run({PRESET_KEY: "converged", **NO_ACCURACY})
                except RunFailedError as error:
                    failures.append(f"preset converged: {error}")
        (folder / verdicts.STUDIED).unlink(missing_ok=True)  # belongs to earlier tables
        failed = f"{len(failures)} of {number} levels failed; the first: {' '.join(failures[:1])}"
        if not any(found.values for found in results):
            raise RunFailedError(failed)
        title = f"{runs.scene.name} finger, {model}"
        convergences = verdicts.judged(results)
        levels = verdicts.level_rows(results)
        write_table(folder, "levels", table_of(levels), f"Runs of {title}")
        names = [refinement.name for refinement in wanted]
        of_preset = [] if preset is None else verdicts.preset_rows(preset, convergences, names)
        rows = [*verdicts.verdict_rows(convergences), *of_preset]
        write_table(folder, "convergence", table_of(rows), f"Convergence of {title}")
        made_from = verdicts.study_of(runs.scene.tables, model, folder / "convergence.csv")
        write_json(folder / verdicts.STUDIED, made_from)
        draw(folder / "convergence.png", results, title)
    if as_json:
        given = {"scene": runs.scene.name, "model": model, "changes": list(overrides)}
        found = {"levels": levels, "convergence": rows, "failures": failures}
        output(json_text(given | found | {"folder": str(folder)}))
    else:
        output("\n".join((*_lines(title, convergences, of_preset), f"  files in {folder}")))
    for caution in verdicts.cautions(results, preset):
        say(f"caution: {title}, {caution}")
    if stated and not quick:
        say(
            f"caution: {title}, the preset converged is left out: the scene states"
            f" solver.fem.{min(stated)}, which takes precedence"
        )
    if failures:
        raise RunFailedError(failed)


def _lines(
    title: str, convergences: verdicts.Convergences, of_preset: Sequence[Mapping[str, Any]]
) -> Iterator[str]:
    """The verdicts as text."""
    yield f"{title}: from one impact state, each refined alone"
    wide = max((len(name) for name, _ in convergences), default=0)
    for (refined, entry), found in convergences.items():
        finest, limit = (_with_error(entry, v, found.error) for v in (found.finest, found.limit))
        yield (
            f"  {refined:<{wide}}  {entry.title:<16}  finest {finest:<24}"
            f"  limit {limit.partition(' ')[0]:<8}  {found.verdict}"
        )
    for row in of_preset:
        entry, percent = quantity(row["quantity"]), row["uncertainty_percent"]
        finest = _with_error(entry, row["finest"], abs(row["finest"]) * percent / 100)
        yield (
            f"  {row['refinement']:<{wide}}  {entry.title:<16}  {finest:<24}"
            f"  {row['from_limit_percent']:+.2f} % from the tip's limit,"
            f" known to {percent:.1f} % in all"
        )


def _with_error(entry: Quantity, value: float, error: float) -> str:
    """A value in its shown unit, with the digits that its error justifies."""
    return f"{with_error(entry.factor * value, entry.factor * error)} {entry.unit}"
