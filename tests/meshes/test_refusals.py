"""Sizes and shapes that cannot be meshed are refused by name, with what they would cost."""

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest

import meshes
from meshes.check import check
from tests.meshes.fingers import BUILD, FINE_TIP, PAPER, D, L

NAN, INF = math.nan, math.inf


@pytest.mark.parametrize("bad", [0.0, -1e-3, NAN, INF])
@pytest.mark.parametrize("key", ["section_size", "axial_size", "tip_size"])
def test_bad_sizes_are_refused_by_name(key: str, bad: float) -> None:
    sizes = {"section_size": 1e-3, "axial_size": 1e-3, "tip_size": 1e-3, key: bad}
    with pytest.raises(meshes.MeshError, match=f"{key} = .* in m, >= 1e-09 .*positive"):
        meshes.Sizing(**sizes)


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"contact_angle": -3.2}, "contact_angle"),
        ({"contact_angle": NAN}, "contact_angle"),
        ({"growth": 1.0}, "growth"),
        ({"growth": NAN}, "growth"),
        ({"max_elements": 0}, "max_elements"),
        ({"max_updates": NAN}, "max_updates"),
    ],
)
def test_bad_sizing_options(keywords: dict[str, float], message: str) -> None:
    with pytest.raises(meshes.MeshError, match=message):
        meshes.Sizing(1e-3, 1e-3, 1e-3, **keywords)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (((), ()), "empty"),
        (((L, L), (D,)), "2 lengths but 1 diameters"),
        (((L, -L), (D, D)), r"lengths\[2\] = -0.04"),
        (((L, NAN), (D, D)), r"lengths\[2\] = nan"),
        (((L,), (0.0,)), r"diameters\[1\]"),
        (((0.007,), (D,)), "hemispherical end alone takes 0.0075 m"),
        (((L,), (D,), "round"), "tip = 'round'"),
    ],
)
def test_bad_geometry(arguments: tuple, message: str) -> None:
    with pytest.raises(meshes.MeshError, match=message) as caught:
        meshes.FingerGeometry(*arguments)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("dim", [3, 2])
@pytest.mark.parametrize("key", ["section_size", "axial_size", "tip_size"])
def test_size_above_the_body(dim: int, key: str) -> None:
    sizes = {"section_size": 1e-3, "axial_size": 1e-3, "tip_size": 1e-3, key: 0.1}
    with pytest.raises(meshes.MeshError, match=f"{key} = 0.1 m is larger than the"):
        BUILD[dim](PAPER, meshes.Sizing(**sizes))


@pytest.mark.parametrize("dim", [3, 2])
def test_absurd_counts_are_refused_with_an_estimate_at_once(dim: int) -> None:
    with pytest.raises(meshes.MeshError, match=r"give \d.*e\+\d+ elements .* GB, .* hours"):
        BUILD[dim](PAPER, meshes.Sizing(1e-7, 1e-7, 1e-7))


def test_a_tip_so_fine_that_its_steps_take_hours_is_refused_with_an_estimate() -> None:
    fine = dataclasses.replace(FINE_TIP, tip_size=1e-6)
    with pytest.raises(meshes.MeshError, match=r"e\+05 steps.*max_updates.* GB, .* hours"):
        meshes.finger_hexahedra(PAPER, fine)
    # The finest tip that the converged truths need (0.05 mm) keeps away from the limit.
    needed = dataclasses.replace(FINE_TIP, tip_size=5e-5, growth=1.25**0.5)
    roomy = dataclasses.replace(needed, max_updates=needed.max_updates / 10)
    assert meshes.count_elements(PAPER, roomy) > 100_000


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda mesh: {"cells": mesh.cells.astype(float)}, "cells: must be whole numbers, not flo"),
        (
            lambda mesh: {"node_sets": {**mesh.node_sets, "pole": np.ones(len(mesh.points), bool)}},
            "node_sets pole: must be whole numbers, not bool",
        ),
        (
            lambda mesh: {"facet_sets": {"surface": mesh.facet_sets["surface"][:, :1]}},
            r"facet_sets surface: of shape \(\d+, 1\); must be \(n, 2\)",
        ),
        (
            lambda mesh: {"node_sets": {"pole": np.zeros((3, 1), int)}},
            r"node_sets pole: of shape \(3, 1\); must be \(n\)",
        ),
        (lambda mesh: {"points": mesh.points[:, 0]}, r"points: of shape \(\d+,\); must be"),
    ],
)
def test_arrays_that_are_no_mesh(change: Callable[..., dict], message: str) -> None:
    mesh = BUILD[2](PAPER, FINE_TIP)
    with pytest.raises(meshes.MeshError, match=message):
        dataclasses.replace(mesh, **change(mesh))


def test_a_mesh_takes_lists_and_other_kinds_of_numbers() -> None:
    mesh = BUILD[2](PAPER, FINE_TIP)
    given = dataclasses.replace(
        mesh, points=mesh.points.tolist(), cells=mesh.cells.astype(np.uint32),
        node_sets={name: nodes.tolist() for name, nodes in mesh.node_sets.items()},
    )  # fmt: skip
    np.testing.assert_array_equal(given.points, mesh.points)
    assert given.cells.dtype == np.int64
    check(given)


def test_a_set_of_another_spelling_is_missing() -> None:
    mesh = BUILD[2](PAPER, FINE_TIP)
    sets = {name.replace("_1", "_01"): cells for name, cells in mesh.cell_sets.items()}
    with pytest.raises(meshes.MeshError, match=r"cell sets phalanx_1, .* are missing: found"):
        check(dataclasses.replace(mesh, cell_sets=sets))


def test_there_are_two_and_three_dimensions_and_only_meshes_are_written() -> None:
    sizing = meshes.Sizing(4e-3, 5e-3, 4e-3)
    with pytest.raises(ValueError, match="dim = 4: must be 2 or 3"):
        meshes.count_elements(PAPER, sizing, 4)
    with pytest.raises(ValueError, match="mesh = None: must be a FingerMesh"):
        meshes.write(None, "mesh.vtu")  # type: ignore[arg-type]
