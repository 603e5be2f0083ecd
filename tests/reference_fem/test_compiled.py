"""The element loops are stamped with the files of the elements, which they do not import."""

from pathlib import Path

import pytest

import reference_fem.compiled
from reference_fem.compiled import source_stamp
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
