"""How well stated errors bound true ones: counts, a figure, a page."""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from reference_fem import ACCURACY_QUANTITIES
from validation.harness.figures import BLACK, GREY, ORANGE, panels
from validation.harness.page import section, write_page
from validation.harness.uncertainty import two_digits
from validation.studies.calibration.scenes import KINDS, RandomTap
from validation.studies.stated_errors import (
    ROUND_OFF_SHARE,
    UNDERSTATED_FACTOR,
    WRONG_SHARE,
    StatedError,
    understated,
)

FAR = 3.0  # times the accuracy asked for
SMALLEST = 1e-9  # drawn for an error of zero
NUMBER = ("scene", "kind", "quantity", "stated", "true", "cautioned", "doubted", "overrides")

Row = tuple[int, RandomTap, Mapping[str, Any]]


def numbers_of(rows: Sequence[Row]) -> pd.DataFrame:
    """A row for each number of a completed run: its scene, quantity, relative errors.

    cautioned, doubted : whether the run, and its tight solve, has a caution. missed : whether the
    stated error is too small. silent : whether the number is wrong and the run has no caution.
    """
    lines = [
        (index, case.kind, quantity, *StatedError(*number).shares, bool(row["caution"]),
         bool(row["tight_caution"]), "; ".join(case.overrides))
        for index, case, row in rows
        for quantity, number in row["numbers"].items()
    ]  # fmt: skip
    typed = {"stated": float, "true": float, "cautioned": bool, "doubted": bool}
    found = pd.DataFrame(lines, columns=NUMBER).astype(typed)
    silent = (found["true"] > WRONG_SHARE) & ~found["cautioned"]
    return found.assign(missed=understated(found["stated"], found["true"]), silent=silent)


def endings(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """How runs of each kind ended; those without a tight solve are not judged."""
    counts = Counter(
        (case.kind, row["status"], row["tight_status"] or "not solved") for _, case, row in rows
    )
    return [
        {"scenes": kind, "run": status, "tight solve": tight, "number": count}
        for (kind, status, tight), count in sorted(counts.items())
    ]


def table(numbers: pd.DataFrame) -> list[dict[str, Any]]:
    """How often the stated error is too small, or missing.

    A row per quantity and per kind of scene, one for those judged without a caution, one for all.
    """
    kinds = [(f"of scenes: {kind}", own) for kind, own in numbers.groupby("kind", sort=False)]
    rows = []
    for name, own in (
        *numbers.groupby("quantity", sort=False),
        *kinds,
        *_uncautioned_and_all(numbers),
    ):
        stated, true = (own[error].clip(lower=ROUND_OFF_SHARE) for error in ("stated", "true"))
        ratios = (stated / true)[np.isfinite(stated) & np.isfinite(true)]
        missed = int(own["missed"].sum())
        rows.append(
            {
                "quantity": name,
                "numbers": len(own),
                "true error, median (%)": 100 * float(true.median()) if len(own) else None,
                "stated / true, median": float(ratios.median()) if len(ratios) else None,
                f"more than {UNDERSTATED_FACTOR:g} stated errors off": missed,
                "share (%)": 100 * missed / max(len(own), 1),
                f"{100 * WRONG_SHARE:g} % wrong and silent": int(own["silent"].sum()),
                "nothing stated": int(np.isinf(own["stated"]).sum()),
            }
        )
    return rows


def misses(numbers: pd.DataFrame) -> list[dict[str, Any]]:
    """Every number that is missed or silent, with its scene, the worst first."""
    poor = numbers[numbers["missed"] | numbers["silent"]]
    beyond = poor["true"] / poor["stated"].clip(lower=ROUND_OFF_SHARE)
    poor = poor.loc[beyond.sort_values(ascending=False, kind="stable").index, list(NUMBER)]
    percent = poor.assign(stated=100 * poor["stated"], true=100 * poor["true"])
    titles = {"stated": "stated (%)", "true": "true (%)", "doubted": "tight solve cautioned"}
    found: list[dict[str, Any]] = percent.rename(columns=titles).to_dict("records")
    return found


def accuracy_kept(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """How many runs keep the accuracy asked of them, among all and among those that say they do.

    A row per kind of scene, one for those judged without a caution, one for all.
    """
    names = ACCURACY_QUANTITIES
    lines = [
        (case.kind, bool(row["tight_caution"]), case.accuracy,
         max(StatedError(*row["numbers"][name]).shares[1] for name in names) / case.accuracy,
         (row.get("expected") or 0.0) <= case.accuracy, row["seconds"][0])
        for _, case, row in rows
        if case.accuracy is not None and all(name in row["numbers"] for name in names)
    ]  # fmt: skip
    columns = ("kind", "doubted", "accuracy", "off", "said", "seconds")
    judged = pd.DataFrame(lines, columns=columns).astype({"doubted": bool})
    kinds = [(kind, judged[judged["kind"] == kind]) for kind in KINDS]
    found = []
    for name, own in (*kinds, *_uncautioned_and_all(judged)):
        if own.empty:
            continue
        off, said = own["off"], own["off"][own["said"]]
        found.append(
            {
                "scenes": name, "accuracy": float(own["accuracy"].iloc[0]), "number": len(own),
                "within (%)": 100 * float((off <= 1.0).mean()),
                f"beyond {FAR:g} times": int((off > FAR).sum()),
                "error / accuracy, median": float(off.median()), "largest": float(off.max()),
                "say they keep it": len(said),
                "of these within (%)": 100 * float((said <= 1.0).mean()) if len(said) else None,
                f"of these beyond {FAR:g} times": int((said > FAR).sum()),
                "seconds, median": float(own["seconds"].median()),
            }
        )  # fmt: skip
    return found


def _uncautioned_and_all(rows: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    """Rows whose tight solve has no caution (it has one where it touches outside its fine edges),
    and all.
    """
    return [("judged without a caution", rows[~rows["doubted"]]), ("all", rows)]


def draw(path: Path, numbers: pd.DataFrame, names: Mapping[str, str]) -> None:
    """Plot true over stated errors, a panel per quantity; lines at 1:1 and `UNDERSTATED_FACTOR`."""
    present = [name for name in names if (numbers["quantity"] == name).any()]
    columns = 3
    rows = -(-len(present) // columns) or 1
    ends = np.array([SMALLEST, 10.0])
    with panels(path, columns, rows, width=3.0, height=2.7, sharex=True, sharey=True) as axes:
        for axis, name in zip(axes.flat, present, strict=False):
            axis.plot(ends, ends, color=BLACK, linewidth=0.8)
            axis.plot(ends, UNDERSTATED_FACTOR * ends, color=BLACK, linewidth=0.8, linestyle="--")
            own = numbers[numbers["quantity"] == name]
            poor = own["missed"] | own["silent"]
            for chosen, color in ((own[~poor], GREY), (own[poor], ORANGE)):
                stated, true = (chosen[error].clip(*ends) for error in ("stated", "true"))
                axis.plot(stated, true, ".", color=color, markersize=3.5)
            axis.set(xscale="log", yscale="log", xlim=ends, ylim=ends)
            axis.set_title(names[name], fontsize=8)
        for axis in axes[-1]:
            axis.set_xlabel("stated error, relative")
        for axis in axes[:, 0]:
            axis.set_ylabel("true error, relative")


def write_report(folder: Path, model: str, rows: Sequence[Row], names: Mapping[str, str]) -> str:
    """Write tables, figure and page; returns a line that sums them up."""
    numbers = numbers_of(rows)
    tables = {
        f"{model}-calibration": (table(numbers), "Stated against true errors, by quantity"),
        f"{model}-endings": (endings(rows), "How the runs ended"),
        f"{model}-misses": (misses(numbers), "Numbers whose stated error is too small"),
    }
    if kept := accuracy_kept(rows):
        tables = {f"{model}-held": (kept, "Runs that keep the accuracy asked of them"), **tables}
    picture = folder / f"{model}-calibration.png"
    draw(picture, numbers, names)
    sections = [
        section(folder, f"{model}: {caption}", name, found, figures=[picture] * (not place))
        for place, (name, (found, caption)) in enumerate(tables.items())
    ]
    judged, spoilt = (own["scene"].nunique() for own in (numbers, numbers[numbers["silent"]]))
    poor, silent = (int(numbers[part].sum()) for part in ("missed", "silent"))
    share = 100 * poor / max(len(numbers), 1)
    within = f"; {kept[-1]['within (%)']:.3g} % of {kept[-1]['number']} runs keep" if kept else ""
    line = (
        f"{model}: {len(rows)} scenes, {judged} with a tight solve, {len(numbers)} numbers:"
        f" {poor} ({two_digits(share)} %) more than {UNDERSTATED_FACTOR:g} times their stated error"
        f" off, {silent} in {spoilt} scenes more than {100 * WRONG_SHARE:g} % wrong and silent"
        f"{within}"
    )
    heading = "Stated against true errors"
    page = {"sections": sections, "part": model, "heading": heading, "lead": [line]}
    write_page(folder / f"{model}.html", "sections.html.j2", page)
    return line
