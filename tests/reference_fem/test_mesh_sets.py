"""Meshes made by hand: what is no finger, or not the one that its shape says, is refused."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import meshes
import reference_fem as fem
from reference_fem.model import build_model

GEOMETRY = meshes.FingerGeometry((0.04,) * 3, (0.015,) * 3)
HALF = meshes.finger_hexahedra(GEOMETRY, meshes.SIZINGS["fast"])
FULL = meshes.mirrored(HALF)
Mesh = meshes.FingerMesh


def built(mesh: Mesh) -> None:
    material, surface = fem.Material(1e9, 0.4, 1400.0), fem.Surface(0.1, 0.5)
    build_model(mesh, (material,) * 3, surface, fem.Drive(), fem.Settings())


def nodes(mesh: Mesh, **sets: np.ndarray) -> Mesh:
    return replace(mesh, node_sets={**mesh.node_sets, **sets})


def cells(**sets: np.ndarray) -> Mesh:
    return replace(HALF, cell_sets={**HALF.cell_sets, **sets})


def no_symmetry() -> Mesh:
    kept = {name: held for name, held in HALF.node_sets.items() if name != "symmetry"}
    return replace(HALF, node_sets=kept)


PLANE = np.flatnonzero(np.abs(FULL.points[:, 2]) < 1e-9)
LARGER = meshes.FingerGeometry((0.05,) * 3, (0.025,) * 3)
ASIDE = np.array([0.0, 0.01, 0.0])
FIRST = HALF.cells[HALF.cell_sets["phalanx_1"]][:40, :4]
BAD: dict[str, tuple[Callable[[], Mesh], str]] = {
    "a full body's plane": (lambda: nodes(FULL, symmetry=PLANE), "'symmetry' must hold"),
    "half of the plane": (
        lambda: nodes(HALF, symmetry=HALF.node_sets["symmetry"][::2]), "'symmetry' must hold"
    ),
    "other nodes": (lambda: nodes(HALF, symmetry=HALF.node_sets["tip"]), "'symmetry' must hold"),
    "half a body": (no_symmetry, r"phalanx 1 has 0\.49\d* times the mass of mesh.shape's"),
    "another shape": (lambda: replace(HALF, shape=LARGER), r"phalanx 1 has 0\.28\d* times"),
    "another place": (lambda: replace(HALF, points=HALF.points + ASIDE), "0.25 of its length"),
    "one-based cells": (lambda: replace(HALF, cells=HALF.cells + 1), "cells names nodes 1"),
    "no such pole": (lambda: nodes(HALF, pole=np.array([10**6])), "'pole' names nodes 1000000"),
    "a negative pole": (lambda: nodes(HALF, pole=np.array([-1])), "'pole' names nodes -1"),
    "overlap": (lambda: cells(phalanx_2=np.arange(len(HALF.cells))), "phalanx_2: shares cells"),
    "no such cell": (lambda: cells(phalanx_2=np.array([10**6])), "'phalanx_2' names cells"),
    "another phalanx": (
        lambda: replace(HALF, facet_sets={**HALF.facet_sets, "surface": FIRST}),
        "last phalanx alone",
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", BAD)
def test_what_is_no_finger_is_refused(what: str) -> None:
    """Half and full bodies gave 28 and 124 N for 62.5 N, and were COMPLETED."""
    made, said = BAD[what]
    with pytest.raises(ValueError, match=said):
        built(made())


def test_what_is_one_is_built() -> None:
    order = np.random.default_rng(0).permutation(len(HALF.node_sets["symmetry"]))
    for mesh in (
        HALF, FULL, replace(FULL, shape=None), replace(no_symmetry(), shape=None),
        nodes(HALF, symmetry=HALF.node_sets["symmetry"][order]),
    ):  # fmt: skip
        built(mesh)


def test_a_companion_is_of_the_same_finger() -> None:
    other = meshes.finger_hexahedra(
        meshes.FingerGeometry((0.03,) * 3, (0.01,) * 3), meshes.SIZINGS["fast"]
    )
    material, surface = fem.Material(1e9, 0.4, 1400.0), fem.Surface(0.1, 0.5)
    with pytest.raises(ValueError, match="companion: its shape is not that"):
        fem.simulate(HALF, (material,) * 3, surface, fem.Drive(), companion=other)
