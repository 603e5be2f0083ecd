"""``fingertap bench``: time against error, scaling, kernels; the skip ledger; peers."""

from pathlib import Path
from typing import TYPE_CHECKING

from validation.harness.command_line import Flag
from validation.harness.console import progress_bar, say
from validation.harness.files import output_folder
from validation.harness.provenance import version
from validation.peers import bar_programs
from validation.studies.bench import (
    bar,
    combined,
    figures,
    integrators,
    kernels,
    ledger,
    measured,
    peers,
    reference_precision,
    reference_truths,
    scaling,
    skips,
    throughput,
    truths,
    work_precision,
)
from validation.studies.bench.files import page, save, save_machine
from validation.studies.bench.kept import Kept

if TYPE_CHECKING:
    from validation.models.adapter import Progress

LEDGER = "What each shortcut saves, and what it costs"
QUICK_BUDGET_S, BUDGET_S = 0.15, 0.5  # for the repeats of one setting


def part(progress: "Progress", low: float, high: float) -> "Progress":
    """A callback whose 0..1 is low..high of another's."""
    return lambda fraction, text: progress(low + (high - low) * fraction, text)


def run_bench(out: Path, quick: bool, resume: bool) -> None:
    """Work-precision of both models, hcm's scaling and throughput, the reference's kernels.

    Every part is written as soon as it is measured.

    Raises
    ------
    UserError
        The output folder cannot be written: nothing was run.
    """
    from threadpoolctl import threadpool_limits

    folder = output_folder(out / "bench")
    budget = QUICK_BUDGET_S if quick else BUDGET_S
    kept = Kept(folder / "points", resume)
    with progress_bar("bench") as progress, threadpool_limits(1, user_api="blas"):
        known = truths.KNOWN if quick else truths.recompute(part(progress, 0.0, 0.1))
        described = {study: [truth.own_error, truth.source]
                     for study, truth in {**known, **reference_truths.KNOWN}.items()}  # fmt: skip
        save_machine(folder, "machine", {"quick": quick, "truths": described})
        speeds = kernels.measure_all(part(progress, 0.1, 0.15))
        save(folder, "kernels", kernels.table(speeds), "Element updates of the reference's kernels")
        figures.kernels(folder / "kernels.png", speeds)
        points = work_precision.measure_all(
            work_precision.ladders(quick), known, budget, kept, part(progress, 0.15, 0.28)
        )
        points += integrators.measure_all(
            integrators.ladder(quick), known[integrators.STUDY], budget, kept,
            part(progress, 0.28, 0.3),
        )  # fmt: skip
        floors = {study: truth.own_error for study, truth in known.items()}
        figures.work_precision(folder / "work-precision-hcm.png", points, floors)
        scenes = throughput.measure(quick, part(progress, 0.3, 0.33))
        save(folder, "throughput", throughput.table(scenes), "Random scenes through hcm")
        sizes = scaling.measure_all(quick, budget, part(progress, 0.33, 0.45))
        save(folder, "scaling", scaling.table(sizes), "Cost of hcm's step against size")
        figures.scaling(folder / "scaling.png", sizes)
        rungs = [
            rung
            for model in reference_precision.DIMENSIONS
            for rung in reference_precision.ladders(model, quick)
        ]
        solid = reference_precision.measure_all(rungs, kept, part(progress, 0.45, 1.0))
    floors = {model: truth.own_error for model, truth in reference_truths.KNOWN.items()}
    figures.work_precision(folder / "work-precision-reference.png", solid, floors)
    own = {"hcm": known["tap"], **reference_truths.KNOWN}
    taps = [point for point in points if point.study == "tap"]
    combined.draw(folder / "work-precision-all.png", [*taps, *solid], own)
    save(folder, "work-precision", measured.table([*points, *solid]), "Time against error")
    save(folder, "truths", combined.truths_table(own), "What the errors are measured against")
    for study, truth in {**known, **reference_truths.KNOWN}.items():
        print(f"truth, {study}: {truth.source}; own error below {truth.own_error:.0e}")
    failures = [point for point in [*points, *solid] if not point.ok]
    if failures:
        say(f"{len(failures)} settings failed; they are in the table and drawn as crosses")
    if kept.read_back:
        say(f"{kept.read_back} settings were measured by an earlier benchmark")
    print(f"figures and tables: {page(folder)}")


def run_peers(out: Path, quick: bool) -> None:
    """Peers of hcm on its scene and of the reference on a bar, one after the other.

    Raises
    ------
    UserError
        The output folder cannot be written: nothing was run.
    """
    from threadpoolctl import threadpool_limits

    folder = output_folder(out / "bench")
    for name in [*peers.absent(), *bar_programs.absent()]:
        say(f"skipped: {name} is not installed")
    versions = {"Exudyn": version("exudyn")} | {
        peer.name: peer.version for peer in bar_programs.PROGRAMS if peer.present
    }
    save_machine(folder, "machine-peers", {"quick": quick, "peers": versions})
    with progress_bar("peers") as progress, threadpool_limits(1, user_api="blas"):
        measured_bar = bar.QUICK_BAR if quick else bar.BAR
        rows = bar.measure_bar(measured_bar, part(progress, 0.0, 0.5))
        save(folder, "peers-reference", bar.table(rows), "The reference and its peers: a bar")
        figures.bar_peers(folder / "peers-reference.png", rows)
        points = peers.measure_all(quick, part(progress, 0.5, 1.0))
    save(folder, "peers", measured.table(points), "hcm and its peers, one scene, one run")
    if any(point.solver != "hcm" for point in points):
        cheapest = peers.cheapest_table(peers.cheapest(points))
        save(folder, "peers-cheapest", cheapest, "The cheapest setting that reaches an error")
    figures.work_precision(folder / "peers.png", points, {"tap": truths.TAP.own_error})
    print(f"figures and tables: {page(folder)}")


def run_skips(out: Path, quick: bool) -> None:
    """The skip ledger.

    Raises
    ------
    UserError
        The output folder cannot be written: nothing was run.
    """
    from threadpoolctl import threadpool_limits

    folder = output_folder(out / "bench")
    save_machine(folder, "machine-skips", {"quick": quick})
    with progress_bar("skips") as progress, threadpool_limits(1, user_api="blas"):
        entries = []
        for entry in skips.measure_all(quick, progress):
            entries.append(entry)  # a ledger that is stopped keeps its lines
            save(folder, "skips", ledger.table(entries), LEDGER, show=False)
    save(folder, "skips", ledger.table(entries), LEDGER)
    figures.skips(folder / "skips.png", entries)
    print(f"figures and tables: {page(folder)}")


def bench(
    *,
    quick: Flag = False,
    skips: Flag = False,
    peers: Flag = False,
    resume: Flag = False,
    out: Path = Path("out"),
) -> None:
    """The verb: the ledger, the peers, both, or (with neither) the models' own curves.

    Parameters
    ----------
    quick
        Fewer and cheaper settings: under three minutes.
    skips
        The ledger of shortcuts instead: time saved and error added by each.
    peers
        Exudyn beside hcm on its scene, CalculiX, Akantu and Kratos beside the reference on a bar
        instead (extra bench, apt-get install calculix-ccx); absent peers are named.
    resume
        Take the points of work-precision that a stopped benchmark has left.
    out
        Folder for bench/: index.html, tables as CSV and Markdown, figures, machine.json.
    """
    if skips:
        run_skips(out, quick)
    if peers:
        run_peers(out, quick)
    if not (skips or peers):
        run_bench(out, quick, resume)
