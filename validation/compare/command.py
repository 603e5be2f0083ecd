"""``fingertap compare``: the effect of changed settings on one scene, computed by one model."""

import math
from collections.abc import Iterator
from pathlib import Path

import pandas

from validation.compare.differences import error_percent
from validation.errors import RunFailedError, UserError
from validation.harness.command_line import AsJson, Fresh, NoEstimate, Overrides, Source
from validation.harness.console import WIDTH, output, output_kept, say, shown
from validation.harness.files import exclusive_folder, json_text, safe_name, write_text
from validation.harness.interrupts import unless_interrupted
from validation.harness.quantities import COMPARED, quantities, quantity
from validation.harness.record import RunRecord
from validation.harness.store import Store
from validation.harness.uncertainty import with_error
from validation.models import adapter, estimate_override
from validation.runs.command import Kept, accuracy_override, failure_of, stored_or_solved
from validation.scenes.load import load_scene

WALL_TIME = "wall_time_s"
SHOWN = (*COMPARED, *quantities("energy_residual", "elements", "steps", WALL_TIME))


def difference_table(scene: RunRecord, changed: RunRecord) -> pandas.DataFrame:
    """Both runs' scalars, and the change in percent of the unchanged scene's value.

    Columns: quantity, scene, changed, difference_percent (empty where it has no meaning), and
    error_percent: 100 (e_a + e_b |a/b|)/|b| of a after and b before, by their stated errors (no
    column where none are stated).
    """
    rows = []
    for entry in SHOWN:
        before, after = entry.value(scene), entry.value(changed)
        percent, error = error_percent(after, before), None
        if before and after is not None and percent is not None:
            known, found = entry.error(scene), entry.error(changed)
            if known is not None and found is not None:
                error = 100.0 * (found + known * abs(after / before)) / abs(entry.factor * before)
        rows.append((entry.key, before, after, percent, error))
    columns = ["quantity", "scene", "changed", "difference_percent", "error_percent"]
    table = pandas.DataFrame(rows, columns=columns)
    table = table.dropna(subset=["scene", "changed"], how="all")
    return table if table.error_percent.notna().any() else table.drop(columns="error_percent")


def difference_lines(
    scene: RunRecord, changed: RunRecord, table: pandas.DataFrame
) -> Iterator[str]:
    """The table's rows as text, with as many digits as the errors justify."""
    yield f"  {'':<{WIDTH}}{'as it is':<26}{'changed':<26}change"
    if not (scene.ok and changed.ok):
        yield f"  {'no results of':<{WIDTH}}{_unless_ok(scene):<25} {_unless_ok(changed)}".rstrip()
    for row in table.to_dict("records"):
        entry, percent = quantity(row["quantity"]), row["difference_percent"]
        both = [shown(entry, record) for record in (scene, changed)]
        texts = ["-" if text is None else f"{text} {entry.unit}" for text in both]
        error = row.get("error_percent", math.nan)
        known = None if math.isnan(error) else error
        change = "" if math.isnan(percent) else f"{with_error(percent, known, 2)} %"
        yield f"  {entry.title:<{WIDTH}}{texts[0]:<25} {texts[1]:<25} {change}".rstrip()
    numbers = table[table.quantity != WALL_TIME]
    touched = scene.summary.get("contact_time_s") is not None
    if touched and numbers.scene.equals(numbers.changed):
        yield f"  no number differs: {scene.label} may not use what was changed"


def _unless_ok(record: RunRecord) -> str:
    return "" if record.ok else f"a run that is {record.status}"


def compare(
    scene: Source,
    /,
    *,
    model: str,
    overrides: Overrides = (),
    accuracy: str | None = None,
    out: Path = Path("out"),
    fresh: Fresh = False,
    no_estimate: NoEstimate = False,
    as_json: AsJson = False,
) -> None:
    """Run a scene as it is and with overrides; print and keep the differences.

    Parameters
    ----------
    model
        hcm, hcm-refined, fem3d, fem2d, or an installed plug-in.
    accuracy
        Largest relative error wanted of both runs, as in run; by default the scene's, or fixed
        settings.
    out
        Folder for compare/SCENE-MODEL-CHANGE/ with differences.csv and both runs.
    """
    if not overrides:
        raise UserError("compare: nothing to change; give --set KEY=VALUE")
    with output_kept():
        wanted = accuracy_override(adapter(model), accuracy, overrides)
    both = (*wanted, *estimate_override(model, not no_estimate))
    scenes = {
        "scene": load_scene(scene, both),
        "changed": load_scene(scene, (*overrides, *both)),
    }
    if scenes["scene"].tables == scenes["changed"].tables:
        raise UserError(
            f"--set {' '.join(overrides)}: the scene has that already; give another value"
        )
    name = safe_name("-".join((scenes["scene"].name, model, *overrides, *wanted)))
    with exclusive_folder(out / "compare" / name) as folder:
        runs, store = dict[str, Kept](), Store(out / "store", fresh)
        for which, named in scenes.items():
            runs[which] = stored_or_solved(named, model, folder / which, store, None)
            unless_interrupted(runs[which].record)
        records = {which: kept.record for which, kept in runs.items()}
        table = difference_table(records["scene"], records["changed"])
        write_text(folder / "differences.csv", table.to_csv(index=False))
    found = {
        "scene": scenes["scene"].name,
        "model": model,
        "changes": list(overrides),
        "status": {which: record.status for which, record in records.items()},
        "differences": table.to_dict("records"),
        "folder": str(folder),
    }
    title = f"{scenes['scene'].name}, {model}: {' '.join(overrides)}"
    lines = difference_lines(records["scene"], records["changed"], table)
    output(json_text(found) if as_json else "\n".join((title, *lines)))
    for which, record in records.items():
        if record.ok and record.message:
            say(f"caution: {which}: {record.message}")
    failures = {which: failure_of(kept, folder / which, None) for which, kept in runs.items()}
    if told := [f"{which}: {failure}" for which, failure in failures.items() if failure]:
        raise RunFailedError(f"compare {scene}, {'; '.join(told)}")
    if not as_json:
        output(f"files in {folder}")
