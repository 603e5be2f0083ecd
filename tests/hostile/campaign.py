"""Hostile tries, and a table of what they came to, by class.

    python -m tests.hostile.campaign --tries 2000 --seed 1
    python -m tests.hostile.campaign --again values:1.17

A label, a class and a number, throws all dice of its try: it alone repeats it. Tries are made in
processes that stay warm; one that dies or hangs costs its try. Exit code 1 if any fell through.
"""

import argparse
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import Any

from tests.processes import started

SHARES = {  # of a campaign; the last three start processes of their own, which takes seconds each
    "arguments": 0.18, "values": 0.29, "texts": 0.1, "units": 0.14, "mesh_files": 0.08,
    "stores": 0.07, "restarts": 0.05, "signals": 0.03, "disks": 0.03, "surroundings": 0.03,
}  # fmt: skip
OUTCOMES = {0: "done", 1: "failed", 2: "refused"}
HUNG_S = 240  # of a machine that others use too
MEMORY = 8 * 2**30  # address space of a try, and of each process that it starts

Account = dict[str, Any]
Counts = Counter[tuple[str, str]]


def labels(tries: int, seed: int, only: Sequence[str] = ()) -> list[str]:
    """A campaign's tries, mixed; at least one of each class."""
    shares = {name: SHARES[name] for name in only or SHARES}
    share = tries / sum(shares.values())
    counts = {name: max(1, round(share * part)) for name, part in shares.items()}
    every = [f"{name}:{seed}.{n}" for name, count in counts.items() for n in range(count)]
    return random.Random(seed).sample(every, len(every))


def attempt(label: str, folder: Path) -> Account:
    """Make one try in a folder of its own."""
    from tests.hostile import inside, outside

    own, kind = folder / label.replace(":", "-"), label.split(":")[0]
    own.mkdir()
    try:
        make = getattr(inside, kind, None) or getattr(outside, kind)
        return asdict(make(random.Random(label), own))
    finally:
        shutil.rmtree(own, ignore_errors=True)


def serve(folder: Path) -> None:
    """In a process of the campaign: a label a line in, the account of its try a line out."""
    answers = os.fdopen(os.dup(1), "w")
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    for line in sys.stdin:
        signal.alarm(HUNG_S)  # ends the process, whatever it does
        print(json.dumps(attempt(line.strip(), folder)), file=answers, flush=True)


def answered(labels: Sequence[str], folder: Path) -> Iterator[tuple[str, Account]]:
    """Tries made by one process after another: one that ends costs its try."""
    one, pipe = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"), subprocess.PIPE
    process: subprocess.Popen[str] | None = None
    for label in labels:
        if process is None:
            process = started(
                *("-m", "tests.hostile.campaign", "--serve", folder),
                env=one, stdin=pipe, stdout=pipe,
            )  # fmt: skip
        assert process.stdin is not None
        assert process.stdout is not None
        print(label, file=process.stdin, flush=True)
        line = process.stdout.readline()
        if not line:
            process.communicate()
            why = f"its process ended with {process.returncode}"
            line, process = json.dumps({"what": "", "code": None, "fell": [why], "error": ""}), None
        yield label, json.loads(line)
    if process is not None:
        process.communicate()


def table(counts: Counts) -> str:
    """Classes by outcomes, as Markdown."""
    columns = ("tried", "refused", "done", "failed", "fell through")
    rows = [("class", *columns), ("---",) * (len(columns) + 1)]
    names = [*(name for name in SHARES if counts[name, "tried"]), "all"]
    rows += [(name, *(str(counts[name, what]) for what in columns)) for name in names]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def campaign(every: Sequence[str], jobs: int, out: Path) -> Counts:
    """Make tries: what fell through is printed as it comes; accounts and table are kept."""
    counts: Counts = Counter()
    made = SimpleQueue[tuple[str, Account]]()
    folder = Path(tempfile.mkdtemp(prefix="hostile-"))
    out.mkdir(parents=True, exist_ok=True)

    def work(first: int) -> None:
        for answer in answered(every[first::jobs], folder):
            made.put(answer)

    threads = [Thread(target=work, args=(first,), daemon=True) for first in range(jobs)]
    try:
        for thread in threads:
            thread.start()
        with (out / "tries.jsonl").open("a") as file:
            for _ in every:
                label, account = made.get()
                outcome = OUTCOMES.get(account["code"], "failed")
                for name in (label.split(":")[0], "all"):
                    counts.update([(name, "tried"), (name, outcome)])
                    counts[name, "fell through"] += bool(account["fell"])
                print(json.dumps({"label": label} | account), file=file, flush=True)
                if account["fell"]:
                    print(f"{label} FELL {account['fell']} {account['what']!r:.300}", flush=True)
        for thread in threads:
            thread.join()
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    (out / "table.md").write_text(table(counts) + "\n")
    return counts


def main() -> None:
    """Read the command line, make the tries, and sum up."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--tries", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="*", default=[], choices=list(SHARES), help="classes")
    parser.add_argument("--again", nargs="*", help="labels of tries to make instead")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--out", type=Path, default=Path("out") / "hostile")
    parser.add_argument("--serve", type=Path, help=argparse.SUPPRESS)
    given, began = parser.parse_args(), time.monotonic()
    if given.serve:
        serve(given.serve)
        return
    every = given.again or labels(given.tries, given.seed, given.only)
    counts = campaign(every, given.jobs, given.out)
    print(f"{table(counts)}\n{time.monotonic() - began:.0f} s; accounts in {given.out}")
    sys.exit(bool(counts["all", "fell through"]))


if __name__ == "__main__":
    main()
