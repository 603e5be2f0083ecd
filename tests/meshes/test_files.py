"""Mesh files: what goes in comes out, and what is wrong is refused in one line."""

import copy
import dataclasses
import pickle
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

import meshes
from meshes.check import check

GEOMETRY = meshes.FingerGeometry((0.04, 0.03), (0.015, 0.012))
SIZING = meshes.Sizing(2e-3, 4e-3, 1e-3)
SUFFIXES = [".vtu", ".msh"]


@pytest.fixture(scope="module", params=[3, 2])
def mesh(request: pytest.FixtureRequest) -> meshes.FingerMesh:
    build = {3: meshes.finger_hexahedra, 2: meshes.finger_quadrilaterals}[request.param]
    return build(GEOMETRY, SIZING)


def refusal(path: Path) -> str:
    with pytest.raises(meshes.MeshError) as caught:
        meshes.read(path)
    message = str(caught.value)
    assert "\n" not in message
    assert str(path) in message
    return message


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_round_trip_is_exact(mesh: meshes.FingerMesh, suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"finger{suffix}"
    meshes.write(mesh, str(path))
    again = meshes.read(str(path))
    assert again.dim == mesh.dim
    assert again.phalanges == 2
    assert again.points.tobytes() == mesh.points.tobytes()
    assert np.array_equal(again.cells, mesh.cells)
    assert (again.points.dtype, again.cells.dtype) == (np.float64, np.int64)
    for kind in ("node_sets", "facet_sets", "cell_sets"):
        before, after = getattr(mesh, kind), getattr(again, kind)
        assert set(before) == set(after)
        for name, members in before.items():
            assert np.array_equal(after[name], members), (kind, name)
            assert after[name].dtype == np.int64
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda mesh: pickle.loads(pickle.dumps(mesh))])
def test_a_mesh_goes_to_another_process(mesh: meshes.FingerMesh, copied: Any) -> None:
    again = copied(mesh)
    for name, given in vars(mesh).items():
        kept = getattr(again, name)
        assert type(kept) is type(given)
        if isinstance(given, Mapping):
            kept, given = dict(kept), dict(given)
        np.testing.assert_equal(kept, given)
    assert again.points is not mesh.points


def test_a_folder_a_text_file_and_a_lonely_point(mesh: meshes.FingerMesh, tmp_path: Path) -> None:
    """Each is told what it is: a .msh in ASCII was "truncated"."""
    (tmp_path / "folder.vtu").mkdir()
    assert "folder.vtu: is a folder" in refusal(tmp_path / "folder.vtu")
    meshes.write(mesh, tmp_path / "own.vtu")
    text = tmp_path / "text.msh"
    for version in ("2.2", "4.1"):
        content = meshio.vtu.read(tmp_path / "own.vtu")
        meshio.gmsh.write(text, content, fmt_version=version, binary=False)
        assert "save it as binary, or as .vtu" in refusal(text)
    lonely = dataclasses.replace(mesh, points=np.vstack([mesh.points, [[0.0] * mesh.dim]]))
    with pytest.raises(meshes.MeshError, match=f"1 points belong .* point {len(mesh.points)};"):
        check(lonely)


@pytest.mark.parametrize("kept", [0.0, 0.02, 0.3, 0.6, 0.95, 0.999])
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_truncated_files(mesh: meshes.FingerMesh, suffix: str, kept: float, tmp_path: Path) -> None:
    path = tmp_path / f"finger{suffix}"
    meshes.write(mesh, path)
    content = path.read_bytes()
    path.write_bytes(content[: int(kept * len(content))])
    assert "unreadable or truncated" in refusal(path) or kept > 0.9


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_not_a_mesh_at_all(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"noise{suffix}"
    path.write_bytes(bytes(range(256)) * 20)
    assert "unreadable or truncated" in refusal(path)
    path.write_text("length = 0.04\n")
    assert "unreadable or truncated" in refusal(path)


def test_missing_file_and_unknown_suffix(mesh: meshes.FingerMesh, tmp_path: Path) -> None:
    assert "no such file" in refusal(tmp_path / "nothing.vtu")
    assert "'.stl' is unknown; use .vtu or .msh" in refusal(tmp_path / "finger.stl")
    with pytest.raises(meshes.MeshError, match=r"use \.vtu or \.msh"):
        meshes.write(mesh, tmp_path / "finger.stl")
    with pytest.raises(meshes.MeshError, match="cannot write"):
        meshes.write(mesh, tmp_path / "no" / "folder" / "finger.vtu")


def broken(mesh: meshes.FingerMesh, what: str) -> meshes.FingerMesh:
    points, cells = mesh.points.copy(), mesh.cells.copy()
    if what == "nan":
        points[17, 1] = np.nan
    elif what == "inverted":
        half = cells.shape[1] // 2 if mesh.dim == 3 else 4
        for element in (12, 40):
            order = np.r_[half : 2 * half, :half] if mesh.dim == 3 else [0, 3, 2, 1]
            cells[element] = cells[element][order]
    elif what == "degenerate":
        points[cells[5, 1]] = points[cells[5, 0]]
    return dataclasses.replace(mesh, points=points, cells=cells)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize(
    ("what", "message"),
    [
        ("nan", r"1 points are not finite; the first is point 17"),
        ("inverted", r"2 of \d+ elements .*2 inverted, 0 degenerate.* element 12 "),
        ("degenerate", r"elements cannot be used .*degenerate"),
    ],
)
def test_bad_meshes(
    mesh: meshes.FingerMesh, suffix: str, what: str, message: str, tmp_path: Path
) -> None:
    path = tmp_path / f"finger{suffix}"
    meshes.write(broken(mesh, what), path)
    assert re.search(message, refusal(path))


@pytest.mark.parametrize(
    ("kind", "name", "message"),
    [
        ("node_sets", "hinge_2_proximal", "missing or empty: node set hinge_2_proximal"),
        ("node_sets", "pole", "node set pole"),
        ("facet_sets", "surface", "facet set surface"),
        ("cell_sets", "phalanx_1", r"cell sets phalanx_1, .* are missing: found \[2\]"),
        ("cell_sets", "phalanx_2", "belongs to 0 phalanges"),
    ],
)
def test_missing_sets(
    mesh: meshes.FingerMesh, kind: str, name: str, message: str, tmp_path: Path
) -> None:
    path = tmp_path / "finger.vtu"
    fewer = {key: value for key, value in getattr(mesh, kind).items() if key != name}
    meshes.write(dataclasses.replace(mesh, **{kind: fewer}), path)
    assert re.search(message, refusal(path))


def test_a_whole_body_is_told_that_its_half_is_wanted(
    mesh: meshes.FingerMesh, tmp_path: Path
) -> None:
    if mesh.dim == 2:
        pytest.skip("a plane mesh has no halves")
    meshes.write(meshes.mirrored(mesh), tmp_path / "whole.vtu")
    with pytest.raises(meshes.MeshError, match="must be the half Z >= 0"):
        meshes.read(tmp_path / "whole.vtu")


def test_foreign_file_without_sets_or_with_tetrahedra(tmp_path: Path) -> None:
    import meshio

    path = tmp_path / "foreign.vtu"
    tetrahedron = np.vstack([np.zeros(3), np.eye(3)])
    meshio.Mesh(tetrahedron, [("tetra", [[0, 1, 2, 3]])]).write(path)
    assert "holds tetra: need one block of hexahedra" in refusal(path)
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]) * 0.01
    meshio.Mesh(square, [("quad", [[0, 1, 2, 3]])]).write(path)
    assert "cell sets phalanx_1, phalanx_2, ... are missing" in refusal(path)
    bent = square + np.array([[0, 0, 0], [0, 0, 0], [0, 0, 1e-3], [0, 0, 0]])
    meshio.Mesh(bent, [("quad", [[0, 1, 2, 3]])]).write(path)
    assert "not in a plane of constant Z" in refusal(path)


def test_two_that_write_one_file_do_not_meet(
    mesh: meshes.FingerMesh, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another process writes the same file in the midst of it: each its own, the last stays."""
    path, real, others = tmp_path / "finger.vtu", meshio.vtu.write, [mesh]

    def write(partial: Path, *given: Any, **how: Any) -> None:
        real(partial, *given, **how)
        if others:
            meshes.write(others.pop(), path)

    monkeypatch.setattr(meshio.vtu, "write", write)
    meshes.write(mesh, path)
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
    np.testing.assert_array_equal(meshes.read(path).points, mesh.points)


def test_an_interrupt_leaves_no_file(
    mesh: meshes.FingerMesh, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def write(partial: Path, *given: Any, **how: Any) -> None:
        partial.write_text("half")
        raise KeyboardInterrupt

    monkeypatch.setattr(meshio.vtu, "write", write)
    with pytest.raises(KeyboardInterrupt):
        meshes.write(mesh, tmp_path / "finger.vtu")
    assert not list(tmp_path.iterdir())
