"""``fingertap waterfall``: the effect of each assumption of the reduced model on a scene."""

from collections.abc import Sequence
from pathlib import Path

from hcm.assumptions import Assumptions
from validation.compare.differences import Difference, difference
from validation.compare.figures import assumption_bars
from validation.errors import RunFailedError
from validation.harness.command_line import Fresh, Overrides
from validation.harness.console import output, progress_bar, say
from validation.harness.figures import GREY, panels
from validation.harness.files import exclusive_folder, safe_name
from validation.harness.quantities import TAP_AND_STRESS, Quantity
from validation.harness.record import RunRecord
from validation.harness.store import Store
from validation.harness.tables import table_of, write_table
from validation.harness.uncertainty import two_digits
from validation.models.variants import Variant, all_variants, cumulative
from validation.runs.execute import Job, in_fresh_process
from validation.scenes.load import load_scene
from validation.validate.plan import assumption_jobs

REFERENCE = "fem3d"


def waterfall(
    scene: str,
    /,
    *,
    overrides: Overrides = (),
    out: Path = Path("out"),
    fresh: Fresh = False,
) -> None:
    """Solve a scene by the reference and by the reduced model, assumption by assumption."""
    named = load_scene(scene, overrides)
    store = Store(out / "store", fresh)
    variants, jobs = all_variants(), assumption_jobs(scene, overrides)
    with exclusive_folder(out / "waterfall" / safe_name(named.name)) as folder:
        with progress_bar(f"waterfall {named.name}") as progress:
            progress(0.0, REFERENCE)
            job = Job(scene, REFERENCE, tuple(overrides))
            (reference,) = in_fresh_process([job], folder / "runs", store)
            progress(0.7, "hcm")
            runs = in_fresh_process(jobs, folder / "runs", store)
        if not reference.ok:
            raise RunFailedError(f"scene {named.name}, {REFERENCE}: {reference.message}")
        rows = [
            [
                difference(named.name, v.name, q, run if run.ok else None, reference)
                for q in TAP_AND_STRESS
            ]
            for v, run in zip(variants, runs, strict=True)
        ]
        _write(folder, named.name, variants, rows, reference)
    output("".join(f"{of.title:>18}" for of in TAP_AND_STRESS))
    for variant, found in zip(variants, rows, strict=True):
        output("".join(f"{_percent(one):>18}" for one in found) + f"  {variant.name}")
    known = [_uncertainty(of, reference) for of in TAP_AND_STRESS]
    uncertainties = "".join(f"{'-' if u is None else '+-' + two_digits(u):>18}" for u in known)
    output(f"{uncertainties}  the reference is known to")
    output(f"errors in %; files in {folder}")
    said: dict[str, list[str]] = {}
    for run in (reference, *runs):
        if run.doubt:
            said.setdefault(run.doubt, []).append(run.label)
    for doubt, (first, *more) in said.items():
        others = f" and {len(more)} more" * bool(more)
        say(f"caution: {named.name}, {first}{others}: {doubt}")
    if own := sorted(named.tables.solver.hcm.stated(Assumptions)):
        say(f"caution: solver.hcm: {', '.join(own)} ignored: this command sets each switch in turn")


def _percent(one: Difference) -> str:
    return "-" if one.error_percent is None else f"{round(one.error_percent, 1) + 0.0:+.1f}"


def _uncertainty(of: Quantity, reference: RunRecord) -> float | None:
    """The reference's own error, percent."""
    error, value = of.error(reference), of.read(reference)
    return None if error is None or not value else 100 * error / abs(value)


def _write(
    folder: Path, scene: str, variants: Sequence[Variant], rows: list[list[Difference]],
    reference: RunRecord,
) -> None:  # fmt: skip
    """Write ``waterfall.csv``, ``.md``, ``.tex`` and ``waterfall.png``."""
    lines = [
        {"assumptions": variant.name}
        | {f"{one.quantity.key}_error_percent": one.error_percent for one in found}
        for variant, found in zip(variants, rows, strict=True)
    ]
    caption = f"{scene}: the reduced model against {reference.label}, assumption by assumption"
    write_table(folder, "waterfall", table_of(lines), caption)
    with panels(folder / "waterfall.png", len(TAP_AND_STRESS), width=2.8, height=4.4) as axes:
        errors = [[one.error_percent or 0.0 for one in found] for found in rows]
        titles, names = [of.title for of in TAP_AND_STRESS], [variant.name for variant in variants]
        assumption_bars(axes[0], titles, names, errors, len(cumulative()))
        for axis, of in zip(axes[0], TAP_AND_STRESS, strict=True):
            if (u := _uncertainty(of, reference)) is not None:
                axis.axvspan(-u, u, color=GREY, alpha=0.3, linewidth=0)
            axis.axvline(0, color="black", linewidth=0.6)
            axis.set_xlabel("error (%)")
