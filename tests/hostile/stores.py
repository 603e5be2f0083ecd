"""Forged entries of a store: what a stranger with the program writes, digests and all."""

import json
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from validation.harness import store as store_module
from validation.harness.store import MANIFEST
from validation.harness.stored_run import FIELDS, FORCES, HISTORY, RECORD

Forgery = Callable[[Path], None]

# No value of these may stand in the place of a scalar, a text or a table that has another type.
VALUES: tuple[Any, ...] = (
    None, True, "x", "\x1b[31m", "a\0b", "\ud800", "", [], {}, [1, 2, 3], [[]], {"a": {}},
    -1, -1.0, 1.5, 10**400, 2**70, float("nan"), float("inf"), -float("inf"), 1e308,
)  # fmt: skip


def seal(entry: Path) -> None:
    """Write the manifest anew, so that every digest is right."""
    manifest = json.loads((entry / MANIFEST).read_text())
    manifest["files"] = store_module._digests(entry)
    (entry / MANIFEST).write_text(json.dumps(manifest))


def record_with(value: Any, *path: str) -> Forgery:
    """A record with one value replaced."""

    def forge(entry: Path) -> None:
        record = json.loads((entry / RECORD).read_text())
        table = record
        for name in path[:-1]:
            table = table[name]
        table[path[-1]] = value
        (entry / RECORD).write_text(json.dumps(record))

    return forge


def record_without(*path: str) -> Forgery:
    """A record with one key left out."""

    def forge(entry: Path) -> None:
        record = json.loads((entry / RECORD).read_text())
        table = record
        for name in path[:-1]:
            table = table[name]
        del table[path[-1]]
        (entry / RECORD).write_text(json.dumps(record))

    return forge


def text_of_record(text: str) -> Forgery:
    """Another file in the record's place."""
    return lambda entry: (entry / RECORD).write_text(text) and None


def arrays_with(name: str, array: Any, file: str = HISTORY) -> Forgery:
    """An archive with one array replaced or added; None leaves it out."""

    def forge(entry: Path) -> None:
        with np.load(entry / file, allow_pickle=False) as archive:
            arrays = {key: archive[key] for key in archive.files}
        arrays[name] = array
        if array is None:
            del arrays[name]
        with (entry / file).open("wb") as stream:
            np.savez(stream, **arrays)

    return forge


def fields_with(*names: str) -> Forgery:
    """A folder of fields with such files; a name that ends in / is a folder."""

    def forge(entry: Path) -> None:
        (entry / FIELDS).mkdir()
        for name in names:
            path = entry / FIELDS / name
            if name.endswith("/"):
                path.mkdir()
            else:
                path.write_text("x")

    return forge


NAMED: dict[str, Forgery] = {
    "no object": text_of_record("[]"),
    "no JSON": text_of_record("{"),
    "deep": text_of_record("[" * 100_000),
    "summary is text": record_with("x", "summary"),
    "no summary": record_without("summary"),
    "a scalar is text": record_with("64", "summary", "peak_normal_force_N"),
    "a scalar is a table": record_with({}, "summary", "contact_time_s"),
    "a scalar is NaN": record_with(float("nan"), "summary", "peak_normal_force_N"),
    "a scalar is infinite": record_with(float("inf"), "summary", "normal_impulse_N_s"),
    "a scalar overflows": record_with(1e308, "summary", "contact_duration_s"),
    "a force is negative": record_with(-5.0, "summary", "peak_normal_force_N"),
    "a count is a fraction": record_with(1.5, "summary", "steps"),
    "a flag is a number": record_with(3, "summary", "reverse_slip"),
    "a vector of one": record_with([1.0], "summary", "tip_velocity_at_contact_m_per_s"),
    "a vector of texts": record_with(["a", "b"], "summary", "tip_velocity_at_contact_m_per_s"),
    "a scalar is missing": record_without("summary", "peak_stress_R_Pa"),
    "no errors": record_without("errors"),
    "an error of nothing": record_with({"steps": 1.0}, "errors"),
    "an error is negative": record_with({"peak_normal_force_N": -1.0}, "errors"),
    "an error is a vector": record_with({"peak_normal_force_N": [1.0, 1.0]}, "errors"),
    "another status": record_with("FAILED", "status"),
    "not completed": record_with(False, "ok"),
    "another model": record_with("fem3d", "model"),
    "no model": record_with("x", "model"),
    "events are no pairs": record_with([1], "events"),
    "an event without time": record_with([["x", "contact"]], "events"),
    "statistics are a list": record_with([1], "statistics"),
    "provenance is text": record_with("x", "provenance"),
    "created is a number": record_with(3, "provenance", "created"),
    "a null byte": record_with("a\0b", "message"),
    "half a character": record_with("\ud800", "message"),
    "an unknown key": record_with(1, "more"),
    "texts in time": arrays_with("time_s", np.array(["a"] * 5)),
    "one number in time": arrays_with("time_s", np.array(1.0)),
    "two axes in time": arrays_with("time_s", np.ones((5, 2))),
    "NaN in time": arrays_with("time_s", np.full(5, np.nan)),
    "time runs back": arrays_with("time_s", np.arange(5.0)[::-1]),
    "no time": arrays_with("time_s", None),
    "another length": arrays_with("normal_force_N", np.ones(4)),
    "complex": arrays_with("normal_force_N", np.ones(5, complex)),
    "objects": arrays_with("normal_force_N", np.array([{}] * 5, object)),
    "a path for a name": arrays_with("a/b", np.ones(5)),
    "forces without time": arrays_with("normal_force_N", np.ones(5), FORCES),
    "no archive": lambda entry: (entry / HISTORY).write_text("x") and None,
    "a folder in the fields": fields_with("tap.pvd", "tap_000.vtu/"),
    "fields without an index": fields_with("tap_000.vtu"),
    "another file in the fields": fields_with("tap.pvd", "x.sh"),
}


def any_forgery(dice: random.Random, entry: Path) -> tuple[str, Forgery]:
    """One at random: a value somewhere in the record, or an array."""
    record = json.loads((entry / RECORD).read_text())
    paths = [(key,) for key in record]
    paths += [
        (key, inner) for key in record if isinstance(record[key], dict) for inner in record[key]
    ]
    path = dice.choice(paths)
    if dice.random() < 0.2:
        return f"without {path}", record_without(*path)
    if dice.random() < 0.25:
        shape = dice.choice([(), (5,), (4,), (5, 2), (0,), (5, 1, 1)])
        kind = dice.choice(["f8", "f4", "i8", "u1", "?", "c16", "U3", "S3", "M8[s]"])
        name = dice.choice(["time_s", "normal_force_N", "x", "", "a/b", "step_time_s", "."])
        file = dice.choice([HISTORY, FORCES])
        return f"{name} {shape} {kind} in {file}", arrays_with(name, np.zeros(shape, kind), file)
    value = dice.choice(VALUES)
    return f"{path} = {value!r}", record_with(value, *path)
