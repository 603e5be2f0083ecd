"""How well stated errors bound true ones: counts, a figure, a page."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from validation.harness.figures import BLACK, GREY, ORANGE, panels
from validation.harness.page import write_page
from validation.harness.provenance import provenance
from validation.harness.tables import write_table
from validation.studies.calibration.scenes import KINDS, Case
from validation.studies.stated_errors import FLOOR, TIMES, WRONG, understated

FAR = 3.0  # times the accuracy asked for
# What an accuracy is about.
HELD = ("peak_normal_force_N", "normal_impulse_N_s", "contact_duration_s", "contact_time_s")
SMALLEST = 1e-9  # drawn in the place of no error


@dataclass(frozen=True)
class Number:
    """One number of a completed run: its quantity, relative stated and true error, its scene.

    doubted : whether the tight solve has a caution of its own
    """

    quantity: str
    stated: float
    true: float
    cautioned: bool
    index: int
    case: Case
    doubted: bool

    @property
    def missed(self) -> bool:
        """Whether the stated error is too small."""
        return understated(self.stated, self.true)

    @property
    def silent(self) -> bool:
        """Whether it is wrong, and the run says nothing."""
        return self.true > WRONG and not self.cautioned


Row = tuple[int, Case, Mapping[str, Any]]


def numbers_of(rows: Sequence[Row]) -> Iterator[Number]:
    """Those of all scenes: their numbers, cases and results."""
    for index, case, row in rows:
        for quantity, (_, stated, true, scale) in row["numbers"].items():
            yield Number(
                quantity, stated / scale, true / scale, bool(row["caution"]), index, case,
                bool(row["tight_caution"]),
            )  # fmt: skip


def endings(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """How runs of each kind ended; those without a tight solve are not judged."""
    counts = Counter(
        (case.kind, row["status"], row["tight_status"] or "not solved") for _, case, row in rows
    )
    return [
        {"scenes": kind, "run": status, "tight solve": tight, "number": count}
        for (kind, status, tight), count in sorted(counts.items())
    ]


def table(numbers: Sequence[Number]) -> list[dict[str, Any]]:
    """How often the stated error is too small, or missing.

    A row a quantity and a kind of scene; of what tight solves without a caution of their own judge,
    which they have where they touch beside their fine edges; and of all.
    """
    groups: dict[str, list[Number]] = {}
    for number in numbers:
        for name in (number.quantity, f"of scenes: {number.case.kind}"):
            groups.setdefault(name, []).append(number)
    groups = {name: groups[name] for name in sorted(groups, key=lambda name: ":" in name)}
    groups["judged without a caution"] = [n for n in numbers if not n.doubted]
    rows = []
    for name, group in [*groups.items(), ("all", list(numbers))]:
        true = np.array([max(n.true, FLOOR) for n in group])
        stated = np.array([max(n.stated, FLOOR) for n in group])
        finite = np.isfinite(stated) & np.isfinite(true)
        missed = sum(n.missed for n in group)
        rows.append(
            {
                "quantity": name,
                "numbers": len(group),
                "true error, median (%)": 100 * float(np.median(true)) if group else None,
                "stated / true, median": float(np.median(stated[finite] / true[finite]))
                if finite.any()
                else None,
                f"more than {TIMES:g} stated errors off": missed,
                "share (%)": 100 * missed / max(len(group), 1),
                f"{100 * WRONG:g} % wrong and silent": sum(n.silent for n in group),
                "nothing stated": int(np.isinf([n.stated for n in group]).sum()),
            }
        )
    return rows


def misses(numbers: Sequence[Number]) -> list[dict[str, Any]]:
    """Every number that is missed or silent, with its scene, the worst first."""
    poor = sorted(
        (n for n in numbers if n.missed or n.silent),
        key=lambda n: -n.true / max(n.stated, FLOOR),
    )
    return [
        {
            "scene": n.index, "kind": n.case.kind, "quantity": n.quantity,
            "stated (%)": 100 * n.stated, "true (%)": 100 * n.true, "cautioned": n.cautioned,
            "tight solve cautioned": n.doubted, "overrides": "; ".join(n.case.overrides),
        }
        for n in poor
    ]  # fmt: skip


def held(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """How many runs keep the accuracy asked of them, and of those that say they do.

    A row a kind of scene, one for all, and one for those whose tight solve has no caution.
    """
    judged = [
        (case, row, max(row["numbers"][name][2] / row["numbers"][name][3] for name in HELD))
        for _, case, row in rows
        if case.accuracy is not None and all(name in row["numbers"] for name in HELD)
    ]
    groups = {kind: [one for one in judged if one[0].kind == kind] for kind in KINDS}
    groups["judged without a caution"] = [one for one in judged if not one[1]["tight_caution"]]
    found = []
    for name, own in {**groups, "all": judged}.items():
        if not own:
            continue
        off = np.array([error / case.accuracy for case, _, error in own])
        wanted = own[0][0].accuracy or 0.0
        said = np.array([(row.get("expected") or 0.0) <= wanted for _, row, _ in own])
        kept = off[said] <= 1.0
        found.append(
            {
                "scenes": name, "accuracy": wanted, "number": len(own),
                "within (%)": 100 * float((off <= 1.0).mean()),
                f"beyond {FAR:g} times": int((off > FAR).sum()),
                "error / accuracy, median": float(np.median(off)), "largest": float(off.max()),
                "say they keep it": int(said.sum()),
                "of these within (%)": 100 * float(kept.mean()) if kept.size else None,
                f"of these beyond {FAR:g} times": int((off[said] > FAR).sum()),
                "seconds, median": float(np.median([row["seconds"][0] for _, row, _ in own])),
            }
        )  # fmt: skip
    return found


def draw(path: Path, numbers: Sequence[Number], names: Mapping[str, str]) -> None:
    """True against stated error, a panel a quantity, with the lines of 1:1 and `TIMES` : 1."""
    present = [name for name in names if any(n.quantity == name for n in numbers)]
    columns = 3
    rows = -(-len(present) // columns) or 1
    ends = np.array([SMALLEST, 10.0])
    with panels(path, columns, rows, width=3.0, height=2.7, sharex=True, sharey=True) as axes:
        for axis, name in zip(axes.flat, present, strict=False):
            group = [n for n in numbers if n.quantity == name]
            stated, true = (
                np.clip([getattr(n, part) for n in group], *ends) for part in ("stated", "true")
            )
            poor = np.array([n.missed or n.silent for n in group])
            axis.plot(ends, ends, color=BLACK, linewidth=0.8)
            axis.plot(ends, TIMES * ends, color=BLACK, linewidth=0.8, linestyle="--")
            for chosen, color in ((~poor, GREY), (poor, ORANGE)):
                axis.plot(stated[chosen], true[chosen], ".", color=color, markersize=3.5)
            axis.set(xscale="log", yscale="log", xlim=ends, ylim=ends)
            axis.set_title(names[name], fontsize=8, loc="left")
        for axis in axes[-1]:
            axis.set_xlabel("stated error, relative")
        for axis in axes[:, 0]:
            axis.set_ylabel("true error, relative")


def write_report(folder: Path, model: str, rows: Sequence[Row], names: Mapping[str, str]) -> str:
    """Tables, figure and page of what is solved; one line that sums them up."""
    import pandas as pd

    numbers = list(numbers_of(rows))
    tables = {
        f"{model}-calibration": (table(numbers), "Stated against true errors, by quantity"),
        f"{model}-endings": (endings(rows), "How the runs ended"),
        f"{model}-misses": (misses(numbers), "Numbers whose stated error is too small"),
    }
    if kept := held(rows):
        tables = {f"{model}-held": (kept, "Runs that keep the accuracy asked of them"), **tables}
    for name, (found, caption) in tables.items():
        write_table(folder, name, pd.DataFrame(found), f"{model}: {caption}")
    picture = folder / f"{model}-calibration.png"
    draw(picture, numbers, names)
    sections = [
        {
            "title": f"{model}: {caption}", "notes": (), "figures": [picture] * (not place),
            "tables": [{"columns": list(found[0]), "rows": found, "name": name}] if found else [],
        }
        for place, (name, (found, caption)) in enumerate(tables.items())
    ]  # fmt: skip
    judged = {n.index for n in numbers}
    poor, silent = (sum(getattr(n, part) for n in numbers) for part in ("missed", "silent"))
    spoilt = len({n.index for n in numbers if n.silent})
    share = 100 * poor / max(len(numbers), 1)
    within = f"; {kept[-1]['within (%)']:.3g} % of {kept[-1]['number']} runs keep" if kept else ""
    line = (
        f"{model}: {len(rows)} scenes, {len(judged)} with a tight solve, {len(numbers)} numbers:"
        f" {poor} ({share:.2g} %) more than {TIMES:g} times their stated error off,"
        f" {silent} in {spoilt} scenes more than {100 * WRONG:g} % wrong and silent{within}"
    )
    machine = {"part": model, "quick": False, "load_average_at_start": None, **provenance({})}
    page = {"sections": sections, "machines": [machine], "heading": "Stated against true errors",
            "lead": [line]}  # fmt: skip
    write_page(folder / f"{model}.html", "bench.html.j2", page)
    return line
