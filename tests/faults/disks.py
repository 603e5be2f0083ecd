"""Disks that are full or read-only, and files that may not grow."""

import resource
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .bench import Arguments, Bench, Tally
from .commands import complete
from .results import collect, entries


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
