"""What a stored run is named by: everything that has a part in its numbers, and nothing else."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from validation.harness import identity as store_key
from validation.harness.identity import program, run_inputs, source_digest
from validation.harness.store import key
from validation.scenes.load import load_scene

ROOT = Path(__file__).parents[2]


def inputs(*overrides: str, model: str = "hcm", scene: str = "soft", **more: Any) -> dict[str, Any]:
    return run_inputs(load_scene(scene, overrides).tables, model, program(model), **more)


@pytest.mark.parametrize(
    "change",
    ["surface.friction=0.51", "surface.height=0.1000000000000001", "material.density=1401.0",
     "solver.hcm.contact_tolerance=1e-10", "finger.elements=19", "drive.gravity=-9.8",
     "tip.restitution=0.99"],
)  # fmt: skip
def test_a_changed_scene_has_another_name(change: str) -> None:
    assert key(inputs(change)) != key(inputs())


def test_what_a_model_does_not_read_changes_nothing() -> None:
    assert key(inputs("solver.fem.preset=ls-dyna-like")) == key(inputs())
    assert key(inputs("solver.hcm.taps=2", model="fem3d")) == key(inputs(model="fem3d"))
    assert key(inputs("surface.friction=0.5")) == key(inputs())  # the scene's own value
    assert key(inputs("solver.fem.preset=ls-dyna-like", model="fem3d")) != key(
        inputs(model="fem3d")
    )
    assert len({key(inputs(model=m)) for m in ("hcm", "fem3d", "fem2d")}) == 3
    assert key(inputs(start=[1.0])) != key(inputs(start=[1.1]))


def test_a_mesh_file_counts_by_its_content(tmp_path: Path) -> None:
    mesh = tmp_path / "a.vtu"
    names = []
    for content in (b"one", b"two"):
        mesh.write_bytes(content)
        names.append(key(inputs(f"solver.fem.mesh={mesh}", model="fem3d")))
    assert names[0] != names[1]


def test_another_program_or_machine_has_another_name(monkeypatch: pytest.MonkeyPatch) -> None:
    before = program("hcm")
    for name in ("version", "processor", "source_digest"):
        with monkeypatch.context() as patch:
            patch.setattr(store_key, name, lambda *_: "other")
            assert program("hcm") != before, name
    with monkeypatch.context() as patch:
        patch.setenv("NUMBA_NUM_THREADS", "7")
        assert program("hcm") != before
    assert program("hcm") == before
    assert program("fem3d")["source"] != before["source"]


def test_sources_count_by_name_and_content(tmp_path: Path) -> None:
    package = tmp_path / "package"
    (package / "inner").mkdir(parents=True)
    (package / "inner" / "a.py").write_text("a = 1")
    digests = [source_digest([package])]
    (package / "inner" / "a.py").write_text("a = 2")
    digests.append(source_digest([package]))
    (package / "inner" / "a.py").rename(package / "inner" / "b.py")
    digests.append(source_digest([package]))
    (package / "inner" / "b.pyc").write_text("compiled code has no say")
    assert len(set(digests)) == 3
    assert source_digest([package]) == digests[-1]


def test_no_module_between_scene_and_record_is_forgotten() -> None:
    """What a run loads of this package is part of its name."""
    code = """
import sys
from validation.runs.execute import solve
from validation.scenes.load import load_scene
for model in ("hcm", "fem2d"):
    solve(load_scene("soft", ["surface.height=0.06"]), model, None)
print(*(m.__file__ for n, m in list(sys.modules.items()) if n.startswith("validation.")))
"""
    environment = os.environ | {"PYTHONPATH": str(ROOT), "NUMBA_NUM_THREADS": "1"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True,
                          env=environment)  # fmt: skip
    loaded = {Path(name) for name in done.stdout.split()}
    # words for people and processes: none of them has a part in a number
    silent = {
        "compiling.py",
        "console.py",
        "errors.py",
        "interrupts.py",
        "isolated.py",
        "memory.py",
        "orphan.py",
        "provenance.py",
    }
    for path in loaded:
        known = any(path == root or root in path.parents for root in store_key.TRANSLATION)
        assert known or path.name in silent, path
