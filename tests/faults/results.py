"""What a command left, as far as it does not depend on the day: numbers, curves, fields."""

import csv
import hashlib
import io
import json
from pathlib import Path
from typing import Any

import h5py

MEASURED = (
    "wall_time_s", "estimate_time_s", "peak_memory_MB", "measured", "mesh_time_s", "provenance",
    "digest",
)  # fmt: skip
MEASURED_FILES = ("table_3.csv",)  # time and memory, and their ratios
MEASURED_CLAIMS = "T3."  # the ledger's rows about time and memory (the paper's Table 3)
UNREADABLE = b"unreadable"


def collect(out: Path) -> dict[str, str]:
    """SHA-256 of what is comparable in every file of results below a folder, by path."""
    readers = {".csv": _table, ".json": _summary, ".nc": _curves, ".jsonl": _lines,
               ".vtu": _bytes, ".pvd": _bytes}  # fmt: skip
    found = {}
    for path in sorted(out.rglob("*")):
        name = path.relative_to(out).as_posix()
        # hidden: what a kill left half written, under a name that nothing reads
        hidden = path.name.startswith(".") or name.startswith("store/")
        if path.name in MEASURED_FILES or hidden:
            continue
        if path.is_file() and path.suffix in readers:
            try:
                content = readers[path.suffix](path)
            except (OSError, ValueError, KeyError):  # HDF5 and JSON may not open a damaged file
                content = UNREADABLE
            found[name] = hashlib.sha256(content).hexdigest()
    return found


def differences(one: dict[str, str], two: dict[str, str]) -> list[str]:
    """Files that are not the same."""
    return sorted(name for name in {*one, *two} if one.get(name) != two.get(name))


def entries(out: Path) -> dict[str, tuple[int, int]]:
    """Every whole entry of the store: which folder it is and when it was made."""
    folders = [path.parent for path in (out / "store").glob("[0-9a-f]*/manifest.json")]
    return {f.name: (f.stat().st_ino, f.stat().st_mtime_ns) for f in folders}


def cells(out: Path) -> list[str]:
    """Keys of the finished cells of a stress campaign, as often as they were run."""
    keys = []
    for path in out.glob("stress/*/cells.jsonl"):
        for line in path.read_text(errors="replace").splitlines():
            try:
                keys.append(str(json.loads(line)["key"]))
            except (ValueError, KeyError, TypeError):
                continue  # a line that a kill cut short
    return keys


def _bytes(path: Path) -> bytes:
    return path.read_bytes()


def _table(path: Path) -> bytes:
    rows = list(csv.DictReader(io.StringIO(path.read_text())))
    kept = [
        {name: value for name, value in row.items() if name not in MEASURED}
        for row in rows
        if not str(row.get("id", "")).startswith(MEASURED_CLAIMS)
    ]
    return "\n".join(sorted(map(repr, kept))).encode()


def _timeless(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _timeless(v) for k, v in value.items() if k not in MEASURED}
    return value


def _summary(path: Path) -> bytes:
    return json.dumps(_timeless(json.loads(path.read_text())), sort_keys=True).encode()


def _lines(path: Path) -> bytes:
    rows = {}
    for line in path.read_text(errors="replace").splitlines():
        try:
            row = json.loads(line)
            rows[row["key"]] = _timeless(row)
        except (ValueError, KeyError, TypeError):
            continue
    return json.dumps(rows, sort_keys=True).encode()


def _curves(path: Path) -> bytes:
    digest = hashlib.sha256()
    with h5py.File(path) as file:
        for name in sorted(file):
            digest.update(name.encode() + file[name][()].tobytes())
    return digest.digest()
