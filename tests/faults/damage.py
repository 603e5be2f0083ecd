"""Files that are not what was written: truncated, or with a bit flipped."""

import random
import shutil
from pathlib import Path

from .bench import Arguments, Bench, Tally
from .commands import LONG, PLANE, complete, finish, start
from .results import collect, differences


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
