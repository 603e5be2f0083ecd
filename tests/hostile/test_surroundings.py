"""What a shell gives a command: limits, environment variables, modes, files' encodings."""

import json
import os
import resource
import stat
from dataclasses import replace
from pathlib import Path

import pytest

from tests.processes import ROOT
from tests.validation.commands import Ended, Make, Run, call_apart
from validation.harness.run_files import write_run
from validation.harness.store import Store, key
from validation.harness.stored_run import keep_run
from validation.models.inputs import run_inputs
from validation.scenes.load import load_scene

HCM = ("run", "soft", "--model", "hcm")


@pytest.mark.parametrize(
    ("variable", "value"),
    [("NUMBA_NUM_THREADS", "0"), ("NUMBA_NUM_THREADS", "-1"), ("NUMBA_NUM_THREADS", "two"),
     ("NUMBA_DISABLE_JIT", "1")],
)  # fmt: skip
def test_an_environment_that_numba_cannot_work_in_is_one_line(
    variable: str, value: str, tmp_path: Path
) -> None:
    line = call_apart(*HCM, "--out", tmp_path, env={variable: value}).refusal
    assert f"{variable} = {value!r}: must be" in line
    assert "unset it" in line
    assert list(tmp_path.iterdir()) == []


def test_too_little_address_space_is_said_at_once(tmp_path: Path) -> None:
    limit = 400_000 * 1024  # `ulimit -v 400000`: OpenBLAS retried for more than a minute

    def small() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))

    line = call_apart(*HCM, "--out", tmp_path, preexec_fn=small).refusal
    assert "ulimit -v 400000: must be at least" in line


@pytest.mark.parametrize("closed", [(0, 1, 2), (2,)])
def test_closed_streams_take_nothing_and_spoil_nothing(
    closed: tuple[int, ...], tmp_path: Path
) -> None:
    def close() -> None:
        for number in closed:
            os.close(number)

    given = ("run", "nowhere", "--model", "hcm"), (*HCM, "--json", "--out", tmp_path)
    refused, done = (call_apart(*arguments, preexec_fn=close) for arguments in given)
    assert refused == Ended(2, "", "")
    assert (done.code, done.err) == (0, "")
    assert done.out == "" if 1 in closed else json.loads(done.out)["model"] == "hcm"
    assert (tmp_path / "run" / "soft-hcm" / "summary.json").exists()


@pytest.mark.parametrize("umask", [0o077, 0o022, 0o002])
def test_modes_are_the_users_to_mask(umask: int, make_record: Make, tmp_path: Path) -> None:
    before = os.umask(umask)
    try:
        write_run(tmp_path / "out" / "run", make_record())
        keep_run(Store(tmp_path / "out" / "store"), {"a": 1}, make_record())
    finally:
        os.umask(before)
    paths = list((tmp_path / "out").rglob("*"))
    assert (tmp_path / "out" / "store" / key({"a": 1})) in paths
    for path in paths:
        whole = 0o777 if path.is_dir() else 0o666
        assert stat.S_IMODE(path.stat().st_mode) == whole & ~umask, path


def test_a_byte_order_mark_is_no_syntax_error(tmp_path: Path) -> None:
    text = (ROOT / "validation" / "scenes" / "soft.toml").read_bytes()
    (tmp_path / "scene.toml").write_bytes(b"\xef\xbb\xbf" + text)
    assert load_scene(str(tmp_path / "scene.toml")).tables == load_scene("soft").tables


def test_a_scenes_name_can_be_written(make_record: Make, tmp_path: Path) -> None:
    path = tmp_path / os.fsdecode(b"\xff.toml")
    path.write_bytes((ROOT / "validation" / "scenes" / "soft.toml").read_bytes())
    name = load_scene(str(path)).name
    assert name == r"\udcff"
    write_run(tmp_path / "run", replace(make_record(), scene=name))


@pytest.mark.parametrize("path", ["a\0b", "m" * 5000, "a\0b.toml", "m" * 300 + ".toml"])
def test_no_path_is_a_trace(path: str, tmp_path: Path, fingertap: Run) -> None:
    assert "scene" in fingertap("run", path, "--model", "hcm").refusal
    assert "scene" in fingertap("render", path, "--out", str(tmp_path)).refusal
    assert "--out" in fingertap(*HCM, "--out", str(tmp_path / path)).refusal
    escaped = path.replace("\0", "\\u0000")
    mesh = f'solver.fem.mesh="{escaped}.vtu"'
    out = str(tmp_path / "out")
    line = fingertap("run", "soft", "--model", "fem2d", "--set", mesh, "--out", out).refusal
    assert "no such file" in line


def test_a_pipe_is_no_scene_and_no_mesh(tmp_path: Path, fingertap: Run) -> None:
    """Reading it would wait for a writer for ever."""
    os.mkfifo(tmp_path / "pipe.toml")
    assert (
        "is not a file" in fingertap("run", str(tmp_path / "pipe.toml"), "--model", "hcm").refusal
    )
    os.mkfifo(tmp_path / "pipe.vtu")
    tables = load_scene("soft", [f"solver.fem.mesh={tmp_path / 'pipe.vtu'}"]).tables
    assert run_inputs(tables, "fem2d")["mesh_sha256"] == ""
