"""The study's dataset: scenes, and the reference's numbers on each with their stated errors.

The scenes are fingers that fall from rest, horizontal, and touch with the tip: scrambled Sobol
points over the phalanges' number, L/d, E, rho, nu, mu and the last phalanx's angle theta at the
touch (angles are uniform, since other parts would touch first at most of uniform heights). Rods of
the true body's masses (`hcm.flight.rigid_chain`) fall to theta; the surface is at the lowest point
of the sphere about the end's centre, H = sum L sin theta_i + R (1 - sin theta_P).

A scene is solved to the first of `ACCURACIES`, the finest that a solid may be asked for, and to the
next if that did not complete: fine meshes of a large patch are crushed sooner. Edges grow more
slowly behind the patch than an accuracy prescribes, which changes a peak by 0.1 to 0.3 %. If a
number is then not known to `BARS`, the edges at the contact are refined; if it still is not, the
tap's end is held where it is, since another end is no error of its touches. The scenes are solved
in sweeps, so that a study that was stopped can be resumed.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import tomli_w
import xarray

import hcm
from hcm.arrays import Floats
from hcm.flight.rigid_chain import build_rods, rates
from validation import DATA
from validation.errors import RunFailedError
from validation.harness.files import output_folder, write_text
from validation.harness.quantities import TAP_AND_STRESS
from validation.models import solid_mesh
from validation.models.variants import Variant, cumulative
from validation.scenes.load import load_scene
from validation.scenes.scene import Scene
from validation.studies.assumptions.waterfall_command import REFERENCE
from validation.sweep.axis import Axis
from validation.sweep.command import solve_plan
from validation.sweep.plan import Points, assignment, read_plan
from validation.sweep.points import points_of, unit_points, values_of

DIAMETER = 0.015  # m: another size amounts to another density, as only gravity has a length
LONGEST_FALL_S = 1.0
# keys of a scene, or the angle in degrees
RANGES = {
    "finger.phalanges": Axis(low=1.0, high=5.0),
    "finger.length": Axis(low=2 * DIAMETER, high=10 * DIAMETER),
    "material.youngs_modulus": Axis(low=1e7, high=1e11, log=True),
    "material.density": Axis(low=800.0, high=8000.0, log=True),
    "material.poisson_ratio": Axis(low=0.3, high=0.49),
    "surface.friction": Axis(low=0.0, high=1.2),
    "angle_deg": Axis(low=15.0, high=62.0),
}
FILE = "assumptions_study.csv"
ACCURACY = "solver.fem.accuracy"
ACCURACIES, GROWTH = (2e-3, 3e-3, 5e-3), 1.25
KEYS = [entry.key for entry in TAP_AND_STRESS]
ERRORS = [f"{key}_error" for key in KEYS]
BARS = dict(zip(KEYS, (0.01, 0.005, 0.02, 0.05), strict=True))
TIP, FINER = "solver.fem.tip_size", 0.7
HELD = "solver.fem.tap_until"  # s; 0: the tap ends by the reference's rule
# Accuracy of the reduced model, whose own settings leave 0.3 % of a peak and 1 % of a stress.
CONVERGED = 1e-4
LONGEST_S = 0.05  # limit of a tap: soft fingers stay for milliseconds
STATUS = "reference_status"
UNTIL = "solver.hcm.tap_until"
ELASTIC, OWN = "refined, elastic flight", "refined, its own tap"


def points(number: int, seed: int = 0) -> list[dict[str, Any]]:
    """The first `number` points, each a dictionary by column, with numbers to six digits."""
    cube = unit_points(Points(kind="sobol", number=number, seed=seed), len(RANGES))
    columns = [values_of(*pair) for pair in zip(RANGES.values(), cube.T, strict=True)]
    rows = zip(*columns, strict=True)
    return [_point(dict(zip(RANGES, map(six, row), strict=True))) for row in rows]


def _point(found: dict[str, Any]) -> dict[str, Any]:
    """A point with what follows from its values in the ranges."""
    found["finger.phalanges"] = int(found["finger.phalanges"])
    found["surface.height"] = six(_height(found))
    tables = tables_of(found)
    touch = solid_mesh.predicted_touch(tables, 3)
    radius, nu = 0.5 * DIAMETER, found["material.poisson_ratio"]
    found["tip.normal_stiffness"] = six(solid_mesh.touching_spring(tables, touch))
    found["tip.tangential_ratio"] = six(2.0 * (1.0 - nu) / (2.0 - nu))
    found["patch_over_radius"] = six(touch.patch_radius / radius)
    return found


def tables_of(point: dict[str, Any]) -> Scene:
    """The tables of a point's scene; columns without a dot are not keys of a scene."""
    keys = {"finger.diameter": DIAMETER} | {key: v for key, v in point.items() if "." in key}
    return load_scene("soft", [assignment(key, value) for key, value in keys.items()]).tables


def _height(found: dict[str, Any]) -> float:
    """H at which the last phalanx has the wanted angle, m."""
    from scipy.integrate import solve_ivp

    count, length, modulus, density, ratio, _, angle = (found[key] for key in RANGES)
    phalanx = hcm.Phalanx(length, DIAMETER, modulus, density, poisson_ratio=ratio)
    anywhere, refined = hcm.Surface(1.0, 0.0), hcm.Assumptions("refined")
    rods, _ = build_rods(hcm.Finger((phalanx,) * count), anywhere, hcm.Drive(), refined)

    def motion(time: float, state: Floats) -> Floats:
        out = np.empty(2 * count)
        rates(time, state, rods, out)
        return out

    def beyond(time: float, state: Floats) -> float:
        del time
        return float(state[count - 1]) - math.radians(angle)

    beyond.terminal = True  # type: ignore[attr-defined]
    flight = solve_ivp(
        motion, (0.0, LONGEST_FALL_S), np.zeros(2 * count), events=beyond, rtol=1e-10, atol=1e-10
    )
    sines = np.sin(flight.y[:count, -1])
    return float(length * sines.sum() + 0.5 * DIAMETER * (1.0 - sines[-1]))


def six(value: float) -> float:
    """A number rounded to six digits."""
    return float(f"{value:.6g}")


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
    for pair in zip(KEYS, ERRORS, strict=True):
        for key in pair:
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
    sizing, _ = solid_mesh.sizing_of(tables_of(row), 3)
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
            # as in the reduced model here, so that what it leaves out is no error of theirs
            "solver.fem.flight": "rigid",
            "solver.fem.flight_error": False,
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
