"""``fingertap bench``: time against error, scaling, kernels; the skip ledger; peers."""

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING

from validation.bench import (
    bar_peers,
    figures,
    kernels,
    measured,
    peers,
    reference_points,
    scaling,
    skips,
    truths,
    work_precision,
)
from validation.console import progress_bar, say
from validation.provenance import provenance, version
from validation.storage import output_folder, write_json, write_text
from validation.tables import for_people

if TYPE_CHECKING:
    import pandas as pd

    from validation.models.adapter import Progress

QUICK_BUDGET_S, BUDGET_S = 0.15, 0.5  # for the repeats of one setting


def part(progress: "Progress", low: float, high: float) -> "Progress":
    """A callback whose 0..1 is low..high of another's."""
    return lambda fraction, text: progress(low + (high - low) * fraction, text)


def machine(extra: dict[str, object]) -> dict[str, object]:
    """Machine, versions and load: a time means nothing without them."""
    where = provenance({})
    where.pop("scene_toml")
    load = os.getloadavg() if hasattr(os, "getloadavg") else None
    return {**where, "load_average_at_start": load, **extra}


def save(folder: Path, name: str, table: "pd.DataFrame", caption: str) -> None:
    """Write CSV, with the machine in every row, and Markdown; print the latter."""
    where = provenance({})
    labelled = table.assign(
        processor=where["processor"], versions=json.dumps(where["versions"], sort_keys=True)
    )
    write_text(folder / f"{name}.csv", labelled.to_csv(index=False, float_format="%.10g"))
    people = for_people(table).to_markdown(index=False, disable_numparse=True)
    write_text(folder / f"{name}.md", f"{caption}. {where['processor']}.\n\n{people}\n")
    print(f"\n{caption}\n{people}")


def run_bench(out: Path, quick: bool) -> None:
    """Work-precision of both models, hcm's scaling, the reference's kernels.

    Raises
    ------
    UserError
        The output folder cannot be written: nothing was run.
    """
    from threadpoolctl import threadpool_limits

    folder = output_folder(out / "bench")
    budget = QUICK_BUDGET_S if quick else BUDGET_S
    with progress_bar("bench") as progress, threadpool_limits(1, user_api="blas"):
        known = truths.KNOWN if quick else truths.recompute(part(progress, 0.0, 0.1))
        described = {study: [truth.own_error, truth.source] for study, truth in known.items()}
        write_json(folder / "machine.json", machine({"quick": quick, "truths": described}))
        speeds = kernels.measure_all(part(progress, 0.1, 0.2))
        points = work_precision.measure_all(
            work_precision.ladders(quick), known, budget, part(progress, 0.2, 0.5)
        )
        sizes = scaling.measure_all(quick, budget, part(progress, 0.5, 0.7))
        cases = reference_points.QUICK if quick else reference_points.FULL
        points += reference_points.measure_all(
            cases, output_folder(folder / "runs"), part(progress, 0.7, 1.0)
        )
    save(folder, "work-precision", measured.table(points), "Time against error")
    save(folder, "scaling", scaling.table(sizes), "Cost of hcm's step against size")
    save(folder, "kernels", kernels.table(speeds), "Element updates of the reference's kernels")
    floors = {study: truth.own_error for study, truth in known.items()}
    figures.work_precision(folder / "work-precision.png", points, floors)
    figures.scaling(folder / "scaling.png", sizes)
    figures.kernels(folder / "kernels.png", speeds)
    for study, truth in known.items():
        print(f"truth, {study}: {truth.source}; own error below {truth.own_error:.0e}")
    failures = [p for p in points if not p.ok and p.status != "FINEST"]
    if failures:
        say(f"{len(failures)} settings failed; they are in the table and drawn as crosses")
    print(f"figures and tables: {folder}")


def run_peers(out: Path, quick: bool) -> None:
    """Peers of hcm on its scene and of the reference on a bar, one after the other.

    Raises
    ------
    UserError
        The output folder cannot be written: nothing was run.
    """
    from threadpoolctl import threadpool_limits

    folder = output_folder(out / "bench")
    for name in [*peers.absent(), *bar_peers.absent()]:
        say(f"skipped: {name} is not installed")
    versions = {"Exudyn": version("exudyn")} | {
        peer.name: peer.version for peer in bar_peers.PEERS if peer.present
    }
    write_json(folder / "machine-peers.json", machine({"quick": quick, "peers": versions}))
    with progress_bar("peers") as progress, threadpool_limits(1, user_api="blas"):
        points = peers.measure_all(quick, part(progress, 0.0, 0.5))
        bar = bar_peers.QUICK_BAR if quick else bar_peers.BAR
        rows = bar_peers.measure_all(bar, part(progress, 0.5, 1.0))
    save(folder, "peers-reference", bar_peers.table(rows), "The reference and its peers on one bar")
    save(folder, "peers", measured.table(points), "hcm and its peers, one scene, one run")
    if any(point.solver != "hcm" for point in points):
        cheapest = peers.cheapest_table(peers.cheapest(points))
        save(folder, "peers-cheapest", cheapest, "The cheapest setting that reaches an error")
    figures.work_precision(folder / "peers.png", points, {"tap": truths.TAP.own_error})
    print(f"figures and tables: {folder}")


def run_skips(out: Path, quick: bool) -> None:
    """The skip ledger.

    Raises
    ------
    UserError
        The output folder cannot be written: nothing was run.
    """
    from threadpoolctl import threadpool_limits

    folder = output_folder(out / "bench")
    write_json(folder / "machine-skips.json", machine({"quick": quick}))
    with progress_bar("skips") as progress, threadpool_limits(1, user_api="blas"):
        entries = skips.measure_all(quick, progress)
    save(folder, "skips", skips.table(entries), "What each shortcut saves, and what it costs")
    print(f"tables: {folder}")


def bench(out: Path, quick: bool, with_skips: bool, with_peers: bool) -> None:
    """The verb: the ledger, the peers, both, or (with neither) the models' own curves."""
    if with_skips:
        run_skips(out, quick)
    if with_peers:
        run_peers(out, quick)
    if not (with_skips or with_peers):
        run_bench(out, quick)
