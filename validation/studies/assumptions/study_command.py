"""``fingertap study``: the effect of each assumption of the reduced model over many fingers.

The reduced model's flight is rigid, as the reference's is, and its tap includes the touches that
begin within the reference's, so that both are compared over the same touches. The refined model is
also solved with an elastic flight, and with its own end of the tap.
"""

import math
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray

from hcm import simulate_within
from hcm.arrays import Floats
from validation.compare.figures import assumption_bars
from validation.errors import RunFailedError, UserError
from validation.harness.console import output
from validation.harness.figures import BLACK, GREY, ORANGE, panels
from validation.harness.files import exclusive_folder, write_json, write_text
from validation.harness.provenance import provenance
from validation.harness.quantities import OF_A_TAP, TAP_AND_STRESS, Quantity
from validation.harness.tables import write_table
from validation.harness.timing import shortest_in_turns
from validation.harness.uncertainty import two_digits
from validation.models.hcm import hcm_scene
from validation.models.variants import Variant, all_variants, cumulative, leave_one_out, short_name
from validation.scenes.load import load_scene
from validation.studies.assumptions.rule import rules
from validation.studies.assumptions.study import (
    ACCURACIES,
    BARS,
    ELASTIC,
    ERRORS,
    FILE,
    GROWTH,
    KEYS,
    OWN,
    STATUS,
    by_reference,
    by_variants,
    known,
    points,
    read_study,
    solved,
)

WANTED = {key: 5.0 if "stress" in key else 2.0 for key in KEYS}  # percent
OUTER = 5.0  # percent: the wider limit on all four numbers of a scene
SEEDS = 2**32 - 1  # the largest that pandas takes
APART = 1e-3  # of durations: beyond it the touches differ, as steps' errors are 1e-4
TIMED_AT, TIMING_S = 1e-3, 3.0  # accuracy of the timed taps, and s for those of a finger
DRAWN, EDGE = (0.1, 100.0), 8.0  # percent: what the waterfall shows, and the map


def study(
    *,
    again: int = 0,
    solve: int = 0,
    seed: int = 0,
    workers: int | None = None,
    out: Path = Path("out"),
) -> None:
    """Compare the reduced model's assumptions with the stored reference over the study's scenes.

    Parameters
    ----------
    again
        Number of stored scenes, drawn at random, to solve by the reference again and compare.
    solve
        Number of scenes, the first of a Sobol sequence, to solve by the reference: hours. The
        stored dataset was made in this way.
    seed
        Seed of the choice of scenes.
    workers
        Processes; by default one a core.
    out
        Folder for study/.
    """
    table = read_study()
    ended = (table[STATUS] == "COMPLETED").to_numpy()
    solid = table[ended]
    allowed = {
        "--again": (again, 0, len(solid)), "--solve": (solve, 0, math.inf),
        "--seed": (seed, 0, SEEDS), "--workers": (workers, 1, math.inf),
    }  # fmt: skip
    for option, (number, least, largest) in allowed.items():
        if number is not None and not least <= number <= largest:
            words = f"{least} to {largest}" if largest < math.inf else f"{least} or more"
            raise UserError(f"{option} {number}: must be {words}")
    if again and solve:
        raise UserError(f"--again {again}: --solve takes scenes of its own; leave one out")
    with exclusive_folder(out / "study") as folder:
        if solve:
            table = solved(points(solve, seed), workers, out)
            write_text(folder / FILE, table.to_csv(index=False))
            made = {"accuracies": ACCURACIES, "growth": GROWTH, "bars": BARS, "seed": seed}
            made["provenance"] = provenance({})
            write_json((folder / FILE).with_suffix(".json"), made)
            output(f"{known(table).sum()} of {len(table)} scenes keep the bars; {folder / FILE}")
        elif again:
            _repeat(solid.sample(again, random_state=seed), workers, out)
        else:
            _compare(table, ended, workers, out, folder)


def _compare(table: pd.DataFrame, ended: Any, workers: int | None, out: Path, folder: Path) -> None:
    """Solve the scenes by each variant; write tables and a figure, and print a summary."""
    solid = table[ended]
    variants = all_variants()
    runs = by_variants(table, variants, workers, out)
    numbers = numbers_of(runs)
    given = solid[KEYS].to_numpy()
    errors = 100.0 * (numbers[:, ended] / given - 1.0)
    bars = 100.0 * (solid[ERRORS].to_numpy() / given)
    names = [*(variant.name for variant in variants), ELASTIC, OWN]
    shares, chosen = shares_of(errors, names, bars), _rules(table, numbers[:-2])
    for name, found, title in (
        ("study", shares, f"The reduced model over {len(solid)} scenes, assumption by assumption"),
        ("rules", chosen, f"Which assumptions a scene can do without, by {len(table)} scenes"),
    ):
        write_table(folder, name, found, title)
        output(found.to_string(index=False, float_format=lambda x: f"{x:.1f}"))
    _draw(folder / "study.png", solid, errors[:-2], variants)
    output(
        f"of {len(table)} scenes {len(solid)} have a reference, {known(table).sum()} keep the"
        f" bars; files in {folder}"
    )
    output(_flight(numbers, table))
    lasts = numbers[..., KEYS.index("contact_duration_s")]
    apart = np.abs(lasts[-1] / lasts[len(cumulative()) - 1] - 1.0) > APART
    output(f"in {apart.sum()} scenes the refined model's own tap has other touches")


def _flight(numbers: Floats, table: pd.DataFrame) -> str:
    """A sentence on the effect of a rigid flight, which the reference's own errors leave out."""
    moved = 100.0 * np.abs(numbers[-2] / numbers[len(cumulative()) - 1] - 1.0)
    parts = [
        f"{entry.title} {two_digits(np.nanmedian(one))} % ({two_digits(np.nanpercentile(one, 90))},"
        f" {two_digits(np.nanmax(one))})"
        for entry, one in zip(TAP_AND_STRESS, moved.T, strict=True)
    ]
    bars = 100.0 * np.array(list(BARS.values()))
    both = known(table).to_numpy() & (moved <= bars).all(axis=1)
    return (
        "an elastic flight changes, in the median (90th percentile, most): "
        f"{', '.join(parts)}; by less than the bars in {both.sum()} of those that keep them"
    )


def _repeat(stored: pd.DataFrame, workers: int | None, out: Path) -> None:
    """Solve scenes again; raises RunFailedError where a number is beyond its stored error, or where
    errors within `BARS` no longer are.
    """
    found = by_reference(stored, "again", workers, out)
    own = stored[ERRORS].to_numpy()
    apart = ((found[KEYS] - stored[KEYS]).abs() / own).max(axis=1, skipna=False)
    states = (found[ERRORS] / own).max(axis=1, skipna=False)
    for scene in stored.index:
        output(
            f"scene {scene}: {found.loc[scene, STATUS].lower()}, differs by {apart[scene]:.1e} of"
            f" the stored errors, its errors are up to {states[scene]:.2g} times the stored ones"
        )
    limits = ", ".join(f"{100 * bar:g}" for bar in BARS.values())
    faults = {
        "numbers moved by more than the stored errors": ~(apart <= 1.0),
        f"stated errors are no longer within {limits} %": known(stored) & ~known(found),
    }
    said = [
        f"scenes {', '.join(map(str, stored.index[at]))}: {what}"
        for what, at in faults.items()
        if at.any()
    ]
    if said:
        raise RunFailedError("; ".join(said))


def numbers_of(runs: xarray.Dataset) -> Floats:
    """`TAP_AND_STRESS` of (variant, scene, quantity); nan where a run did not complete.

    A finger that is too flexible for a rigid flight is so for the reference's as well, and counts.
    """
    ended = np.isin(runs["status"].to_numpy().T, ("COMPLETED", "TOO_FLEXIBLE"))
    found = np.stack([runs[key].to_numpy().T for key in KEYS], axis=-1)
    return np.where(ended[..., None], found, np.nan)


def _rules(table: pd.DataFrame, numbers: Floats) -> pd.DataFrame:
    """Rules for what the refined model, the last of the cumulative variants, can do without."""
    first = len(cumulative())
    taps = numbers[..., : len(OF_A_TAP)]
    moved = 100.0 * np.abs(taps[first:] / taps[first - 1] - 1.0).max(axis=-1)
    names = [variant.name.removeprefix("without ") for variant in leave_one_out()]
    return rules(table, moved, names, {finger: _cost(finger) for finger in ("soft", "hard")})


def _cost(finger: str) -> Floats:
    """Times without each of `leave_one_out` over the refined model's, (assumption,).

    The sweep's own times are of other minutes, and another load, for each assumption.
    """
    scenes = [load_scene(finger, of.overrides) for of in (cumulative()[-1], *leave_one_out())]
    given = [hcm_scene(scene, estimate=True) for scene in scenes]
    runs = [partial(simulate_within, TIMED_AT, scene) for scene in given]
    times = np.array([one.wall_time_s for one in shortest_in_turns(runs, TIMING_S)])
    return np.asarray(times[1:] / times[0])


def shares_of(errors: Floats, names: Sequence[str], bars: Floats) -> pd.DataFrame:
    """Shares of scenes inside `WANTED` and `OUTER`, and medians; a missing number is outside.

    errors : (variant, scene, quantity), %. bars : (scene, quantity), the reference's own errors, %.
    """
    limits = np.array(list(WANTED.values()))
    size = np.where(np.isnan(errors), np.inf, np.abs(errors))
    rows = []
    for name, one in zip(names, size, strict=True):
        row: dict[str, Any] = {"assumptions": name}
        for n, entry in enumerate(TAP_AND_STRESS):
            row[f"{entry.title} (%)"] = float(np.median(one[:, n]))
            row[f"{entry.title} in {limits[n]:g} %"] = 100.0 * (one[:, n] <= limits[n]).mean()
        row["all four"] = 100.0 * (one <= limits).all(axis=1).mean()
        row["within these and the bars"] = 100.0 * (one <= limits + bars).all(axis=1).mean()
        row[f"all within {OUTER:g} %"] = 100.0 * (one <= OUTER).all(axis=1).mean()
        rows.append(row)
    return pd.DataFrame(rows)


def _draw(path: Path, table: pd.DataFrame, errors: Floats, variants: tuple[Variant, ...]) -> None:
    """Draw the waterfall of medians and 90th percentiles, and the refined model's errors below."""
    size, steps = np.abs(errors), len(cumulative())
    names = [short_name(variant.name) for variant in variants]
    titles = [entry.title for entry in TAP_AND_STRESS]
    with panels(path, len(titles), 2, width=3.2, height=3.9) as axes:
        places = assumption_bars(axes[0], titles, names, np.nanmedian(size, axis=1), steps)
        for n, entry in enumerate(TAP_AND_STRESS):
            axis = axes[0][n]
            axis.plot(np.nanpercentile(size[:, :, n], 90, axis=1), places, "|", color=ORANGE)
            axis.axvline(WANTED[entry.key], color=BLACK, linewidth=0.6)
            axis.set_xscale("log")
            axis.set_xlim(*DRAWN)
            axis.set_xlabel("error (%)\n| 90th percentile")
            _map(axes[1][n], table, errors[steps - 1, :, n], entry)
        axes[1][0].set_ylabel("refined model's error (%)")
        drawn = axes[1][-1].collections[-1]
        axes[1][-1].figure.colorbar(drawn, ax=axes[1][-1], label="friction")


def _map(axis: Any, table: pd.DataFrame, errors: Floats, of: Quantity) -> None:
    """Plot errors over the predicted patch, with the reference's; those beyond `EDGE` lie on it."""
    patch = table["patch_over_radius"]
    bars = 100.0 * table[f"{of.key}_error"] / table[of.key].abs()
    shown = np.clip(errors, -EDGE, EDGE)
    axis.errorbar(patch, shown, bars, fmt="none", ecolor=GREY, elinewidth=0.5)
    for side in (-WANTED[of.key], 0.0, WANTED[of.key]):
        axis.axhline(side, color=BLACK, linewidth=0.6)
    axis.scatter(patch, shown, 9, table["surface.friction"], zorder=3, clip_on=False)
    axis.set_ylim(-EDGE, EDGE)
    beyond = int((np.abs(errors) > EDGE).sum())
    axis.set_xlabel("predicted a/R" + f"\n({beyond} beyond the edge)" * (beyond > 0))
