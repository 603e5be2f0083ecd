"""Both packages' compiled kernels: the cache on disk, and which of them Python calls.

numba's cache notices an edit of what a kernel calls, and a type that is gone.
"""

import shutil
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import hcm.compiled
import reference_fem.compiled
from tests.processes import printed
from validation.models import adapter
from validation.models.hcm import WARM_UP
from validation.scenes.load import load_scene

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
    [(hcm.compiled, "entry"), (reference_fem.compiled, "njit(cache=True, parallel=True)")],
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


@pytest.mark.parametrize("compiled", [hcm.compiled, reference_fem.compiled])
def test_a_kernel_for_kernels_is_called_from_python(compiled: ModuleType) -> None:
    """It is compiled anew then: it has no code for such calls."""

    @compiled.kernel
    def product(x: float, y: float) -> float:
        return x * y

    assert isinstance(product, compiled.InnerKernel)
    assert product(2.0, 3.0) == product(3, 2) == 6.0


TAPS = {
    "hcm": [
        ("solver.hcm.accuracy=1e-2",),
        ("solver.hcm.accuracy=1e-5", "solver.hcm.taps=2"),
        ("solver.hcm.accuracy=1e-2", "drive.torques=[0.01]"),
        ("solver.hcm.flight='rigid'", "tip.restitution=0.6"),
        ("solver.hcm.flight='elastic'", "solver.hcm.end_time=0.06"),
    ],
    "hcm-refined": [(), ("material.relaxation_time=1e-6", "tip.restitution=0.6")],
    "fem2d": [(), ("solver.fem.contact='impulse'", "material.relaxation_time=1e-8")],
    "fem3d": [
        (),
        ("solver.fem.element='hex8-one-point'", "solver.fem.accuracy=5e-2"),
        ("material.law=neo-hooke", "solver.fem.accuracy=5e-2"),
        ("material.law=neo-hooke", "material.relaxation_time=1e-7"),
    ],
}


RUN = """import hashlib

from validation.models import adapter
from validation.scenes.load import load_scene

for keys in {several!r}:
    record = adapter({model!r}).run(load_scene("soft", (*{few!r}, *keys))).record
    for force in record.contact_forces.values():
        print(keys, hashlib.sha256(force.tobytes()).hexdigest())
"""


@pytest.mark.slow
@pytest.mark.parametrize("model", TAPS)
def test_machine_code_from_the_cache_computes_the_same(model: str, tmp_path: Path) -> None:
    """numba optimises a parallel kernel once more as it is cached. Damped neo-Hookean hexahedra
    added equal forces in another order then: a process that compiled had other last digits.
    """
    text = RUN.format(model=model, several=TAPS[model], few=WARM_UP[1:])
    env = {"NUMBA_CACHE_DIR": str(tmp_path)}
    first, second = (printed("-c", text, env=env, timeout=900.0) for _ in range(2))
    assert first == second != ""


@pytest.mark.parametrize(
    ("model", "keys"), [(model, keys) for model, several in TAPS.items() for keys in several]
)
def test_a_run_calls_entries_only(
    model: str, keys: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A call of another kernel would compile its caller in each process anew, for a second."""

    def refuse(kernel: Any, *_args: Any) -> None:
        raise AssertionError(f"{kernel.py_func.__module__}.{kernel.__name__}: must be an entry")

    for compiled in (hcm.compiled, reference_fem.compiled):
        monkeypatch.setattr(compiled.InnerKernel, "__call__", refuse)
    record = adapter(model).run(load_scene("soft", (*WARM_UP[1:], *keys))).record
    assert record.status == "COMPLETED", record.message
