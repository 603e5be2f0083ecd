"""Tries in a process that is warm: arguments, scene files, units, meshes, stores, restart files."""

import json
import math
import os
import random
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

import meshes
from reference_fem.dynamics import restart
from tests.faults.damage import damage
from tests.faults.results import collect, differences
from tests.hostile.laws import Run, broken, printed
from tests.hostile.oracle import Tried, call
from tests.hostile.scenes import COARSE, RESULTS, SHORT, finger, hostile, in_units, put, times
from tests.hostile.stores import any_forgery, seal
from validation.models import adapter
from validation.models.adapter import Checkpoint
from validation.scenes.load import load_scene

MODELS = ("hcm", "hcm", "hcm", "hcm", "fem2d", "fem3d")
HCM = ("run", "soft", "--model", "hcm")
SETS = ("surface.height=0.06", *(f"solver.fem.{name}={size}" for name, size in COARSE.items()))
PLANE = ("run", "soft", "--model", "fem2d", *(f"--set={text}" for text in SETS))
LIGHT = (HCM, HCM, HCM, ("new", "new.toml"), ("new", "new.toml", "--like", "hard"), ("schema",))
HEAVY = (  # refused before they begin: a sure mistake is among their arguments
    ("compare", "soft", "--model", "hcm"), ("render", "soft"), ("validate",), ("paper",),
    ("validate", "--models", "nope"), ("validate", "--tolerance", "peak=x"),
    ("validate", "nowhere.toml"), ("validate", "--reference", "hcm,fem3d"),
    ("converge", "soft"), ("bench",), ("stress",), ("identify", "contact", "soft"),
    ("identify", "torque"),
)  # fmt: skip
SURE = ("--zzz", "--zzz=1", "more\x1b", "--\udcff", "--jsonn", "-q", "-\0", "--out=/dev/null/x")
WORDS = (
    *SURE, "", " ", "-", "--", "---", "--set", "--set=", "=", "a=b", "a.b", "\x1b[31m", "a\0b", "🖐",
    "\u202e", "../../x", "x" * 5000, "-1", "nan", "--out", "--out=", "--out=/proc", "--model=",
    "--model", "hcm", "fem3d", "{}", "'", '"', "\n", "\r", "%s", "{0}", "$(id)", "--json=1",
    "--json", "--no-json", "--help", "--version", "-h", "@x", "run", "soft", "hard", "--resume",
    "--fresh", "--set=surface.friction=", "--set==", "--set=surface.friction=0.7=0.8", "/dev/null",
    "/dev/zero", "/", ".", "--set=solver.hcm.max_steps=1e3", "--model=fem2d", "/dev/stdin",
)  # fmt: skip


def arguments(dice: random.Random, folder: Path) -> Tried:
    """Command lines that no one should write."""
    line = list(dice.choice([*LIGHT, *HEAVY]))
    if tuple(line) in LIGHT:
        line += dice.choice([[], ["--out", "out"], ["--json"]])
        for _ in range(dice.randint(1, 3)):
            place = dice.randint(0, max(len(line) - 1, 0))
            line[place : place + dice.randint(0, 1)] = dice.choice(
                [[dice.choice(WORDS)]] * 3 + [[]]
            )
    else:
        line.insert(dice.randint(1, len(line)), dice.choice(SURE))
    tried = Tried(" ".join(map(repr, line)))
    before = os.getcwd()
    os.chdir(folder)  # where a command writes without being told
    try:
        tried.judge(
            call(*line), folder, ["--", "scene", "ommand", "name", *filter(str.strip, line)]
        )
    finally:
        os.chdir(before)
    return tried


def run(
    tried: Tried, arguments: Sequence[str], out: Path, names: Sequence[str] = ()
) -> tuple[Run | None, str]:
    """Run and judge: the object that it printed if it is done, else what it said."""
    said = call(*arguments, "--json", "--out", str(out))
    if not tried.judge(said, out, names):
        return None, said.error
    sets = [text.removeprefix("--set=") for text in arguments if text.startswith("--set=")]
    scene = load_scene(arguments[1], sets)
    try:
        found = printed(said.out)
        path = out / "run" / f"{scene.name}-{found['model']}" / "history.nc"
        tried.fell += broken(found, scene.tables, path)
    except ValueError as error:
        tried.fell.append(f"prints no JSON: {error}")
        return None, said.error
    return found, said.error


def values(dice: random.Random, folder: Path) -> Tried:
    """Scenes with values that they should not have, in a file or by ``--set``."""
    document, model, path = finger(dice), dice.choice(MODELS), folder / "scene.toml"
    changes = dict(hostile(dice, document) for _ in range(dice.choice([1, 1, 1, 2, 3])))
    tried = Tried(f"{model} {changes!r:.300} of {document!r:.900}")
    sets = [text for text in SHORT if text.split("=")[0] not in changes]
    if dice.random() < 0.5:
        sets += [f"{key}={value}" for key, value in changes.items()]
    else:
        for key, value in changes.items():
            put(document, key, value)
    path.write_text(tomli_w.dumps(document), encoding="utf-8", errors="backslashreplace")
    given = ("run", str(path), "--model", model, *(f"--set={text}" for text in sets))
    run(tried, given, folder / "out", [".", "--set"])
    return tried


def texts(dice: random.Random, folder: Path) -> Tried:
    """Scene files that are not what an editor saved."""
    text, path = tomli_w.dumps(finger(dice)), folder / "scene.toml"
    lines, many = text.splitlines(), 10 ** dice.randint(1, 5)
    some = dice.randrange(len(lines))
    several = {
        "UTF-16": text.encode("utf-16"), "a byte order mark": text.encode("utf-8-sig"),
        "CR": text.replace("\n", "\r").encode(), "CR LF": text.replace("\n", "\r\n").encode(),
        "a line twice": "\n".join([*lines[:some], *lines[max(0, some - 1) :]]).encode(),
        "a line less": "\n".join([*lines[:some], *lines[some + 1 :]]).encode(), "empty": b"",
        "shuffled": "\n".join(dice.sample(lines, len(lines))).encode(), "latin": b"# \xe9\n",
        "deep": b"a = " + b"[" * many, "long": text.encode() + b"#" * 2_000_000,
        "digits": f"{text}\n[tip]\na = {'9' * many}".encode(),
    }  # fmt: skip
    what = dice.choice(["damaged"] * len(several) + list(several))
    path.write_bytes(several.get(what, text.encode()))
    tried = Tried(damage(path, dice) if what == "damaged" else what)
    given = ("run", str(path), "--model", dice.choice(MODELS), *(f"--set={s}" for s in SHORT))
    run(tried, given, folder / "out", ["scene"])
    return tried


def units(dice: random.Random, folder: Path) -> Tried:
    """One scene in two systems of units.

    With steps and tolerances in the other units as well, all numbers agree but for the last digits.
    With the defaults' they agree within the errors that both runs state.
    """
    first, model, steps = finger(dice), dice.choice(MODELS), dice.random() < 0.6
    scale = 2.0 ** dice.randint(-4, 4)
    # the same density: a scene's bounds are in SI units
    unit = (
        (scale, 2.0 ** dice.randint(-1, 1), scale**3) if steps else (scale**0.25, 1.0, scale**0.75)
    )
    tried = Tried(f"{model} in units {unit}{' with steps' if steps else ''} {first!r:.1500}")
    runs = []
    for name, its in (("one", (1.0, 1.0, 1.0)), ("two", unit)):
        path = folder / f"{name}.toml"
        path.write_text(tomli_w.dumps(in_units(first, its, steps)))
        given = ("run", str(path), "--model", model, *(f"--set={text}" for text in SHORT))
        runs.append((*run(tried, given, folder / "out"), tried.code))
    (one, said, code), (two, said_of_two, code_of_two) = runs
    warned = "estimated errors beyond" in said + said_of_two  # and the other is not completed
    if code != code_of_two and (steps or not warned):
        tried.fell.append(f"one: {code} {said[-300:]}, two: {code_of_two} {said_of_two[-300:]}")
    if one is None or two is None:
        return tried

    def bar(key: str, powers: tuple[int, int, int]) -> float:
        """Both stated errors in the second's units; infinite where one has no bound."""
        errors = [result["error_estimates"].get(key, 0.0) for result in (one, two)]
        if any(None in (error if isinstance(error, list) else [error]) for error in errors):
            return math.inf
        return largest(times(errors[0], unit, powers)) + largest(errors[1])

    speed = "tip_velocity_at_contact_m_per_s"
    # a flight whose touch is this uncertain multiplies tolerances, which are relative to a step
    exact = steps and bar(speed, RESULTS[speed]) < 1e-3 * largest(two[speed])
    for key, powers in RESULTS.items():
        expected, found = times(one[key], unit, powers), two[key]
        allowed = 2 * bar(key, powers) + 1e-3 * largest(found)
        if largest(np.subtract(expected, found)) > (1e-6 * largest(found) if exact else allowed):
            tried.fell.append(f"{key} {expected} and {found}, may differ by {allowed}")
    return tried


def largest(value: Any) -> float:
    """Largest magnitude of a number or of a vector's components."""
    return float(np.max(np.abs(value)))


def base(folder: Path, name: str, make: Callable[[Path], Any]) -> Path:
    """What several tries of a process start from; made once."""
    path = folder.parent / f"base-{name}-{os.getpid()}"
    if not path.exists():
        path.mkdir()
        make(path)
    return path


def forged(dice: random.Random, mesh: meshes.FingerMesh) -> tuple[str, meshes.FingerMesh]:
    """A mesh with something wrong; or harmless: only numbered in another way."""
    points, cells = mesh.points.copy(), mesh.cells.copy()
    groups = [dict(mesh.node_sets), dict(mesh.facet_sets), dict(mesh.cell_sets)]
    what, some = dice.choice(["points", "a set", "a set", "elements", "numbered"]), len(points) - 1
    if what == "points":
        axis, phalanx = dice.randrange(mesh.dim), cells[dice.choice(list(mesh.cell_sets.values()))]
        which = dice.choice([slice(None), slice(None), dice.randint(0, some), np.unique(phalanx)])
        factor = dice.choice([1, 1, 1e-3, 0.5, 0.9, 0.99, 1.02, 1.1, 2, 1e3, float("nan")])
        far = 0.0 if factor != 1 else dice.choice([1e-4, -1e-4, 2e-3, 0.05, -0.05, 1.0])
        what = f"points {which!r:.40} times {factor} plus {far} on {axis}"
        points[which, axis] = factor * points[which, axis] + far
    elif what == "a set":
        group = dice.choice(groups)
        name, other = (dice.choice(list(group)) for _ in range(2))
        every = np.concatenate(list(group.values()))
        several = {
            "empty": every[:0], "its first": group[name][:1], "half": group[name][::2],
            "all": np.unique(every, axis=0), other: group[other], "left out": None,
        }  # fmt: skip
        choice = dice.choice(list(several))
        what = f"set {name}: {choice}"
        group[name] = several[choice]
        if several[choice] is None:
            del group[name]
    elif what == "elements":
        place, twin = dice.randrange(len(cells)), dice.randrange(len(cells))
        torn = np.arange(some + 1, some + 1 + cells.shape[1])
        what, new = dice.choice(
            [("torn", torn), ("doubled", cells[twin]), ("odd", cells[place] + 1)]
        )
        what, cells[place] = f"element {what}", new
        points = (
            np.vstack([points, points[mesh.cells[place]]]) if what == "element torn" else points
        )
    else:
        order = np.array(dice.sample(range(len(points)), len(points)))
        new = np.argsort(order)
        points, cells = points[order], new[cells]
        groups[:2] = [{name: new[m] for name, m in group.items()} for group in groups[:2]]
    return what, meshes.FingerMesh(points, cells, *groups)


def mesh_files(dice: random.Random, folder: Path) -> Tried:
    """Mesh files that are not the scene's finger: refused, or no other answer than the finger's.

    What the same file gave before it was changed is stored, and is not read back.
    """
    dim, path = dice.choice([2, 3]), folder / dice.choice(["m.vtu", "m.msh"])
    geometry, sizing = meshes.FingerGeometry((0.04,) * 3, (0.015,) * 3), meshes.Sizing(**COARSE)
    make = meshes.finger_quadrilaterals if dim == 2 else meshes.finger_hexahedra
    given = ("run", "soft", "--model", f"fem{dim}d", f"--set={SETS[0]}", f"--set={SHORT[1]}")
    given += (f"--set=solver.fem.mesh={path}",)
    meshes.write(make(geometry, sizing), path)
    before, (expected, said) = path.read_bytes(), run(Tried(""), given, folder / "out")
    if dice.random() < 0.3:
        what = damage(path, dice)
    else:
        what, mesh = forged(dice, meshes.read(path))
        meshes.write(mesh, path)
    tried = Tried(f"{dim}D {what}")
    found, said_of_it = run(tried, given, folder / "out", ["mesh"])
    if expected is None or (found is None and what == "numbered"):
        tried.fell.append(f"refused, though it is the finger: {said}")
    elif found is not None:
        # the stable step is iterated to, from a start that numbering changes
        allowed = 1e-4 if what == "numbered" else 0.03
        tried.fell += [
            f"passes as the finger: {key} {found[key]} for {expected[key]}"
            for key in ("contact_time_s", "peak_normal_force_N", "normal_impulse_N_s")
            if abs(found[key] / expected[key] - 1) > allowed
        ]
        if "has this run" in said_of_it and path.read_bytes() != before:
            tried.fell.append("another mesh's stored run")
    return tried


def stores(dice: random.Random, folder: Path) -> Tried:
    """Stored results that are damaged, or forged under right digests."""
    given, out = dice.choice([HCM, PLANE]), folder / "out"
    good = base(folder, given[3], lambda to: call(*given, "--out", str(to)))
    shutil.copytree(good / "store", out / "store")
    (entry,) = (out / "store").iterdir()
    honest = dice.random() < 0.4
    if honest:
        what = damage(dice.choice([p for p in sorted(entry.rglob("*")) if p.is_file()]), dice)
    else:
        what, forge = any_forgery(dice, entry)
        forge(entry)
        seal(entry)
    tried = Tried(f"{given[3]}: {what:.100}")
    said = call(*given, "--json", "--out", str(out))
    if not tried.judge(said, out):
        tried.fell.append("a stored result ends the command")
    again = "computed again" in said.error
    if not again and "has this run" not in said.error:
        tried.fell.append("says nothing of what is stored")
    if (honest or again) and differences(collect(out), collect(good)):
        tried.fell.append("other results than the run's")
    return tried


def restarts(dice: random.Random, folder: Path) -> Tried:
    """Restart files that are damaged, or forged under a right checksum; run folders likewise."""

    def leave(to: Path) -> None:
        adapter("fem2d").run(load_scene("soft", SETS), None, Checkpoint(to / "restart.npz"))
        call(*PLANE, "--out", str(to))

    good, out, sure = base(folder, "restart", leave), folder / "out", dice.random()
    own = out / "run" / "soft-fem2d"
    shutil.copytree(good / "run" / "soft-fem2d", own)
    path, summary = own / "restart.npz", own / "summary.json"
    if sure < 0.2:
        table = json.loads(summary.read_text())
        name = dice.choice(["contact_time_s", "peak_normal_force_time_s", "provenance"])
        table[name] = dice.choice(["x", "\x1b[31m", "\ud800", [], {}, [[1]], 10**400])
        summary.write_text(json.dumps(table))
        tried = Tried(f"run folder with {name} = {table[name]!r:.50}")
        if tried.judge(call("render", str(own), "--out", str(out)), out, [str(own)]):
            tried.fell.append("was drawn")
        return tried
    shutil.copyfile(good / "restart.npz", path)
    tried = Tried(damage(path, dice) if sure < 0.5 else other_arrays(dice, path))
    done = tried.judge(call(*PLANE, "--resume", "--out", str(out)), out, [str(path)])
    if done and sure < 0.5 and differences(collect(out), collect(good)):
        tried.fell.append("other results than the run's")
    return tried


def other_arrays(dice: random.Random, path: Path) -> str:
    """Put another array in the place of one, under a right checksum."""
    with np.load(path, allow_pickle=False) as file:
        content = dict(file)
    outside = {name: content.pop(name) for name in (restart.IDENTITY, restart.CHECKSUM)}
    name = dice.choice(sorted(content))
    array = content[name]
    kind = dice.choice(["f8", "i8", "U3", "?", "c16", array.dtype, array.dtype])
    shape = dice.choice([(), (0,), (3,), (2, 2), array.shape, array.shape, array.T.shape])
    value = dice.choice([0, -1, 1, 7, 2**31, 1e300, float("nan"), float("inf")])
    with np.errstate(all="ignore"):
        content[name] = np.full(shape, value, "f8").astype(kind)
    outside[restart.CHECKSUM] = np.array(restart.digest(content))
    with path.open("wb") as file:
        np.savez(file, **content, **outside)
    return f"{name} as {value} {kind} {shape}"
