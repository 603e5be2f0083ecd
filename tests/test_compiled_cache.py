"""numba's cache on disk notices an edit of what a kernel calls, and a type that is gone."""

import shutil
from pathlib import Path
from types import ModuleType

import pytest

import hcm.compiled
import reference_fem.compiled
from tests.processes import printed

CALLEE = """from typing import NamedTuple

from pair.compiled import {decorator}


class {name}(NamedTuple):
    x: float


GIVEN = {name}(1.0)


@{decorate}
def inner(given):
    return {factor} * given.x
"""
CALLER = """from pair.below.{module} import GIVEN, inner
from pair.compiled import {decorator}


@{decorate}
def outer(given):
    return inner(given) + 1.0


print(outer(GIVEN), sum(outer.stats.cache_hits.values()))
"""


@pytest.mark.parametrize("folder", ["beside the source", "NUMBA_CACHE_DIR"])
@pytest.mark.parametrize(
    ("compiled", "decorate"),
    [(hcm.compiled, "kernel"), (reference_fem.compiled, "njit(cache=True, parallel=True)")],
    ids=["hcm", "reference_fem"],
)
def test_the_cache_notices_an_edited_callee(
    compiled: ModuleType,
    decorate: str,
    folder: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    package = tmp_path / "pair"
    for part in (package, package / "above", package / "below"):
        part.mkdir()
        (part / "__init__.py").touch()
    shutil.copy(str(compiled.__file__), package)
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    if folder == "NUMBA_CACHE_DIR":
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))

    def result(factor: float, name: str = "Given", module: str = "callee") -> list[str]:
        how = {"decorator": decorate.partition("(")[0], "decorate": decorate, "factor": factor}
        how |= {"name": name, "module": module}
        shutil.rmtree(package / "below")
        (package / "below").mkdir()
        (package / f"below/{module}.py").write_text(CALLEE.format(**how))
        caller, text = package / "above/caller.py", CALLER.format(**how)
        if not caller.exists() or caller.read_text() != text:  # its time would tell numba too
            caller.write_text(text)
        command = ("-B", "-m", "pair.above.caller")
        return printed(*command, env={"PYTHONPATH": str(tmp_path)}).split()

    assert result(2.0) == ["3.0", "0"]
    assert result(2.0) == ["3.0", "1"]
    assert result(5.0) == ["6.0", "0"]
    # the cached index names a type that is gone, or that has moved
    for changed in ({"name": "Renamed"}, {"module": "elsewhere"}):
        assert result(5.0, **changed) == ["6.0", "0"]
        assert result(5.0, **changed) == ["6.0", "1"]
