"""numba's cache on disk notices an edit of what a kernel calls."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import reference_fem.compiled
from reference_fem.compiled import source_stamp
from reference_fem.elements import loops

CALLEE = """from pair.compiled import njit


@njit(cache=True)
def inner(x):
    return {} * x
"""
CALLER = """from pair.below.callee import inner
from pair.compiled import njit


@njit(cache=True, parallel=True)
def outer(x):
    return inner(x) + 1.0


print(outer(1.0), sum(outer.stats.cache_hits.values()))
"""


TYPED = """from pair.compiled import njit
from pair.{module} import Pair


@njit(cache=True)
def total(pair):
    return pair.a + pair.b


print(total(Pair(1.0, 2.0)), sum(total.stats.cache_hits.values()))
"""
PAIR = """from typing import NamedTuple


class Pair(NamedTuple):
    a: float
    b: float
"""


def test_a_cache_of_a_type_that_has_moved_is_stale(tmp_path: Path) -> None:
    package = tmp_path / "pair"
    package.mkdir()
    shutil.copy(reference_fem.compiled.__file__, package)
    environment = os.environ | {"PYTHONPATH": str(tmp_path), "NUMBA_CACHE_DIR": str(tmp_path / "c")}

    def result(module: str) -> list[str]:
        (package / f"{module}.py").write_text(PAIR)
        (package / "typed.py").write_text(TYPED.format(module=module))
        command = [sys.executable, "-m", "pair.typed"]
        return subprocess.check_output(command, env=environment, text=True).split()

    assert [result("before"), result("before")] == [["3.0", "0"], ["3.0", "1"]]
    (package / "before.py").unlink()
    assert [result("after"), result("after")] == [["3.0", "0"], ["3.0", "1"]]


@pytest.mark.parametrize("folder", ["beside the source", "NUMBA_CACHE_DIR"])
def test_the_cache_notices_an_edited_callee(tmp_path: Path, folder: str) -> None:
    package = tmp_path / "pair"
    (package / "above").mkdir(parents=True)
    (package / "below").mkdir()
    shutil.copy(reference_fem.compiled.__file__, package)
    (package / "above/caller.py").write_text(CALLER)
    environment = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
    environment["PYTHONPATH"] = str(tmp_path)
    if folder == "NUMBA_CACHE_DIR":
        environment["NUMBA_CACHE_DIR"] = str(tmp_path / "cache")

    def result(factor: float) -> list[str]:
        (package / "below/callee.py").write_text(CALLEE.format(factor))
        command = [sys.executable, "-m", "pair.above.caller"]
        return subprocess.check_output(command, env=environment, text=True).split()

    assert result(2.0) == ["3.0", "0"]
    assert result(2.0) == ["3.0", "1"]
    assert result(5.0) == ["6.0", "0"]


def test_the_element_loops_carry_the_stamp_of_all_elements(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # The elements' kernels are overloads: the loops' file does not import them.
    file = Path(loops.__file__)
    stamp = source_stamp(file)
    assert loops.internal_force._cache._cache_file._source_stamp == stamp
    read = reference_fem.compiled._digest_and_imports

    def edited(path: Path) -> tuple[bytes, tuple[Path, ...]]:
        digest, imported = read(path)
        return (
            (b"edited", imported)
            if path.match("hexahedron/eight_point_kernel.py")
            else (digest, imported)
        )

    monkeypatch.setattr(reference_fem.compiled, "_digest_and_imports", edited)
    assert source_stamp(file) != stamp
