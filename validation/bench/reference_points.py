"""The reference's presets: what each costs, and how far it is from the finest one run beside it."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from validation.bench.measured import Point, Quantities, errors
from validation.execute import Job, in_fresh_process
from validation.models import ModelName
from validation.record import RunRecord

Case = tuple[ModelName, str]
QUICK: tuple[Case, ...] = (("fem2d", "ls-dyna-like"), ("fem2d", "fast"), ("fem3d", "fast"))
FULL: tuple[Case, ...] = (
    ("fem2d", "converged"),
    ("fem2d", "ls-dyna-like"),
    ("fem2d", "fast"),
    ("fem3d", "ls-dyna-like"),
    ("fem3d", "fast"),
)


def quantities(record: RunRecord) -> Quantities | None:
    """What a run found; None if it has no complete contact. The turn is where F_n is largest."""
    names = ("contact_time_s", "peak_normal_force_time_s", "contact_duration_s",
             "peak_normal_force_N", "normal_impulse_N_s")  # fmt: skip
    values = [record.value(name) for name in names]
    if not record.ok or None in values:
        return None
    return Quantities(*(float(value) for value in values if value is not None))


def _point(record: RunRecord, case: Case, found: Quantities | None, finest: Quantities) -> Point:
    model, preset = case
    return Point(
        "reference",
        model,
        "presets",
        preset,
        record.status,
        record.value("wall_time_s") or float("nan"),
        1,
        int(record.value("steps") or 0),
        None if found is None else errors(found, finest),
    )


def measure_all(
    cases: tuple[Case, ...], folder: Path, progress: Callable[[float, str], None]
) -> list[Point]:
    """Run each preset alone in a fresh process; the first of each model is what errors are from.

    The finest itself is a point without errors, with the status ``FINEST``.
    """
    finest: dict[str, Quantities] = {}
    points = []
    for number, case in enumerate(cases):
        model, preset = case
        progress(number / len(cases), f"{model}, {preset}")
        overrides = (f"solver.fem.preset={preset}",)
        (record,) = in_fresh_process([Job("soft", model, overrides, preset)], folder)
        found = quantities(record)
        if found is not None and model not in finest:
            finest[model] = found
            point = _point(record, case, None, found)
            points.append(replace(point, status="FINEST"))
        elif model in finest:
            points.append(_point(record, case, found, finest[model]))
        else:  # nothing to compare with: a time alone
            wall_time = record.value("wall_time_s") or float("nan")
            points.append(Point("reference", model, "presets", preset, record.status, wall_time, 1))
    return points
