"""How the reference's kernels are compiled, and with which files they are stamped."""

from pathlib import Path

import pytest

import reference_fem.compiled
from reference_fem.compiled import inner, njit, source_stamp
from reference_fem.elements import loops
from tests.processes import printed


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
        known = path.match("hexahedron/eight_point_kernel.py")
        return b"edited" if known else digest, imported

    monkeypatch.setattr(reference_fem.compiled, "_digest_and_imports", edited)
    assert source_stamp(file) != stamp


def test_a_kernel_rounds_alike_whatever_was_compiled_before() -> None:
    """numba keeps its power of a whole number by its types alone, compiled as first asked for, and
    a kernel without flags takes those of its first caller.
    """

    def power(x: float, n: int) -> float:
        return x**n

    @inner()
    def cube_and_one(x: float) -> float:
        return x * x * x + 1.0

    def called(x: float) -> float:
        return cube_and_one(x)

    for function, numbers in ((power, (1.5, 3)), (called, (1.5,))):
        for flags in ({"contract"}, set[str]()):
            compiled = njit(fastmath=flags)(function)
            assert compiled(*numbers) - 3.375 == (function is called)
            code = "".join(compiled.inspect_llvm().values())
            assert ("fmul contract" in code) == (function is power and bool(flags))


@pytest.mark.parametrize("stated", [None, "active"])
def test_threads_do_not_spin_unless_asked_to(
    monkeypatch: pytest.MonkeyPatch, stated: str | None
) -> None:
    """The library that reads it is loaded later, by whatever is imported."""
    monkeypatch.delenv("OMP_WAIT_POLICY", raising=False)
    maps = "'libgomp' in pathlib.Path('/proc/self/maps').read_text()"
    code = f"import reference_fem, os, pathlib; print(os.environ['OMP_WAIT_POLICY'], {maps})"
    found = printed("-c", code, env={"OMP_WAIT_POLICY": stated} if stated else None)
    assert found.split() == [stated or "passive", "False"]
