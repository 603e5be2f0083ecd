"""Kinds of faults. Each injects some and reports what was lost, one sentence for each loss."""

import os
import random
import resource
import shutil
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from .commands import (
    LONG,
    PLANE,
    Ended,
    complete,
    finish,
    orphans,
    start,
)  # fmt: skip
from .results import cells, collect, differences, entries

Arguments = tuple[str, ...]


@dataclass
class Tally:
    """Faults of one kind, and what they cost."""

    kind: str
    injected: int = 0
    lost: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def check(self, good: bool, what: str) -> None:
        if not good:
            self.lost.append(what)


@dataclass
class Bench:
    """Where the campaign works: a folder, its dice, and undisturbed results by command."""

    folder: Path
    dice: random.Random
    whole: dict[Arguments, dict[str, str]] = field(default_factory=dict)
    seconds: dict[Arguments, float] = field(default_factory=dict)
    number: int = 0

    def fresh(self) -> Path:
        """A folder that was not there before."""
        self.number += 1
        path = self.folder / f"{self.number:04d}"
        path.mkdir(parents=True)
        return path

    def undisturbed(self, arguments: Arguments) -> dict[str, str]:
        """Results of a command that nothing disturbs."""
        if arguments not in self.whole:
            out = self.fresh()
            ended = complete(arguments, out)
            assert ended.code == 0, ended.error
            self.whole[arguments], self.seconds[arguments] = collect(out), ended.seconds
            self.kept = out
        return self.whole[arguments]

    def completes(self, tally: Tally, arguments: Arguments, out: Path, after: str) -> Ended:
        """The same command completes, with the results of an undisturbed one."""
        ended = complete(arguments, out)
        tally.check(ended.code == 0, f"{after}: exit code {ended.code}: {ended.error[-300:]}")
        others = differences(collect(out), self.undisturbed(arguments))
        tally.check(not others, f"{after}: other results in {others[:3]}")
        return ended


def signals(bench: Bench, arguments: Arguments, count: int, reach: float, each: bool) -> Tally:
    """Ctrl-C and SIGKILL at random moments.

    Parameters
    ----------
    reach : signals come at any moment up to this share of an undisturbed run's time.
    each : whether the command completes after every fault; else faults follow one another in one
        folder, and the command goes on from where the last one left it.
    """
    tally = Tally(f"SIGINT, SIGKILL: {' '.join(arguments[:4])}")
    bench.undisturbed(arguments)
    longest_s = reach * bench.seconds[arguments]
    out = bench.fresh()
    had: dict[str, tuple[int, int]] = {}
    for number in range(count):
        how = bench.dice.choice((signal.SIGINT, signal.SIGKILL))
        after = f"{how.name} {number + 1}"
        process = start(arguments, out)
        try:
            process.wait(bench.dice.uniform(0.0, longest_s))
        except subprocess.TimeoutExpired:
            if how is signal.SIGINT:
                os.killpg(process.pid, how)
            else:
                process.kill()
        ended = finish(process)
        tally.injected += 1
        tally.check(ended.seconds < 30.0, f"{after}: took {ended.seconds:.0f} s to end")
        tally.check(not orphans(process.pid), f"{after}: processes live on")
        if how is signal.SIGINT and "Traceback" in ended.error:
            tally.notes.append(f"{after}: a trace: {ended.lines[-1][:80]}")
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


def damage(path: Path, dice: random.Random) -> str:
    """Truncate a file, or flip one of its bits."""
    content = path.read_bytes()
    if dice.random() < 0.5:
        size = dice.randrange(len(content))
        path.write_bytes(content[:size])
        return f"{path.name} cut to {size} of {len(content)} bytes"
    place = dice.randrange(8 * len(content))
    flipped = bytearray(content)
    flipped[place // 8] ^= 1 << (place % 8)
    path.write_bytes(flipped)
    return f"{path.name} with bit {place} flipped"


def damaged_store(bench: Bench, arguments: Arguments, count: int) -> Tally:
    """Truncated and altered stored results: said in one line, and made again."""
    tally = Tally(f"stored result damaged: {' '.join(arguments[:4])}")
    bench.undisturbed(arguments)
    out = bench.fresh()
    complete(arguments, out)
    for _ in range(count):
        (entry,) = (path for path in (out / "store").iterdir())
        files = [path for path in sorted(entry.rglob("*")) if path.is_file()]
        what = damage(bench.dice.choice(files), bench.dice)
        tally.injected += 1
        ended = bench.completes(tally, arguments, out, what)
        said = "computed again" in ended.error
        # a bit in the space between JSON's words changes nothing, and the result stands
        harmless = what.startswith("manifest") and "has this run" in ended.error
        tally.check(said or harmless, f"{what}: not noticed")
        tally.check(len(ended.lines) <= 2, f"{what}: {ended.error}")
    return tally


def damaged_restart(bench: Bench, count: int) -> Tally:
    """Truncated and altered restart files: refused in one line; without it the run completes."""
    tally = Tally("restart file damaged")
    bench.undisturbed(LONG)
    for _ in range(count):
        out = bench.fresh()
        process = start(LONG, out)
        path = out / "run" / "soft-fem2d" / "restart.npz"
        while not path.exists() and process.poll() is None:
            pass
        process.kill()
        finish(process)
        what = damage(path, bench.dice)
        tally.injected += 1
        refused = complete(LONG, out)
        # what numpy's archive does not read (a bit of a time stamp) changes nothing
        if refused.code == 0:
            others = differences(collect(out), bench.undisturbed(LONG))
            tally.check(not others, f"{what}: other results in {others[:3]}")
            tally.notes.append(f"{what}: changes nothing")
        else:
            one = refused.code == 2 and len(refused.lines) == 1 and str(path) in refused.error
            tally.check(one, f"{what}: exit code {refused.code}: {refused.error[-300:]}")
            path.unlink()
            bench.completes(tally, LONG, out, what)
        shutil.rmtree(out)
    return tally


def damaged_mesh(bench: Bench, count: int) -> Tally:
    """Truncated and altered mesh files: refused, or another run; never the stored one."""
    import meshes

    tally = Tally("mesh file damaged")
    path = bench.fresh() / "finger.vtu"
    geometry = meshes.FingerGeometry((0.04,) * 3, (0.015,) * 3)
    meshes.write(meshes.finger_quadrilaterals(geometry, meshes.SIZINGS["fast"]), path)
    arguments = (*PLANE, "--set", f"solver.fem.mesh={path}")
    good = path.read_bytes()
    bench.undisturbed(arguments)
    out = bench.fresh()
    complete(arguments, out)
    for _ in range(count):
        what = damage(path, bench.dice)
        tally.injected += 1
        ended = complete(arguments, out)
        tally.check(ended.code in (0, 1, 2) and len(ended.lines) <= 1, f"{what}: {ended.error}")
        tally.check("has this run" not in ended.error, f"{what}: read back for another mesh")
        if ended.code == 0:
            tally.notes.append(f"{what}: still a finger, and run as one")
        path.write_bytes(good)
        ended = bench.completes(tally, arguments, out, what)
        tally.check("has this run" in ended.error, f"{what}: the good mesh was run again")
    return tally


@contextmanager
def small_disk(folder: Path, size: str) -> Iterator[Path]:
    """A file system of its own (needs root)."""
    folder.mkdir(parents=True, exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)], check=True)
    try:
        yield folder
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)


def full_disk(bench: Bench, arguments: Arguments, sizes_k: tuple[int, ...]) -> Tally:
    """A disk that is full after so many kB; then it is made larger, and the command completes."""
    tally = Tally(f"disk full: {' '.join(arguments[:4])}")
    bench.undisturbed(arguments)
    for size in sizes_k:
        with small_disk(bench.fresh(), f"{size}k") as disk:
            ended = complete(arguments, disk / "out")
            tally.injected += 1
            plain = ended.code in (0, 1, 2) and "Traceback" not in ended.error
            tally.check(plain, f"{size} kB: exit code {ended.code}: {ended.error[-300:]}")
            had = entries(disk / "out")
            subprocess.run(["mount", "-o", "remount,size=1g", str(disk)], check=True)
            bench.completes(tally, arguments, disk / "out", f"{size} kB")
            now = entries(disk / "out")
            tally.check(all(now.get(n) == e for n, e in had.items()), f"{size} kB: made again")
    return tally


def file_limit(bench: Bench, arguments: Arguments, count: int) -> Tally:
    """No file may grow beyond a random size: every write can fail half way."""
    tally = Tally(f"file size limit: {' '.join(arguments[:4])}")
    bench.undisturbed(arguments)
    for _ in range(count):
        out = bench.fresh()
        size = round(10 ** bench.dice.uniform(1.0, 5.5))

        def limit(size: int = size) -> None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

        ended = complete(arguments, out, preexec_fn=limit)
        tally.injected += 1
        plain = ended.code in (0, 1, 2) and "Traceback" not in ended.error
        tally.check(plain, f"{size} B: exit code {ended.code}: {ended.error[-300:]}")
        bench.completes(tally, arguments, out, f"{size} B")
        shutil.rmtree(out)
    return tally


def read_only(bench: Bench, several: tuple[Arguments, ...]) -> Tally:
    """An output folder that may not be written: refused in one line, and nothing is touched."""
    tally = Tally("read-only output")
    for arguments in several:
        bench.undisturbed(arguments)
        with small_disk(bench.fresh(), "1g") as disk:
            for filled in (False, True):
                if filled:
                    complete(arguments, disk)
                before = collect(disk)
                subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
                ended = complete(arguments, disk)
                tally.injected += 1
                one = ended.code == 2 and len(ended.lines) == 1
                tally.check(one, f"exit code {ended.code}: {ended.error[-300:]}")
                tally.check(collect(disk) == before, "something was changed")
                subprocess.run(["mount", "-o", "remount,rw", str(disk)], check=True)
            bench.completes(tally, arguments, disk, "writable again")
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


Kind = Callable[[Bench], Tally]
