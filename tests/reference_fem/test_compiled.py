"""The element loops are stamped with the files of the elements, which they do not import."""

from pathlib import Path

import pytest

import reference_fem.compiled
from reference_fem.compiled import source_stamp
from reference_fem.elements import loops


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
