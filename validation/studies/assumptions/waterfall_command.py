"""``fingertap waterfall``: the effect of each assumption of the reduced model on a scene."""

import textwrap
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hcm.assumptions import Assumptions
from validation.compare.differences import Difference, differences_of
from validation.compare.figures import AS_WRITTEN, assumption_bars
from validation.errors import RunFailedError, UserError
from validation.harness.command_line import AsJson, Fresh, Overrides
from validation.harness.console import output, progress_bar, say
from validation.harness.figures import BLACK, ORANGE, panels
from validation.harness.files import exclusive_folder, json_text, remove, safe_name
from validation.harness.quantities import TAP_AND_STRESS, finite
from validation.harness.record import RunRecord
from validation.harness.store import Store
from validation.harness.tables import table_of, write_table
from validation.harness.uncertainty import two_digits, with_error
from validation.models import default_accuracy
from validation.models.hcm import NO_STIFFNESS
from validation.models.variants import cumulative, short_name
from validation.runs.execute import Job, in_fresh_process
from validation.scenes.load import load_scene
from validation.validate.plan import assumption_jobs

REFERENCE = "fem3d"
OWN = "the reference's own error"
MODELS_OWN = 0.3  # percent: what the reduced model's fixed settings leave of a peak
WIDE = 130  # characters of a line of the figure's title


def waterfall(
    scene: str,
    /,
    *,
    overrides: Overrides = (),
    out: Path = Path("out"),
    fresh: Fresh = False,
    as_json: AsJson = False,
) -> None:
    """Solve a scene by the reference and by the reduced model, assumption by assumption.

    Parameters
    ----------
    out
        Folder for waterfall/SCENE/: waterfall.csv, waterfall.md, waterfall.tex, waterfall.png,
        and each run.
    """
    named = load_scene(scene, overrides)
    if named.tables.tip.normal_stiffness is None:
        raise UserError(f"scene {named.name}: {NO_STIFFNESS}")
    store = Store(out / "store", fresh)
    with exclusive_folder(out / "waterfall" / safe_name(named.name)) as folder:
        remove(folder, "waterfall.*")  # an earlier call's, perhaps with other overrides
        with progress_bar(f"waterfall {named.name}") as progress:
            progress(0.0, REFERENCE)
            own = (*default_accuracy(REFERENCE, named.tables), *overrides)
            job = Job(scene, REFERENCE, own)
            (reference,) = in_fresh_process([job], folder / "runs", store)
            if not reference.ok:
                raise RunFailedError(f"scene {named.name}, {REFERENCE}: {reference.message}")
            progress(0.7, "hcm")
            runs = in_fresh_process(assumption_jobs(scene, overrides), folder / "runs", store)
        ended = ((run.variant, run if run.ok else None) for run in runs)
        rows = [differences_of(named.name, *one, reference, TAP_AND_STRESS) for one in ended]
        stated = ", ".join(sorted(named.tables.solver.hcm.stated(Assumptions)))
        ignored = [f"solver.hcm: {stated} ignored: this command sets each switch in turn"]
        ignored *= bool(stated)
        title = f"{named.name}{' with ' * bool(overrides)}{', '.join(overrides)}: the reduced model"
        title += f" against {reference.label}, assumption by assumption"
        completed = [run for run in (reference, *runs) if run.ok]
        full = _write(folder, title, [*_said(completed), *ignored], rows, runs)
    said = ["".join(f"{of.title:>18}" for of in TAP_AND_STRESS)]
    for found, run in zip(rows, runs, strict=True):
        said.append("".join(f"{_percent(one):>18}" for one in found) + f"  {run.variant}")
    said.append("".join(f"{_known(one):>18}" for one in rows[0]) + f"  {OWN}")
    said.append(f"errors in %; files in {folder}")
    given = {"scene": named.name, "changes": list(overrides), "reference": reference.label}
    printed = given | {"assumptions": full, "folder": str(folder)}
    output(json_text(printed) if as_json else "\n".join(said))
    for text in (*_said((reference, *runs)), *ignored):
        say(f"caution: {named.name}, {text}")
    if failed := [run.variant for run in runs if not run.ok]:
        raise RunFailedError(
            f"scene {named.name}: {len(failed)} of {len(runs)} reduced runs failed:"
            f" {', '.join(failed)}"
        )


def _said(runs: Iterable[RunRecord]) -> list[str]:
    """What runs say of themselves, each text once."""
    said: dict[str, list[str]] = {}
    for run in runs:
        if run.doubt:
            said.setdefault(run.doubt, []).append(run.label)
    return [
        f"{first}{f' and {len(more)} more' * bool(more)}: {doubt}"
        for doubt, (first, *more) in said.items()
    ]


def _own_error(one: Difference) -> float | None:
    """The reference's own error, percent; None: not known."""
    if one.reference_error is None or not one.reference:
        return None
    return finite(100.0 * one.reference_error / abs(one.reference))


def _known(one: Difference) -> str:
    error = _own_error(one)
    return "+-?" if error is None else f"+-{two_digits(error)}"


def _percent(one: Difference) -> str:
    """A difference with the digits that the reduced model leaves: the reference's own error is
    common to all rows, which show what each step is worth.
    """
    if one.error_percent is None:
        return "-"
    number, _, _ = with_error(one.error_percent, MODELS_OWN).partition(" ")
    return number if number.startswith("-") else f"+{number}"


def _write(
    folder: Path, title: str, cautions: Sequence[str], rows: Sequence[Sequence[Difference]],
    runs: Sequence[RunRecord],
) -> list[dict[str, Any]]:  # fmt: skip
    """Write ``waterfall.md``, ``.tex``, ``.csv`` and ``waterfall.png``; returns the rows of the
    ``.csv``.
    """
    shown: list[dict[str, str | None]] = []
    full: list[dict[str, Any]] = []
    for found, run in zip(rows, runs, strict=True):
        texts = {f"{one.quantity.title} (%)": _percent(one) for one in found}
        errors = {f"{one.quantity.key}_error_percent": one.error_percent for one in found}
        own = {f"{one.quantity.key}_reference_error_percent": _own_error(one) for one in found}
        shown.append(
            {"assumptions": run.variant, **texts, "failed": None if run.ok else run.status}
        )
        full.append(
            {"assumptions": run.variant, **errors, **own, "failed": None if run.ok else run.doubt}
        )
    known = {f"{one.quantity.title} (%)": _known(one) for one in rows[0]}
    shown.append({"assumptions": OWN, **known})
    caption = ". ".join((title, *(f"Caution: {text}" for text in cautions)))
    write_table(folder, "waterfall", table_of(full), caption, table_of(shown))
    _draw(folder / "waterfall.png", title, rows, runs)
    return full


def _draw(
    path: Path, title: str, rows: Sequence[Sequence[Difference]], runs: Sequence[RunRecord]
) -> None:
    """Draw each variant's errors, a word where there is none, and the reference's own as a band."""
    errors = np.array([[one.error_percent for one in found] for found in rows], float)
    titles, names = [of.title for of in TAP_AND_STRESS], [short_name(run.variant) for run in runs]
    with panels(path, len(titles), width=2.8, height=4.8, style=AS_WRITTEN) as axes:
        places = assumption_bars(axes[0], titles, names, errors, len(cumulative()))
        bands = []
        for axis, column in zip(axes[0], zip(*rows, strict=True), strict=True):
            for place, one, run in zip(places, column, runs, strict=True):
                if one.error_percent is None:
                    axis.annotate(
                        "no number" if run.ok else "failed", (0, place), (3, 0), color=ORANGE,
                        textcoords="offset points", va="center", fontsize=7,
                    )  # fmt: skip
            if (u := _own_error(column[0])) is not None:
                bands.append(axis.axvspan(-u, u, color=ORANGE, alpha=0.2, linewidth=0, zorder=0))
            axis.axvline(0, color=BLACK, linewidth=0.6)
            axis.set_ylim(places[-1] - 0.6, 0.6)
            axis.set_xlabel("error (%)")
        figure = axes[0][0].figure
        figure.suptitle(textwrap.fill(title, WIDE), fontsize=10, x=0.01, ha="left")
        figure.legend(bands[:1], [OWN][: len(bands)], loc="outside lower center")
