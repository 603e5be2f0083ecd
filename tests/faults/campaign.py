"""Faults, injected at random into real commands: what is lost must be nothing.

    python -m tests.faults.campaign --faults 200

After every fault, or series of faults, the same command has to complete with the results of an
undisturbed run (every number that is no time or memory, bit for bit); what was stored or finished
has to be there still, made once. Full and read-only disks are small file systems of their own and
need root; without it they are left out, by name. Exit code 1 if anything was lost.
"""

import argparse
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from . import disks, signals
from .bench import Bench, Tally
from .commands import LONG, PAPER, PLANE, RUN, SOLID, STRESS, VALIDATE

Kind = Callable[[Bench], Tally]

SMALL_DISKS_K = (4, 8, 40, 100, 200, 300, 400, 600, 800, 1000)


def plan(faults: int, only: Sequence[str], count: int | None) -> list[tuple[str, Kind]]:
    """Kinds of faults with their share or a count of each, cheap ones first."""

    def share(part: float) -> int:
        return count or max(1, round(part * faults))

    sizes = SMALL_DISKS_K[:: max(1, len(SMALL_DISKS_K) // share(0.05))]
    everything: list[tuple[str, Kind]] = [
        ("run", lambda b: signals.signals(b, RUN, share(0.1), 1.1, each=True)),
        ("run-on", lambda b: signals.signals(b, RUN, share(0.1), 1.1, each=False)),
        ("plane", lambda b: signals.signals(b, PLANE, share(0.05), 1.1, each=True)),
        ("two", lambda b: signals.two_processes(b, RUN, share(0.05))),
        ("limit", lambda b: disks.file_limit(b, PLANE, share(0.07))),
        ("full", lambda b: disks.full_disk(b, PLANE, sizes)),
        ("read-only", lambda b: disks.read_only(b, (RUN, PLANE))),
        ("long", lambda b: signals.signals(b, LONG, share(0.04), 1.1, each=True)),
        ("solid", lambda b: signals.signals(b, SOLID, share(0.02), 1.1, each=True)),
        ("paper", lambda b: signals.signals(b, PAPER, share(0.15), 0.2, each=False)),
        ("stress", lambda b: signals.signals(b, STRESS, share(0.12), 0.1, each=False)),
        ("validate", lambda b: signals.signals(b, VALIDATE, share(0.06), 0.3, each=False)),
    ]
    return [(name, kind) for name, kind in everything if not only or name in only]


def report(tally: Tally, seconds: float) -> None:
    """One line a kind, and one for each loss."""
    print(
        f"{tally.kind:<60}{tally.injected:>4} faults {len(tally.lost):>3} losses {seconds:>6.0f} s"
    )
    for what in tally.lost:
        print(f"    LOST {' '.join(what.split())}")
    for what in tally.notes:
        print(f"    note {what}")
    sys.stdout.flush()


def run(given: argparse.Namespace, folder: Path) -> list[Tally]:
    """Inject the faults of a plan, and report them as they come."""
    bench = Bench(folder, random.Random(given.seed))
    tallies = []
    for name, kind in plan(given.faults, given.only, given.count):
        if name in ("full", "read-only") and os.geteuid() != 0:
            print(f"{name}: left out, a file system of its own needs root")
            continue
        began = time.monotonic()
        tallies.append(kind(bench))
        report(tallies[-1], time.monotonic() - began)
    return tallies


def main() -> None:
    """Read the command line, run, and sum up."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else "")
    parser.add_argument("--faults", type=int, default=200, help="about how many to inject")
    parser.add_argument("--count", type=int, help="of every kind in --only, instead of its share")
    parser.add_argument("--only", nargs="*", default=[], help="kinds, by the names in plan()")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", action="store_true", help="keep the folder")
    given = parser.parse_args()
    # what a shell starts in its background is deaf to interrupts, and so are its children
    signal.signal(signal.SIGINT, signal.default_int_handler)
    folder = Path(tempfile.mkdtemp(prefix="faults-"))
    try:
        tallies = run(given, folder)
    finally:
        if not given.keep:
            shutil.rmtree(folder, ignore_errors=True)
    injected, lost = sum(t.injected for t in tallies), sum(len(t.lost) for t in tallies)
    print(f"{injected} faults injected, {lost} losses")
    sys.exit(1 if lost else 0)


if __name__ == "__main__":
    main()
