"""What a stored result is named by: everything that has a part in its numbers."""

import ast
import pickle
import shutil
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest

from tests.processes import printed
from tests.validation.commands import Patch
from validation.harness import identity
from validation.harness.identity import (
    DISTRIBUTIONS,
    PACKAGES,
    ROOT,
    closure,
    imports,
    program,
    source_digest,
)
from validation.harness.provenance import version
from validation.harness.store import key
from validation.models.inputs import run_inputs
from validation.runs import execute
from validation.scenes.load import load_scene
from validation.studies.stress.command import all_maps


def inputs(*overrides: str, model: str = "hcm", scene: str = "soft", **more: Any) -> dict[str, Any]:
    return run_inputs(load_scene(scene, overrides).tables, model, execute.__name__, **more)


@pytest.fixture
def afresh() -> Iterator[None]:
    """Whatever is patched, no other test finds the digests."""
    yield
    identity._sources_and_versions.cache_clear()


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


@pytest.mark.usefixtures("afresh")
def test_another_program_or_machine_has_another_name(monkeypatch: Patch) -> None:
    model = "validation.models.hcm"
    before = program(model)
    for name in ("version", "processor", "source_digest"):
        with monkeypatch.context() as patch:
            patch.setattr(identity, name, lambda *_: "other")
            identity._sources_and_versions.cache_clear()
            assert program(model) != before, name
        identity._sources_and_versions.cache_clear()
    for name in ("NUMBA_NUM_THREADS", "OPENBLAS_CORETYPE"):
        with monkeypatch.context() as patch:
            patch.setenv(name, "7")
            assert program(model) != before
    with monkeypatch.context() as patch:
        patch.setenv("NUMBA_CACHE_DIR", "/elsewhere")
        assert program(model) == before
    assert program("validation.models.solid")["source"] != before["source"]


PACKAGE = {
    "one/__init__.py": "",
    "one/judge.py": """
from typing import TYPE_CHECKING
import numpy as np
if TYPE_CHECKING:
    from one import types_only

def judge():
    from two.inner import (  # a name (in brackets)
        audit as check,
    )
    return check()
""",
    "one/types_only.py": "",
    "one/unused.py": "import scipy",
    "two/__init__.py": "from two.first import FIRST",
    "two/first.py": "FIRST = 1",
    "two/inner/__init__.py": "",
    "two/inner/audit.py": "import importlib\nlibrary = importlib.import_module('meshio')",
}


def test_a_result_is_named_by_all_that_its_module_imports(tmp_path: Path) -> None:
    for name, text in PACKAGE.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)

    def digest() -> str:
        return source_digest(closure(["one.judge"], (), tmp_path, ("one", "two"))[0])

    modules = {"one", "one.judge", "two", "two.first", "two.inner", "two.inner.audit"}
    sources, libraries = closure(["one.judge"], root=tmp_path, packages=("one", "two"))
    assert (set(sources), set(libraries)) == (modules, {"numpy", "meshio"})
    outside = closure(["one.judge"], ("two",), tmp_path, ("one", "two"))[0]
    assert set(outside) == {"one", "one.judge"}
    digests = [digest()]
    for edited in ("one/judge.py", "two/inner/audit.py", "two/__init__.py"):
        (tmp_path / edited).write_text(PACKAGE[edited] + "\n# edited\n")
        digests.append(digest())
    assert len(set(digests)) == 4
    (tmp_path / "one" / "unused.py").write_text("")
    (tmp_path / "one" / "judge.pyc").write_text("compiled code has no say")
    assert digest() == digests[-1]
    (tmp_path / "two/inner/audit.py").rename(tmp_path / "two/inner/first.py")
    assert digest() not in digests


def test_data_of_anothers_package_is_part_of_its_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A surrogate's weights had changed, and its old numbers were read back."""
    package = tmp_path / "surrogate"
    (package / "__pycache__").mkdir(parents=True)
    (package / "__init__.py").write_text("import meshio")
    monkeypatch.syspath_prepend(str(tmp_path))
    digests = []
    for weights, cached in ((b"\xff\x00", b"1"), (b"\xff\x00", b"2"), (b"\xff\x01", b"2")):
        (package / "weights.npz").write_bytes(weights)
        (package / "__pycache__" / "x.pyc").write_bytes(cached)
        sources, libraries = closure(["surrogate"])
        assert "meshio" in libraries
        digests.append(source_digest(sources))
    assert digests[0] == digests[1] != digests[2]


def test_what_anothers_package_imports_from_a_folder_is_part_of_its_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A plug-in's own library had changed, and its old numbers were read back."""
    monkeypatch.syspath_prepend(str(tmp_path))
    adapter = "import numpy, sys; import nowhere\nif sys: from library.forces import force\n"
    (tmp_path / "thin.py").write_text(adapter)
    (tmp_path / "library").mkdir()  # without __init__.py it is a package too
    coded = (
        "# -*- coding: latin-1 -*-\n# N\xe4herung\nfrom .signs import UP\nimport os, constants\n"
    )
    (tmp_path / "library" / "forces.py").write_bytes(coded.encode("latin-1"))
    (tmp_path / "library" / "signs.py").write_text("UP = 1\n")
    (tmp_path / "constants.py").write_text("G = 9.8\n")
    (tmp_path / "unused.py").write_text("")
    found = closure(["thin"])[0]
    library = {"library/forces.py", "library/signs.py"}
    assert set(found) == {"thin/thin.py", "constants/constants.py", *library}
    assert "numpy" in program("thin")["versions"]
    (tmp_path / "constants.py").write_text("G = 9.81\n")
    assert source_digest(closure(["thin"])[0]) != source_digest(found)
    with pytest.raises(ModuleNotFoundError, match="nowhere"):
        closure(["thin", "nowhere"])


def test_an_import_that_leads_nowhere_is_no_result(tmp_path: Path) -> None:
    with pytest.raises(ModuleNotFoundError, match="validation"):
        closure(["validation.models.hcm"], root=tmp_path)
    with pytest.raises(ModuleNotFoundError, match=r"validation\.models\.none"):
        closure(["validation.models.none"])  # not the package instead
    (tmp_path / "one.py").write_text("import importlib\nimportlib.import_module('one.none')")
    with pytest.raises(ModuleNotFoundError, match=r"one\.none"):
        closure(["one"], root=tmp_path, packages=("one",))


def _imported(tree: ast.Module) -> set[tuple[str, str]]:
    """What `imports` finds, from the whole syntax tree."""
    for_types = {
        inner
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        for branch in node.body
        for inner in ast.walk(branch)
    }
    names = set()
    for node in ast.walk(tree):
        if node in for_types:
            continue
        if isinstance(node, ast.Import):
            names |= {(alias.name, "") for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, "a relative import is not followed"
            names |= {(str(node.module), alias.name) for alias in node.names}
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
            names |= {(str(one.value), "") for one in node.args if isinstance(one, ast.Constant)}
    return names


def test_every_import_of_the_project_is_found_and_every_library_has_a_version() -> None:
    distributions = metadata.packages_distributions()
    for package in PACKAGES:
        for file in (ROOT / package).rglob("*.py"):
            text = file.read_text()
            assert set(imports(text)) == _imported(ast.parse(text)), file
            for name in {name.partition(".")[0] for name, _ in imports(text)} - {*PACKAGES}:
                for distribution in distributions.get(name, ()):  # the standard library has none
                    known = DISTRIBUTIONS.get(name, (name,))
                    assert metadata.version(distribution) in map(version, known), name


SOLVED = """
import sys
from validation.runs.execute import solve
from validation.scenes.load import load_scene
for model in ("hcm", "fem2d"):
    solve(load_scene("soft", ["surface.height=0.06"]), model, None)
print(*(name for name in list(sys.modules) if name.partition(".")[0] in {packages}))
"""
JUDGED = """
import pickle, sys
judge, scene = pickle.loads(bytes.fromhex(sys.argv[1]))
judge(scene)
print(*(name for name in list(sys.modules) if name.partition(".")[0] in {packages}))
"""


def loaded(code: str, *arguments: str) -> set[str]:
    """Modules of the project that a process has loaded in the end."""
    return set(printed("-c", code.format(packages=PACKAGES), *arguments).split())


def test_no_module_between_scene_and_record_is_forgotten() -> None:
    """What a run loads is part of its name."""
    roots = ["validation.models.hcm", "validation.models.solid", execute.__name__]
    assert loaded(SOLVED) <= set(closure(roots)[0])


@pytest.mark.parametrize("name", ["rigid-rod", "other-integrator", "reference-step-penalty-2d"])
def test_no_module_of_a_judge_is_forgotten(name: str) -> None:
    (wanted,) = (one for one in all_maps(True) if one.name == name)
    _, scene = next(wanted.cells())
    known = closure([wanted.judge.__module__, type(scene).__module__])[0]
    assert loaded(JUDGED, pickle.dumps((wanted.judge, scene)).hex()) <= set(known)


EDITED = ("hcm/compiled.py", "validation/studies/stress/hcm/audit.py",
          "validation/studies/stress/hcm/judge.py")  # fmt: skip
NAMES = """
from validation.harness.store import key
from validation.studies.campaign import Case, verdict_inputs
from validation.studies.stress.command import all_maps
for one in all_maps(True):
    print(one.name, key(verdict_inputs(Case(one.name, next(one.cells())[1], one.judge))))
"""


def test_a_verdict_does_not_outlive_its_judge(tmp_path: Path) -> None:
    """An edit of what a verdict is made from, wherever it is, gives the verdict another name."""
    ignore = shutil.ignore_patterns("__pycache__")
    for package in PACKAGES:
        shutil.copytree(ROOT / package, tmp_path / package, ignore=ignore)

    def names() -> dict[str, str]:
        copy = {"PYTHONPATH": str(tmp_path)}
        lines = printed("-B", "-c", NAMES, env=copy, cwd=tmp_path).splitlines()
        return dict(line.split() for line in lines)

    before = names()
    for edited in EDITED:
        file = tmp_path / edited
        text = file.read_text()
        file.write_text(text + "\n# edited\n")
        after = names()
        file.write_text(text)
        changed = {name for name in before if after[name] != before[name]}
        assert changed == {name for name in before if not name.startswith("reference")}, edited


def test_a_command_is_known_by_one_environment_whatever_it_has_imported(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The reference states how its threads wait where it is imported: a run stored before that
    would not be found after it.
    """
    monkeypatch.delenv("OMP_WAIT_POLICY", raising=False)
    code = """
from validation.cli import main
from validation.harness.identity import program
main(["--version"])
before = program("hcm")["environment"]
import reference_fem
print(before == program("hcm")["environment"])
"""
    assert printed("-c", code).split()[-1] == "True"
