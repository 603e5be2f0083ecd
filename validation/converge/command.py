"""``fingertap converge``: mesh, penalty and step, each refined alone, from one impact state.

At the end the preset `converged` is set against the limit that its mesh goes to.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from validation.compare.grid_convergence import Convergence, convergence
from validation.converge.refinement_runs import DIMENSIONS, LevelRuns, Values
from validation.converge.refinements import QUANTITIES, TIP_MESH, Ladder, ladders
from validation.errors import RunFailedError, UserError
from validation.harness.command_line import Flag, Overrides
from validation.harness.console import progress_bar
from validation.harness.figures import BLUE, GREEN, ORANGE, STYLE
from validation.harness.files import atomic, output_folder, safe_name
from validation.harness.store import Store
from validation.harness.tables import write_table
from validation.models.solid import size_scale

TITLES = {
    "peak_normal_force_N": "peak Fn",
    "normal_impulse_N_s": "impulse",
    "contact_duration_s": "duration",
}
PRESET = "preset"
Result = tuple[Ladder, list[Values]]


def run_ladders(
    runs: LevelRuns, wanted: Sequence[Ladder], progress: Any
) -> tuple[list[Result], list[str]]:
    """Values of every level; a level that fails is left out and named."""
    results: list[Result] = []
    failures = []
    total = sum(len(ladder.levels) for ladder in wanted)
    done = 0
    for ladder in wanted:
        levels, values = [], []
        for level in ladder.levels:
            text = f"{ladder.name}: {ladder.size_name} {level.size:.3g}"
            progress(done / total, text)
            try:
                values.append(runs.run(level.overrides))
                levels.append(level)
            except RunFailedError as error:
                failures.append(f"{text}: {error}")
            done += 1
        results.append((Ladder(ladder.name, ladder.size_name, ladder.order, tuple(levels)), values))
    return results, failures


def level_rows(results: Sequence[Result]) -> list[dict[str, Any]]:
    """One row per run."""
    return [
        {"ladder": ladder.name, "refined": ladder.size_name, "size": level.size, **values}
        for ladder, several in results
        for level, values in zip(ladder.levels, several, strict=True)
    ]


def judged(results: Sequence[Result]) -> dict[tuple[str, str], Convergence]:
    """By ladder and quantity, where there are three levels."""
    verdicts = {}
    for ladder, several in results:
        sizes = [level.size for level in ladder.levels]
        for quantity in QUANTITIES:
            values = [v[quantity] for v in several]
            numbers = [float(v) for v in values if v is not None]
            if len(numbers) == len(sizes) >= 3:
                verdicts[ladder.name, quantity] = convergence(sizes, numbers, ladder.order)
    return verdicts


def verdict_rows(verdicts: dict[tuple[str, str], Convergence]) -> list[dict[str, Any]]:
    """One row per ladder and quantity."""
    return [
        {
            "ladder": name,
            "quantity": quantity,
            "finest": found.finest,
            "limit": found.limit,
            "order": found.order,
            "asymptotic": "yes" if found.asymptotic else "not asymptotic",
            "uncertainty_percent": 100 * found.uncertainty,
            "spread_percent": 100 * found.spread,
            "from_limit_percent": 100 * (found.finest / found.limit - 1),
        }
        for (name, quantity), found in verdicts.items()
    ]


def preset_rows(
    preset: Values, verdicts: dict[tuple[str, str], Convergence]
) -> list[dict[str, Any]]:
    """The preset `converged` against the tip ladder's limit.

    Its uncertainty is what it is off by, and the uncertainties of all meshes and of the step: a
    sum, not its root, for they need not be independent. The penalty is no part of the preset.
    """
    rows = []
    for quantity in QUANTITIES:
        value, tip = preset[quantity], verdicts.get((TIP_MESH, quantity))
        if value is None or tip is None:
            continue
        off = value / tip.limit - 1
        others = sum(
            found.uncertainty
            for (name, key), found in verdicts.items()
            if key == quantity and name != "penalty"
        )
        rows.append(
            {
                "ladder": PRESET,
                "quantity": quantity,
                "finest": value,
                "limit": tip.limit,
                "uncertainty_percent": 100 * (abs(off) + others),
                "from_limit_percent": 100 * off,
            }
        )
    return rows


def draw(path: Path, results: Sequence[Result], title: str) -> None:
    """Deviation from each ladder's finest level, one panel per ladder."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(
            1, len(results), figsize=(2.9 * len(results), 3.1), layout="constrained", squeeze=False
        )
        for axis, (ladder, several) in zip(axes[0], results, strict=True):
            sizes = [level.size for level in ladder.levels]
            for quantity, color, mark in zip(QUANTITIES, (ORANGE, BLUE, GREEN), "os^", strict=True):
                values = [v[quantity] for v in several]
                if not values or None in values:
                    continue
                numbers = [float(v) for v in values if v is not None]
                change = [100 * (v / numbers[-1] - 1) for v in numbers]
                axis.plot(sizes, change, mark + "-", color=color, label=TITLES[quantity])
            axis.axhspan(-1, 1, color="#dddddd", alpha=0.5, linewidth=0)
            axis.set_xscale("log")
            axis.minorticks_off()
            axis.set_xticks(sizes, [f"{size:.2g}" for size in sizes])
            axis.set_title(ladder.name, fontsize=10, loc="left")
            axis.set_xlabel(ladder.size_name)
        axes[0][0].set_ylabel("change from the finest level (%)")
        handles, labels = axes[0][0].get_legend_handles_labels()
        if handles:
            figure.legend(handles, labels, loc="outside lower center", ncols=3)
        figure.suptitle(title, fontsize=10, x=0.01, ha="left")
        with atomic(path) as temporary:
            figure.savefig(temporary, format="png")
        plt.close(figure)


def run_converge(
    scene: str,
    /,
    *,
    model: Literal["fem3d", "fem2d"] = "fem3d",
    overrides: Overrides = (),
    quick: Flag = False,
    out: Path = Path("out"),
) -> None:
    """Run all ladders, tabulate, draw, and say what they say.

    Parameters
    ----------
    scene
        A built-in scene (hard, soft, driven-1, driven-2, driven-3) or the path of a TOML file.
    model
        fem3d or fem2d.
    overrides
        KEY=VALUE with a dotted key, as often as needed: --set surface.friction=0.7
    quick
        Coarser levels: two minutes instead of a half hour, and a wider error bar.
    out
        Folder for converge/SCENE-MODEL/: levels.csv, convergence.csv, convergence.png.

    Raises
    ------
    UserError
        Bad scene, model or output folder: nothing was run.
    RunFailedError
        A level did not complete; the tables hold the others.
    """
    import pandas as pd

    if model not in DIMENSIONS:
        raise UserError(f"--model {model}: must be one of {', '.join(DIMENSIONS)}")
    output_folder(out / "converge")
    with progress_bar("converge") as progress:
        progress(0.0, "impact state")
        runs = LevelRuns(scene, overrides, model, Store(out / "store"))
        name = safe_name(f"{runs.scene.name}-{model}" + ("-quick" if quick else ""))
        folder = output_folder(out / "converge" / name)
        wanted = ladders(size_scale(runs.scene.tables), quick)
        results, failures = run_ladders(runs, wanted, progress)
        progress(0.98, "preset converged")
        preset = None
        if not quick:
            try:
                preset = runs.run({"solver.fem.preset": "converged"})
            except RunFailedError as error:
                failures.append(f"preset converged: {error}")
    title = f"{runs.scene.name} finger, {model}"
    verdicts = judged(results)
    write_table(folder, "levels", pd.DataFrame(level_rows(results)), f"Runs of {title}")
    rows = verdict_rows(verdicts)
    beside = [] if preset is None else preset_rows(preset, verdicts)
    rows += beside
    write_table(folder, "convergence", pd.DataFrame(rows), f"Convergence of {title}")
    draw(folder / "convergence.png", results, title)
    print(f"{title}: from one impact state, each refined alone")
    for (ladder, quantity), found in verdicts.items():
        print(
            f"  {ladder:<11} {TITLES[quantity]:<9} finest {found.finest:<10.5g} "
            f"limit {found.limit:<10.5g} {found.verdict}"
        )
    for row in beside:
        print(
            f"  {'preset':<11} {TITLES[row['quantity']]:<9} {row['finest']:<10.5g} "
            f"{row['from_limit_percent']:+.2f} % from the tip's limit, "
            f"known to {row['uncertainty_percent']:.1f} % in all"
        )
    print(f"  files in {folder}")
    if failures:
        raise RunFailedError(f"{len(failures)} levels failed: {'; '.join(failures)}")
