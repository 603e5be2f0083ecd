import errno
import json
import math
import os
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.processes import started
from tests.validation.commands import Capture, Make
from validation.harness import store as store_module
from validation.harness.line_store import LineStore
from validation.harness.store import (
    MANIFEST,
    NO_STORE,
    TEMPORARY,
    VALUES,
    Store,
    key,
)
from validation.harness.stored_run import (
    FIELDS,
    HISTORY,
    RECORD,
    keep_run,
    load_run,
    restore_run,
    write_record,
)

INPUTS = {"a": 1}


def text(folder: Path) -> str:
    return (folder / "value.txt").read_text()


def writing(value: str) -> Callable[[Path], None]:
    return lambda folder: (folder / "value.txt").write_text(value) and None


def test_a_run_is_read_back_bit_for_bit(make_record: Make, tmp_path: Path) -> None:
    store, run = Store(tmp_path), make_record(statistics={"steps": 7, "mean": 0.1})
    odd = {**run.history, "mode": np.arange(2401, dtype=np.int8)}
    odd["normal_force_N"] = odd["normal_force_N"].copy()
    odd["normal_force_N"][:3] = (np.nan, -0.0, 5e-324)
    run = make_record(history=odd, statistics=run.statistics)
    assert load_run(store, INPUTS) is None
    keep_run(store, INPUTS, run)
    found = load_run(store, INPUTS)
    assert found.read_back
    assert found.measured == f"{run.provenance['created']}, read back"
    for name in ("scene", "model", "variant", "status", "ok", "message", "summary", "events",
                 "statistics", "provenance"):  # fmt: skip
        assert getattr(found, name) == getattr(run, name), name
    assert list(found.history) == list(odd)
    for name, array in odd.items():
        assert found.history[name].dtype == array.dtype
        assert found.history[name].tobytes() == array.tobytes()


@pytest.mark.parametrize("expected", [0.004, math.inf, None])
def test_what_a_run_expects_is_read_back(
    expected: float | None, make_record: Make, tmp_path: Path
) -> None:
    """Nothing is known of it, or nothing was estimated: these are two."""
    store = Store(tmp_path)
    held = {"wanted": 0.01, "expected": expected, "choices": []}
    keep_run(store, INPUTS, make_record(accuracy=held))
    assert load_run(store, INPUTS).accuracy == held


def test_a_run_with_more_than_a_thousand_fields_is_found_again(
    make_record: Make, tmp_path: Path
) -> None:
    """Their numbers then have four digits: the order of names is not that of numbers."""

    def write(entry: Path) -> None:
        write_record(entry, make_record())
        (entry / FIELDS).mkdir()
        for name in ("tap.pvd", *(f"tap_{number:03d}.vtu" for number in range(1001))):
            (entry / FIELDS / name).touch()

    store = Store(tmp_path / "store")
    store.keep(INPUTS, write)
    assert restore_run(store, INPUTS, tmp_path / "run", fields=False) is not None


def test_a_run_that_did_not_complete_is_not_stored(make_record: Make, tmp_path: Path) -> None:
    keep_run(Store(tmp_path), INPUTS, make_record(ok=False, status="INTERRUPTED"))
    assert list(tmp_path.iterdir()) == []


def test_a_result_is_computed_once_unless_fresh(tmp_path: Path) -> None:
    store = Store(tmp_path)
    assert store.load(INPUTS, text) is None
    assert store.keep(INPUTS, writing("one"))
    assert store.load(INPUTS, text) == "one"
    assert store.load({"a": 2}, text) is None
    again = Store(tmp_path, fresh=True)
    assert again.load(INPUTS, text) is None
    assert again.keep(INPUTS, writing("two"))
    assert store.load(INPUTS, text) == "two"
    assert len(list(tmp_path.iterdir())) == 1


def damage(entry: Path, how: str) -> None:
    value, manifest = entry / "value.txt", entry / MANIFEST
    match how:
        case "truncated":
            value.write_text("on")
        case "bit":
            value.write_bytes(bytes([value.read_bytes()[0] ^ 4]) + b"ne")
        case "missing":
            value.unlink()
        case "added":
            (entry / "more.txt").write_text("")
        case "link":
            value.unlink()
            value.symlink_to("/etc/hostname")
        case "no manifest":
            manifest.unlink()
        case "half a manifest":
            manifest.write_text(manifest.read_text()[:40])
        case "other inputs":
            manifest.write_text(manifest.read_text().replace('"a": 1', '"a": 2'))
        case "binary":
            manifest.write_bytes(b"\xff\xfe\x00")
        case "folder":
            value.unlink()
            value.mkdir()


@pytest.mark.parametrize(
    "how",
    ["truncated", "bit", "missing", "added", "link", "no manifest", "half a manifest",
     "other inputs", "binary", "folder"],
)  # fmt: skip
def test_a_damaged_result_is_said_and_made_again(how: str, tmp_path: Path, capsys: Capture) -> None:
    store = Store(tmp_path)
    store.keep(INPUTS, writing("one"))
    damage(tmp_path / key(INPUTS), how)
    assert store.load(INPUTS, text) is None
    line = capsys.readouterr().err
    assert line.count("\n") == 1
    assert "it is computed again" in line
    assert "Errno" not in line
    assert list(tmp_path.iterdir()) == []
    assert store.keep(INPUTS, writing("one"))
    assert store.load(INPUTS, text) == "one"


@pytest.mark.parametrize("error", [OSError(errno.EMFILE, "Too many open files"), MemoryError()])
def test_a_system_in_need_costs_no_entry(error: Exception, tmp_path: Path, capsys: Capture) -> None:
    store = Store(tmp_path)
    store.keep(INPUTS, writing("one"))

    def fails(folder: Path) -> str:
        raise error

    assert store.load(INPUTS, fails) is None
    assert "it is computed again" in capsys.readouterr().err
    assert store.load(INPUTS, text) == "one"


def test_every_bit_of_a_stored_run_is_watched(make_record: Make, tmp_path: Path) -> None:
    """A flipped bit anywhere is detected, or it is one that JSON does not read."""
    store, run = Store(tmp_path), make_record(history={"time_s": np.arange(3.0)})
    keep_run(store, INPUTS, run)
    entry = tmp_path / key(INPUTS)
    random = np.random.default_rng(1)
    for name in (RECORD, HISTORY, MANIFEST):
        content = (entry / name).read_bytes()
        for place in random.integers(8 * len(content), size=40):
            flipped = bytearray(content)
            flipped[place // 8] ^= 1 << (place % 8)
            (entry / name).write_bytes(flipped)
            found = load_run(store, INPUTS)
            if found is None:
                assert not entry.exists()
                keep_run(store, INPUTS, run)
            else:
                assert name == MANIFEST
                assert json.loads(flipped) == json.loads(content)
            (entry / name).write_bytes(content)


def test_stored_arrays_run_no_code(make_record: Make, tmp_path: Path) -> None:
    store = Store(tmp_path)
    keep_run(store, INPUTS, make_record())
    entry = tmp_path / key(INPUTS)
    np.savez(entry / HISTORY, time_s=np.array([{"any": "object"}], dtype=object))
    manifest = json.loads((entry / MANIFEST).read_text())
    manifest["files"] = store_module._digests(entry)  # as a stranger would
    (entry / MANIFEST).write_text(json.dumps(manifest))
    assert load_run(store, INPUTS) is None
    assert not entry.exists()


def test_a_store_that_cannot_be_written_is_no_failure(tmp_path: Path, capsys: Capture) -> None:
    (tmp_path / "store").write_text("a file in its place")
    assert not Store(tmp_path / "store").keep(INPUTS, writing("one"))
    assert "a result cannot be stored" in capsys.readouterr().err

    def full(folder: Path) -> None:
        (folder / "value.txt").write_text("half")
        raise OSError(28, "No space left on device")

    store = Store(tmp_path / "full")
    assert not store.keep(INPUTS, full)
    assert "No space left on device" in capsys.readouterr().err
    assert list(store.folder.iterdir()) == []


def test_what_kills_left_is_removed_when_it_is_old(tmp_path: Path) -> None:
    for name, age in (("old", 7200), ("new", 60)):
        folder = tmp_path / f"{TEMPORARY}{name}"
        folder.mkdir()
        then = folder.stat().st_mtime - age
        os.utime(folder, (then, then))
    Store(tmp_path).keep(INPUTS, writing("one"))
    assert {path.name for path in tmp_path.iterdir()} == {f"{TEMPORARY}new", key(INPUTS)}


WRITER = """
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from validation.harness.store import Store
folder, fresh = Path(sys.argv[1]), sys.argv[2] == "fresh"
store = Store(folder, fresh)
def write(entry):
    for name in "abc":
        (entry / name).write_text(name * 5000)
def read(entry):
    assert all((entry / name).read_text() == name * 5000 for name in "abc")
    return True
for turn in range(60):
    store.keep({"turn": turn % 5}, write)
    Store(folder).load({"turn": turn % 5}, read)
"""


@pytest.mark.parametrize("number", [errno.ENOTEMPTY, errno.EEXIST])
def test_a_quicker_process_is_no_failure(
    number: int, tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What ext4 and XFS say of a folder that is there and not empty."""

    def rename(self: Path, target: Path) -> None:
        raise OSError(number, "File exists")

    monkeypatch.setattr(Path, "rename", rename)
    assert Store(tmp_path).keep(INPUTS, lambda entry: (entry / "a").write_text("a"))
    assert capsys.readouterr().err == ""


def test_processes_share_a_store(tmp_path: Path) -> None:
    processes = [
        started("-c", WRITER, tmp_path, how, stderr=subprocess.PIPE)
        for how in ("fresh", "fresh", "stored")
    ]
    for process in processes:
        _, error = process.communicate(timeout=60)
        assert (process.returncode, error) == (0, "")
    assert len(list(tmp_path.iterdir())) == 5


@dataclass(frozen=True)
class Numbers:
    peak: float
    area: float | None
    levels: tuple[int, ...]
    curve: Any = None


def test_numbers_come_back_bit_for_bit_and_are_computed_once(
    tmp_path: Path, capsys: Capture
) -> None:
    curve = np.random.default_rng(1).normal(size=5)
    one = Numbers(0.1 + 0.2, None, (1, 2), curve)
    times = []

    def compute() -> Numbers:
        times.append(1)
        return one

    store = Store(tmp_path)
    assert store.obtain(INPUTS, Numbers, compute) is one
    found = store.obtain(INPUTS, Numbers, compute)
    assert len(times) == 1
    assert (found.peak, found.area, found.levels) == (one.peak, one.area, one.levels)
    assert np.array(found.curve).tobytes() == curve.tobytes()
    path = tmp_path / key(INPUTS) / VALUES
    good = path.read_text()
    for number, text in enumerate((good.replace("0.3", "0.4"), good[:30], "", "[]"), 2):
        path.write_text(text)
        assert store.obtain(INPUTS, Numbers, compute) is one
        assert "computed again" in capsys.readouterr().err
        assert len(times) == number
    assert NO_STORE.obtain(INPUTS, Numbers, compute) is one
    assert not NO_STORE.has(INPUTS)
    store.obtain({"a": 3}, dict[str, Any], lambda: {"steps": 7, "peak": 7.0})
    assert repr(store.find({"a": 3}, dict[str, Any])) == "{'steps': 7, 'peak': 7.0}"


def test_lines_that_were_altered_or_cut_short_do_not_count(tmp_path: Path) -> None:
    path = tmp_path / "cells.jsonl"
    lines = LineStore(path)
    assert lines.load(INPUTS) is None
    lines.keep(INPUTS, {"peak": 64.1})
    assert lines.load(INPUTS) == LineStore(path).load(INPUTS) == {"peak": 64.1}
    assert LineStore(path).load({"a": 2}) is None
    good = path.read_text()
    other = good.replace(key(INPUTS)[:8], "0" * 8)
    for text in (good.replace("64.1", "64.2"), good[:30], other, "[" * 100_000):
        path.write_text(text)
        again = LineStore(path)
        assert again.load(INPUTS) is None
        again.keep({"a": 2}, {"peak": 1.0})  # what was cut short does not swallow it
        assert LineStore(path).load({"a": 2}) == {"peak": 1.0}
