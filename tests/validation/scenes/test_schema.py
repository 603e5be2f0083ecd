"""``fingertap schema`` says what reading a scene accepts, and ``fingertap new`` writes one."""

import copy
import dataclasses
import json
import re
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import tomli_w

import meshes
from tests.validation.commands import Run, call
from validation.errors import UserError
from validation.models.solid_inputs import NEEDED, solver_settings
from validation.models.solid_mesh import sizing_of
from validation.scenes.load import BUILT_IN, load_scene, read_document
from validation.scenes.load import validate as read_tables
from validation.scenes.messages import known_keys
from validation.scenes.schema import scene_schema
from validation.scenes.solver_tables import LIMITS, SIZES
from validation.sweep.plan import assignment


@pytest.fixture(scope="module")
def schema() -> dict[str, Any]:
    return scene_schema()


def entries(schema: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """What the schema says of every dotted key."""
    found = {}

    def walk(table: dict[str, Any], prefix: str) -> None:
        for key, entry in table["properties"].items():
            reference = entry.get("$ref")
            if reference:
                walk(schema["$defs"][reference.rsplit("/", 1)[-1]], f"{prefix}{key}.")
            else:
                found[prefix + key] = entry
                for inner in entry.get("anyOf", ()):
                    if "properties" in inner:
                        walk(inner, f"{prefix}{key}.")

    walk(schema, "")
    return found


def test_schema_has_every_key_with_words_and_the_built_in_scenes_pass(
    schema: dict[str, Any],
) -> None:
    jsonschema.Draft202012Validator.check_schema(schema)
    for scene in BUILT_IN:
        jsonschema.validate(read_document(scene)[1], schema)
    described = entries(schema)
    assert set(described) == set(known_keys())
    assert all(entry["description"] for entry in described.values())


def test_sizes_are_all_that_a_mesh_file_decides() -> None:
    """A size that is not among them would be accepted beside a mesh file, without effect."""
    assert set(SIZES) == {f.name for f in dataclasses.fields(meshes.Sizing)} - set(LIMITS)


def test_no_number_stands_where_a_key_has_no_bound(schema: dict[str, Any]) -> None:
    """The largest float, by which the solvers' own checks refuse longer ones, is none."""
    assert "e+308" not in json.dumps(schema)
    for key in ("solver.fem.penalty_factor", "solver.hcm.flight_tolerance"):
        with pytest.raises(UserError) as refused:
            load_scene("soft", [f"{key} = -1"])
        assert "e+308" not in str(refused.value)


OF_SEVERAL = ("never reached", "round end", "would cut it", "beam elements")  # keys together


def test_schema_and_reading_agree_at_and_beyond_every_bound(schema: dict[str, Any]) -> None:
    checked = 0
    base = read_document("soft")[1]
    checker = jsonschema.Draft202012Validator(schema)
    for key, entry in entries(schema).items():
        number = next((a for a in (entry, *entry.get("anyOf", ())) if "type" in a), {})
        bounds = [b for word, b in number.items() if "inimum" in word or "aximum" in word]
        for bound in bounds:
            for value in (bound, bound + max(1, abs(bound)), bound - max(1, abs(bound)), "text"):
                document = copy.deepcopy(base)
                table = document
                *path, last = key.split(".")
                for part in path:
                    table = table.setdefault(part, {})
                table[last] = value
                try:
                    read_tables(document, "scene")
                    refused = ""
                except UserError as error:
                    refused = str(error)
                if f"{key} = " in refused and not any(text in refused for text in OF_SEVERAL):
                    assert not checker.is_valid(document), refused
                elif not refused:
                    assert checker.is_valid(document), (key, value)
                checked += 1
    assert checked > 100  # every key with a bound was tried


def test_new_scene_is_the_one_it_is_like_also_with_every_default_written(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    assert call("new", str(path), "--like", "driven-2") == 0
    assert load_scene(str(path)).tables == load_scene("driven-2").tables
    text = re.sub(r"^# (\w+ = .)", r"\1", path.read_text(), flags=re.M)
    assert len(tomllib.loads(text)["solver"]["hcm"]) > 10
    path.write_text(text)
    load_scene(str(path))


@pytest.mark.parametrize(
    ("text", "said"), [("finger = 3", "finger"), ("lenth = 0.1", "finger is missing")]
)
def test_a_scene_like_one_that_no_run_takes_is_refused(
    tmp_path: Path, fingertap: Run, text: str, said: str
) -> None:
    """Nothing is left behind that would be in the way of the next try."""
    (tmp_path / "bad.toml").write_text(text)
    ended = fingertap("new", str(tmp_path / "mine.toml"), "--like", str(tmp_path / "bad.toml"))
    assert ended.code == 2
    assert said in ended.line
    assert not (tmp_path / "mine.toml").exists()


def test_written_defaults_of_the_solids_are_what_they_do_without(tmp_path: Path) -> None:
    """A preset's contact law and sizes are no defaults of the solver's."""
    assert call("new", str(tmp_path / "mine.toml")) == 0
    text = re.sub(r"^# (\w+ = .)", r"\1", (tmp_path / "mine.toml").read_text(), flags=re.M)
    stated = {k: v for k, v in tomllib.loads(text)["solver"]["fem"].items() if k not in NEEDED}
    written = [assignment(f"solver.fem.{key}", value) for key, value in stated.items()]
    one, other = load_scene("soft", written).tables, load_scene("soft").tables
    assert solver_settings(one) == solver_settings(other)
    assert sizing_of(one, 3) == sizing_of(other, 3)


def test_new_scene_takes_torques_over_time(tmp_path: Path) -> None:
    ramped = "drive.torques={time=[0, 0.02], values=[[0, 0, 0], [0.1, 0, 0.2]]}"
    scene = load_scene("soft", [ramped])
    (tmp_path / "like.toml").write_text(tomli_w.dumps(scene.document))
    assert call("new", str(tmp_path / "mine.toml"), "--like", str(tmp_path / "like.toml")) == 0
    assert load_scene(str(tmp_path / "mine.toml")).tables == scene.tables


def test_schema_command_prints_nothing_but_the_schema(
    fingertap: Run, schema: dict[str, Any]
) -> None:
    ended = fingertap("schema")
    assert ended.code == 0
    assert json.loads(ended.out) == json.loads(json.dumps(schema))


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("there.toml", "already exists"),
        ("scene.txt", ".toml"),
        ("none/scene.toml", "No such file"),
        ("a\0b.toml", "cannot be written"),
    ],
)
def test_new_scene_refuses(tmp_path: Path, name: str, words: str, fingertap: Run) -> None:
    there = tmp_path / "there.toml"
    there.write_text("mine")
    assert words in fingertap("new", tmp_path / name).refusal
    assert there.read_text() == "mine"
