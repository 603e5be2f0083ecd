"""Tries on a process of its own: signals, small disks, and what a shell gives a command."""

import os
import random
import resource
import subprocess
import sys
from pathlib import Path

from tests.faults import disks as full
from tests.faults.bench import Bench, Tally
from tests.faults.commands import RUN
from tests.faults.signals import signals as injected
from tests.hostile.inside import PLANE
from tests.hostile.oracle import CODES, Said, Tried
from tests.processes import COMMAND, ROOT

LONG = (*PLANE, "--set=solver.fem.flight=explicit", "--resume")
VARIABLES = {
    "NUMBA_NUM_THREADS": ["", "0", "x", "1e3", "9999", "-3", " 2", "2"],
    "OMP_NUM_THREADS": ["", "0", "x", "-3", "9999"], "OPENBLAS_NUM_THREADS": ["0", "x", "9999"],
    "NUMBA_DISABLE_JIT": ["1", "0", "x", ""], "PYTHONOPTIMIZE": ["2"], "PYTHONHASHSEED": ["0"],
    "LC_ALL": ["C", "C.UTF-8"], "PYTHONIOENCODING": ["ascii", "latin-1"],
    "PYTHONUTF8": ["0", "1"], "COLUMNS": ["0", "-1", "x", "1"], "TERM": ["dumb", "", "xterm"],
    "HOME": ["/nonexistent", ""], "TMPDIR": ["/nonexistent", "/proc"], "MPLBACKEND": ["nope"],
    "MPLCONFIGDIR": ["/nonexistent"], "DISPLAY": [":99"], "FORCE_COLOR": ["1"], "NO_COLOR": ["1"],
    "PYTHONWARNINGS": ["ignore", "default"], "TTY_COMPATIBLE": ["1"], "TZ": ["x"],
    "PYTHONDONTWRITEBYTECODE": ["1"], "XDG_CACHE_HOME": ["/nonexistent"], "LINES": ["x"],
}  # fmt: skip
STREAMS = ("<&-", ">&-", "2>&-", "<&- >&- 2>&-", ">/dev/full", "| :")


def account(tally: Tally) -> Tried:
    """A fault's tally as a try's."""
    return Tried(f"{tally.kind} {tally.notes}", 0, tally.lost)


def signals(dice: random.Random, folder: Path) -> Tried:
    """A signal at any moment; the same command completes."""
    return account(
        injected(Bench(folder, dice), dice.choice([RUN, PLANE, LONG]), 1, 1.1, each=True)
    )


def disks(dice: random.Random, folder: Path) -> Tried:
    """A disk that fills up, files that may not grow; with room the command completes."""
    given, work = dice.choice([RUN, PLANE, LONG]), Bench(folder, dice)
    if os.geteuid() == 0 and dice.random() < 0.5:
        return account(full.full_disk(work, given, (round(10 ** dice.uniform(0.6, 3.3)),)))
    return account(full.file_limit(work, given, 1))


def surroundings(dice: random.Random, folder: Path) -> Tried:
    """Environment variables, limits, closed streams, masks, a current folder that is gone."""
    given = dice.choice([RUN, RUN, PLANE, ("run", "sofd", "--model", "hcm"), ("render", "nowhere")])
    changed = {name: dice.choice(VARIABLES[name]) for name in dice.sample(list(VARIABLES), 2)}
    number, size = dice.choice([
        (resource.RLIMIT_AS, round(2 ** dice.uniform(27, 32.5))),
        (resource.RLIMIT_NOFILE, dice.randint(8, 64)), *[(resource.RLIMIT_CORE, 0)] * 4,
    ])  # fmt: skip
    streams = dice.choice([*STREAMS, *[""] * 12])
    gone, mask = dice.choice(["", "", "", "; rmdir ."]), dice.choice([0o022, 0o077, 0o777, 0])
    there, out = folder / "there", folder / "out"
    for path in (there, out):
        path.mkdir()
    line = f'cd "$1"{gone.replace(".", str(there))}; shift; umask {mask:o}; "$@" {streams}'
    done = subprocess.run(
        ["/bin/bash", "-o", "pipefail", "-c", line, "sh", there, sys.executable, "-c", COMMAND,
         *given, "--out", out],
        capture_output=True, text=True, errors="backslashreplace", check=False,
        env=os.environ | {"PYTHONPATH": str(ROOT), "NUMBA_NUM_THREADS": "1"} | changed,
        preexec_fn=lambda: resource.setrlimit(number, (size, size)),
    )  # fmt: skip
    what = f"{changed} limit {number} {size} {streams}{gone} {mask:o} {given[:4]}"
    tried = Tried(what)
    said = Said(done.returncode, done.stdout, done.stderr)
    if "2>&-" in streams and done.returncode in CODES:  # no word reaches anybody
        said = Said(0, done.stdout, done.stderr)
    tried.judge(said, folder)
    return tried
