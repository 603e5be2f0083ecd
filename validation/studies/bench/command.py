"""``fingertap bench``: time against error, scaling, kernels; the skip ledger; peers."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from validation.errors import UserError
from validation.harness.command_line import Flag
from validation.harness.console import output, progress_bar, say
from validation.harness.files import exclusive_folder
from validation.harness.provenance import version
from validation.harness.store import Store
from validation.models.adapter import Progress, part
from validation.peers import bar_programs
from validation.studies.bench import (
    bar,
    exudyn_settings,
    figures,
    hcm_settings,
    hcm_speed,
    kernels,
    reference_settings,
    shortcuts,
    truths,
    work_precision,
)
from validation.studies.bench.files import measured_part, page, save
from validation.studies.bench.work_precision import Point, Setting, Solver

LEDGER = "What each shortcut saves, and what it costs"
QUICK_BUDGET_S, BUDGET_S = 0.15, 0.5  # for the repeats of one setting


@contextmanager
def _timing(what: str) -> Iterator[Progress]:
    """A progress bar, with BLAS on one thread, so that it does not share a run's cores."""
    from threadpoolctl import threadpool_limits

    with progress_bar(what) as progress, threadpool_limits(1, user_api="blas"):
        yield progress


def _measure_sizes(folder: Path, quick: bool, budget_s: float, progress: Progress) -> None:
    with measured_part(folder, quick, "throughput"):
        scenes = hcm_speed.measure_throughput(quick, part(progress, 0.0, 0.2))
        save(folder, "throughput", [scenes], "Random scenes through hcm")
    with measured_part(folder, quick, "scaling"):
        sizes = hcm_speed.measure_scaling(quick, budget_s, part(progress, 0.2, 1.0))
        save(folder, "scaling", hcm_speed.table(sizes), "Cost of hcm's step against size")
        figures.scaling(folder / "scaling.png", sizes)


def _report(folder: Path, quick: bool, points: list[Point], solid: list[Point]) -> None:
    """Save all points and their truths on one page; say what failed that was not meant to."""
    own = {"hcm": truths.TAP, **truths.REFERENCE_TRUTHS}
    taps = [point for point in points if point.study == "tap"]
    described = {study: [t.own_error, t.source] for study, t in truths.TRUTHS.items()}
    names = "work-precision", "work-precision-all", "truths"
    with measured_part(folder, quick, *names, truths=described) as every:
        every += [*points, *solid]
        figures.both_models(folder / "work-precision-all.png", [*taps, *solid], own)
        save(folder, "work-precision", work_precision.table(every), "Time against error")
        save(folder, "truths", truths.truths_table(own), "What the errors are measured against")
    for study, truth in truths.TRUTHS.items():
        output(f"truth, {study}: {truth.source}; own error below {truth.own_error:.0e}")
    meant = reference_settings.FAILS
    failures = [one for one in every if not one.ok and not one.setting.startswith(meant)]
    if failures:
        say(f"settings that failed: {len(failures)}; the table has them, figures a cross for each")
    output(f"figures and tables: {page(folder)}")


def _bench_models(folder: Path, quick: bool, resume: bool) -> None:
    """Work-precision of both models, hcm's scaling and throughput, the reference's kernels.

    Every part is written as soon as it is measured.
    """
    store = Store(folder / "points", fresh=not resume)
    budget_s = QUICK_BUDGET_S if quick else BUDGET_S
    with _timing("bench") as progress:

        def measured(
            settings: list[Setting], solver: Solver, budget_s: float, low: float, high: float
        ) -> list[Point]:
            share = part(progress, low, high)
            return work_precision.measure_settings(settings, solver, budget_s, store, share)

        with measured_part(folder, quick, "kernels"):
            speeds = kernels.measure_kernels(part(progress, 0.0, 0.15))
            save(folder, "kernels", speeds, "Element updates of the reference's kernels")
            figures.kernels(folder / "kernels.png", speeds)
        with measured_part(folder, quick, "work-precision-hcm") as points:
            tap = hcm_settings.tap_and_contact_settings(quick)
            points += measured(tap, hcm_settings.HCM_SOLVER, budget_s, 0.15, 0.28)
            explicit = hcm_settings.dop853_settings(quick)
            points += measured(explicit, hcm_settings.DOP853_SOLVER, budget_s, 0.28, 0.3)
            figures.work_precision(folder / "work-precision-hcm.png", points)
        _measure_sizes(folder, quick, budget_s, part(progress, 0.3, 0.45))
        solids = [
            setting
            for model in truths.REFERENCE_TRUTHS
            for setting in reference_settings.reference_settings(model, quick)
        ]
        solver, longer_s = reference_settings.REFERENCE_SOLVER, reference_settings.BUDGET_S
        with measured_part(folder, quick, "work-precision-reference") as solid:
            solid += measured(solids, solver, longer_s, 0.45, 1.0)
            figures.work_precision(folder / "work-precision-reference.png", solid)
    _report(folder, quick, points, solid)


def _bench_peers(folder: Path, quick: bool) -> None:
    """Measure peers of hcm on its scene and of the reference on a bar, one after the other."""
    for name in [*exudyn_settings.absent(), *bar_programs.absent()]:
        say(f"skipped: {name} is not installed")
    versions = {"Exudyn": version("exudyn")} | {
        peer.name: peer.version for peer in bar_programs.PROGRAMS if peer.present
    }
    with _timing("peers") as progress:
        with measured_part(folder, quick, "peers-reference", peers=versions):
            rows = bar.measure_bar(bar.QUICK_BAR if quick else bar.BAR, part(progress, 0.0, 0.5))
            save(folder, "peers-reference", bar.table(rows), "The reference and its peers: a bar")
            figures.bar_peers(folder / "peers-reference.png", rows)
        with measured_part(folder, quick, "peers", "peers-cheapest", peers=versions) as points:
            points += exudyn_settings.measure_peers(quick, part(progress, 0.5, 1.0))
            every = work_precision.table(points)
            save(folder, "peers", every, "hcm and its peers, one scene, one run")
            if any(point.solver != "hcm" for point in points):
                cheapest = exudyn_settings.cheapest_table(points)
                save(folder, "peers-cheapest", cheapest, "The cheapest setting for an error")
            figures.work_precision(folder / "peers.png", points)
    output(f"figures and tables: {page(folder)}")


def _bench_shortcuts(folder: Path, quick: bool) -> None:
    """Measure the skip ledger; if it is stopped, its lines so far are kept."""
    with _timing("skips") as progress, measured_part(folder, quick, "skips"):
        entries = []
        for entry in shortcuts.measure_shortcuts(quick, progress):
            entries.append(entry)
            save(folder, "skips", shortcuts.table(entries), LEDGER, show=False)
        save(folder, "skips", shortcuts.table(entries), LEDGER)
        figures.shortcuts(folder / "skips.png", entries)
    output(f"figures and tables: {page(folder)}")


def bench(
    *,
    quick: Flag = False,
    skips: Flag = False,
    peers: Flag = False,
    resume: Flag = False,
    out: Path = Path("out"),
) -> None:
    """Time against error: the ledger, the peers, both, or (with neither) the models' own curves.

    Parameters
    ----------
    quick
        Fewer and cheaper settings: some three minutes.
    skips
        Instead, the ledger of shortcuts: time saved and error added by each.
    peers
        Instead, Exudyn beside hcm on its scene, CalculiX, Akantu and Kratos beside the reference
        on a bar (extra bench, apt-get install calculix-ccx); missing programs are named.
    resume
        Reuse the work-precision points that a stopped benchmark has left.
    out
        Folder for bench/: index.html, tables as CSV, Markdown and LaTeX, figures, machine-*.json.
    """
    if resume and (skips or peers):
        other = "--skips" if skips else "--peers"
        raise UserError(f"{other} --resume: only the models' own curves go on; leave one out")
    with exclusive_folder(out / "bench") as folder:
        try:
            if skips:
                _bench_shortcuts(folder, quick)
            if peers:
                _bench_peers(folder, quick)
            if not (skips or peers):
                _bench_models(folder, quick, resume)
        except KeyboardInterrupt:
            say(f"stopped; what was measured by then, if anything: {page(folder)}")
            raise
