"""Faults from outside: signals, SIGKILL, a second process on the same folder."""

import os
import shutil
import signal
import subprocess

from .bench import Arguments, Bench, Tally
from .commands import finish, orphans, start
from .results import cells, entries

HOWS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL)


def signals(bench: Bench, arguments: Arguments, count: int, reach: float, each: bool) -> Tally:
    """Signals and SIGKILL at random moments.

    Parameters
    ----------
    reach : signals come at any moment up to this share of an undisturbed run's time.
    each : whether the command completes after every fault; else faults follow one another in one
        folder, and the command goes on from where the last one left it.
    """
    tally = Tally(f"signals, SIGKILL: {' '.join(arguments[:4])}")
    bench.undisturbed(arguments)
    longest_s = reach * bench.seconds[arguments]
    out = bench.fresh()
    had: dict[str, tuple[int, int]] = {}
    for number in range(count):
        how = bench.dice.choice(HOWS)
        after = f"{how.name} {number + 1}"
        process = start(arguments, out)
        try:
            process.wait(bench.dice.uniform(0.0, longest_s))
        except subprocess.TimeoutExpired:
            if how is signal.SIGKILL:
                process.kill()
            else:
                os.killpg(process.pid, how)
        ended = finish(process)
        tally.injected += 1
        tally.check(ended.seconds < 30.0, f"{after}: took {ended.seconds:.0f} s to end")
        tally.check(not orphans(process.pid), f"{after}: processes live on")
        if "Traceback" in ended.error:  # Python itself was starting
            tally.notes.append(f"{after}: a trace: {ended.lines[-1][:80]}")
        elif how is not signal.SIGKILL:
            # before the command answers signals they end it as they end any process
            said = ended.code in (0, 1, -how) and len(ended.lines) <= 2
            tally.check(said, f"{after}: exit code {ended.code}: {ended.error[-300:]}")
            half = [path.name for path in out.rglob(".*")] if each else []
            tally.check(not half, f"{after}: left behind {half[:3]}")
        now = entries(out)
        again = [name for name, this in had.items() if now.get(name) != this]
        tally.check(not again, f"{after}: {len(again)} stored results lost or made again")
        had = now
        if each:
            bench.completes(tally, arguments, out, after)
            shutil.rmtree(out)
            out, had = bench.fresh(), {}
    if not each:
        bench.completes(tally, arguments, out, f"after {count} signals")
        now = entries(out)
        again = [name for name, this in had.items() if now.get(name) != this]
        tally.check(not again, f"{len(again)} stored results lost or made again")
        run = cells(out)
        tally.check(len(run) == len(set(run)), f"{len(run) - len(set(run))} cells run again")
    return tally


def two_processes(bench: Bench, arguments: Arguments, count: int) -> Tally:
    """Two of the same command on one folder at once; every other time one of them is killed."""
    tally = Tally(f"two processes: {' '.join(arguments[:4])}")
    bench.undisturbed(arguments)
    for number in range(count):
        out = bench.fresh()
        one, two = start(arguments, out), start(arguments, out)
        if number % 2:
            try:
                two.wait(bench.dice.uniform(0.0, bench.seconds[arguments]))
            except subprocess.TimeoutExpired:
                two.kill()
        ended = finish(one)
        finish(two)
        tally.injected += 1
        tally.check(ended.code == 0, f"exit code {ended.code}: {ended.error[-300:]}")
        last = bench.completes(tally, arguments, out, "both ended")
        tally.check("computed again" not in ended.error + last.error, last.error)
        shutil.rmtree(out)
    return tally
