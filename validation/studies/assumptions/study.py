"""The study's dataset: scenes, and the reference's numbers on each with their stated errors.

A scene is solved to the first of `ACCURACIES`, the finest that a solid may be asked for, and to the
next if that did not complete: fine meshes of a large patch are crushed sooner. Edges grow more
slowly behind the patch than an accuracy prescribes, which changes a peak by 0.1 to 0.3 %. If a
number is then not known to `BARS`, the edges at the contact are refined; if it still is not, the
tap's end is held where it is, since another end is no error of its touches. The scenes are solved
in sweeps, so that a study that was stopped can be resumed.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import tomli_w
import xarray

from validation import DATA
from validation.errors import RunFailedError
from validation.harness.files import output_folder, write_text
from validation.harness.quantities import TAP_AND_STRESS
from validation.models.solid_mesh import sizing_of
from validation.models.variants import Variant, cumulative
from validation.studies.assumptions.points import DIAMETER, six, tables_of
from validation.studies.assumptions.waterfall_command import REFERENCE
from validation.sweep.command import solve_plan
from validation.sweep.plan import read_plan
from validation.sweep.points import points_of

FILE = "assumptions_study.csv"
ACCURACY = "solver.fem.accuracy"
ACCURACIES, GROWTH = (2e-3, 3e-3, 5e-3), 1.25
BARS = dict(zip((entry.key for entry in TAP_AND_STRESS), (0.01, 0.005, 0.02, 0.05), strict=True))
TIP, FINER = "solver.fem.tip_size", 0.7
HELD = "solver.fem.tap_until"  # s; 0: the tap ends by the reference's rule
# Accuracy of the reduced model, whose own settings leave 0.3 % of a peak and 1 % of a stress.
CONVERGED = 1e-4
LONGEST_S = 0.05  # limit of a tap: soft fingers stay for milliseconds
STATUS = "reference_status"
UNTIL = "solver.hcm.tap_until"
ELASTIC, OWN = "refined, elastic flight", "refined, its own tap"


def read_study() -> pd.DataFrame:
    """The stored study, one row per scene."""
    return pd.read_csv(DATA / FILE)


def known(table: pd.DataFrame) -> pd.Series:
    """Whether the reference completed each scene, with errors within `BARS`."""
    kept = table[STATUS] == "COMPLETED"
    for key, bar in BARS.items():
        kept &= table[f"{key}_error"] <= bar * table[key].abs()
    return kept


def by_reference(table: pd.DataFrame, name: str, workers: int | None, out: Path) -> pd.DataFrame:
    """Solve scenes with the reference, each to its own accuracy; returns them with its numbers."""
    found = _swept(table, name, [{"model": REFERENCE}], (ACCURACY,), workers, out).isel(model=0)
    table = table.assign(**{STATUS: found["status"].to_numpy()})
    for entry in TAP_AND_STRESS:
        for key in (entry.key, f"{entry.key}_error"):
            table[key] = found[key].to_numpy() if key in found else np.nan  # if none completed
    return table


def solved(points: Sequence[dict[str, Any]], workers: int | None, out: Path) -> pd.DataFrame:
    """Points with the reference's numbers, to the finest accuracy at which it completed."""
    table = pd.DataFrame(points).assign(**{ACCURACY: ACCURACIES[0]})
    table = by_reference(table, "reference-0", workers, out)
    for number, accuracy in enumerate(ACCURACIES[1:], 1):
        stopped = table[STATUS] != "COMPLETED"
        if stopped.any():
            coarser = table[stopped].assign(**{ACCURACY: accuracy})
            coarser = by_reference(coarser, f"reference-{number}", workers, out)
            table.loc[stopped, coarser.columns] = coarser
    table[TIP] = [_tip_size(row) for row in table.to_dict("records")]
    table[HELD] = 0.0
    for name, key in (("finer", TIP), ("held", HELD)):
        doubted = (table[STATUS] == "COMPLETED") & ~known(table)
        if doubted.any():
            to = {TIP: FINER * table[TIP], HELD: table["contact_duration_s"]}
            better = table[doubted].assign(**{key: to[key]})
            better = by_reference(better, f"reference-{name}", workers, out)
            better = better[better[STATUS] == "COMPLETED"]
            table.loc[better.index] = better
    return table


def _tip_size(row: dict[str, Any]) -> float:
    """Edges at the contact that a scene's accuracy asks for, m, to six digits."""
    sizing, _ = sizing_of(tables_of(row), 3)
    return six(sizing.tip_size)


def by_variants(
    table: pd.DataFrame, variants: Sequence[Variant], workers: int | None, out: Path
) -> xarray.Dataset:
    """Solve the study's scenes by the reduced model; returns a sweep's dataset (scene, model).

    Its flight is rigid, as the reference's is, and its tap includes the touches that begin within
    the reference's: where a tip leaves for a moment, or nearly does, two models may end a tap after
    different touches. The last two are the refined model again, with an elastic flight, which the
    reference leaves out, and with its own end of the tap.
    """
    refined = cumulative()[-1]
    models = [_model(v, v.name, "rigid") for v in variants]
    models.append(_model(refined, ELASTIC, "elastic"))
    same = table.assign(**{UNTIL: table["contact_duration_s"].fillna(0.0)})
    found = [
        _swept(same, "assumptions", models, (), workers, out),
        _swept(table, "own-tap", [_model(refined, OWN, "rigid")], (), workers, out),
    ]
    return xarray.concat(found, "model", data_vars="all")


def _model(variant: Variant, name: str, flight: str) -> dict[str, Any]:
    keys = dict(text.split("=") for text in variant.overrides)
    chosen: dict[str, Any] = {key: value == "true" for key, value in keys.items()}
    return {"model": "hcm", "variant": name, "set": {**chosen, "solver.hcm.flight": flight}}


def _swept(
    table: pd.DataFrame, name: str, models: list[dict[str, Any]], more: tuple[str, ...],
    workers: int | None, out: Path,
) -> xarray.Dataset:  # fmt: skip
    """Run a sweep over the table's scenes, whose plan and points are written beside it."""
    keys = [key for key in table.columns if "." in key and key != ACCURACY]
    folder = output_folder(out / "study")
    write_text(folder / f"{name}.csv", table[[*keys, *more]].to_csv(index=False))
    plan = {
        "scene": "soft",
        "models": models,
        "set": {
            "finger.diameter": DIAMETER,
            "solver.fem.max_contact_time": LONGEST_S,
            "solver.fem.growth": GROWTH,
            # as in the reduced model here
            "solver.fem.flight": "rigid",
            "solver.hcm.accuracy": CONVERGED,
            "solver.hcm.estimate": False,
        },
        "points": {"kind": "file", "file": f"{name}.csv"},
    }
    write_text(folder / f"{name}.toml", tomli_w.dumps(plan))
    chosen = read_plan(folder / f"{name}.toml")
    own = output_folder(folder / name)
    found, failures = solve_plan(chosen, points_of(chosen), own, (workers, None))
    if failures:
        raise RunFailedError(f"{len(failures)} runs failed, the first: {failures[0]}")
    return found
