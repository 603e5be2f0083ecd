"""A run of CalculiX: what it prints, how it ended, when it is killed."""

import math
from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pytest

import meshes
import reference_fem as rf
from reference_fem.elements.geometry import CORNERS
from reference_fem.model import build_model
from tests.reference_fem.boxes import boxes
from tests.validation.commands import Patch
from validation.curve_files.solver_output import with_exponents
from validation.peers import calculix, calculix_impact
from validation.peers.calculix import COMPLETED, NOT_CONVERGED, TIMED_OUT

# As version 2.20 prints two increments of a block of two nodes.
PRINTED = """
 total force (fx,fy,fz) for set FLOOR and time  0.1000000E-04

       -1.000000E+00  0.000000E+00  0.000000E+00

 velocities (vx,vy,vz) for set BODY and time  0.1000000E-04

         1  5.000000E-01 -1.000000E+00  0.000000E+00
         2  5.000000E-01 -1.000000E+00  0.000000E+00

 total force (fx,fy,fz) for set FLOOR and time  0.3000000E-04

       -1.000000E+00  1.622533E+00  3.950000E-18

 velocities (vx,vy,vz) for set BODY and time  0.3000000E-04

         1  5.000000E-01  1.250000E+00  0.000000E+00
         2  5.000000E-01 -1.250000E-03  0.000000E+00
"""


def test_what_it_prints_is_read() -> None:
    times, forces = calculix_impact.floor_forces(PRINTED)
    assert times.tolist() == [1e-5, 3e-5]
    assert forces.tolist() == [0.0, 1.622533]
    velocity = calculix_impact.last_velocities(PRINTED)
    assert velocity.tolist() == [[0.5, 1.25, 0.0], [0.5, -0.00125, 0.0]]


def test_exponents_of_three_digits_are_read() -> None:
    """Fortran leaves out their E."""
    printed = with_exponents(" velocities (vx)\n\n 1 -1.25-103 4.0E+00 2.+101\n")
    velocity = calculix.last_vectors(printed, "velocities (vx)")
    assert velocity.tolist() == [[-1.25e-103, 4.0, 2e101]]


STRESSES = """
 stresses (elem, integ.pnt.,sxx,syy,szz,sxy,sxz,syz) for set BLOCK and time  {time}

{rows}

 total force (fx,fy,fz) for set FLOOR and time  {time}
"""


def test_elements_mean_stresses_of_the_nearest_time() -> None:
    random = np.random.default_rng(2)
    points = random.normal(size=(2, 2, 8, 6))  # times, elements, points, components
    printed = "".join(
        STRESSES.format(time=f"{time:.7E}", rows="\n".join(
            f"{e + 1:10d}{q + 1:4d} " + " ".join(f"{value:.6E}" for value in points[k, e, q])
            for e in range(2) for q in range(8)
        ))
        for k, time in enumerate((1e-5, 2e-5))
    )  # fmt: skip
    time, found = calculix_impact.stress_near(PRINTED + printed, 1.6e-5)
    assert time == 2e-5
    xx, yy, zz, xy, xz, yz = points[1].mean(axis=1).T
    np.testing.assert_allclose(found, np.stack([xx, yy, zz, xy, yz, xz], axis=1), atol=1e-6)


def test_faces_in_a_plane() -> None:
    mesh = boxes((0.04,), (0.01, 0.01), (3, 2, 2))
    plane = np.flatnonzero(mesh.points[:, 2] == mesh.points[:, 2].min())
    cells, faces = calculix_impact.faces_within(mesh.cells, plane)
    assert sorted(cells) == [c for c in range(12) if np.isin(mesh.cells[c], plane).any()]
    x, y, _ = mesh.points[faces].transpose(2, 1, 0)
    areas = 0.5 * np.abs((x * np.roll(y, -1, axis=0) - y * np.roll(x, -1, axis=0)).sum(axis=0))
    np.testing.assert_allclose(areas, areas[0])  # corners in the order of a walk around
    assert areas.sum() == pytest.approx(0.04 * 0.01)


def test_nothing_printed_is_no_force() -> None:
    times, forces = calculix_impact.floor_forces("")
    assert times.size == forces.size == 0
    assert calculix_impact.last_velocities("") is None


def test_hinges_are_equations_of_the_same_means() -> None:
    mesh = boxes((0.04, 0.03), (0.01, 0.01), (3, 2, 2))
    material = rf.Material(1e9, 0.4, 1400.0)
    settings = rf.Settings(contact="surface")
    model = build_model(mesh, (material,) * 2, rf.Surface(0.1, 0.5), rf.Drive(), settings)
    u = np.random.default_rng(1).normal(size=model.points.shape)
    text = calculix_impact.deck(model, material, 0 * u, 0 * u, 1e-3, step_s=1e-6)
    assert "*DYNAMIC,DIRECT,ALPHA=-0.05\n1e-06,0.001\n" in text
    assert "*EL PRINT" not in text
    wanted = calculix_impact.deck(model, material, 0 * u, 0 * u, 1e-3, stresses=True)
    assert wanted.endswith("\nRF\n*EL PRINT,ELSET=BLOCK\nS\n*END STEP\n")
    blocks = [block.split("\n*")[0].split("\n", 1) for block in text.split("*EQUATION\n")[1:]]
    rows = [",".join(rest.split()).split(",") for _, rest in blocks]
    terms = [np.array(row, dtype=float).reshape(-1, 3) for row in rows]
    assert [len(of) for of in terms] == [int(count) for count, _ in blocks]
    means = [of[:, 2] @ u[of[:, 0].astype(int) - 1, of[:, 1].astype(int) - 1] for of in terms]
    hinges = model.hinges
    parts = (slice(*ends) for ends in pairwise(hinges.starts))
    wanted = [hinges.weights[h] @ u[hinges.nodes[h], axis] for h in parts for axis in (0, 1)]
    np.testing.assert_allclose(means, wanted, atol=1e-11)  # 12 digits of each weight
    # a coordinate that depends on others does so once
    dependent = [tuple(of[0, :2]) for of in terms]
    assert len(set(dependent)) == len(dependent)
    assert not any(tuple(row) in dependent for of in terms for row in of[1:, :2])


def test_phalanges_weigh_and_turn_as_ours() -> None:
    shape = meshes.FingerGeometry((0.04, 0.035), (0.015, 0.012))
    mesh = meshes.finger_hexahedra(shape, meshes.Sizing(3e-3, 4e-3, 8e-4))
    material = rf.Material(1e9, 0.4, 1400.0)
    given = rf.Surface(0.1, 0.5), rf.Drive(), rf.Settings(contact="surface")
    model = build_model(mesh, (material,) * 2, *given)
    density = calculix_impact.densities(model, material)
    assert density.max() > 1.005 * material.density
    points, weights = np.polynomial.legendre.leggauss(3)  # exact for x squared in a hexahedron
    found = np.zeros((2, 4))  # m, m x, m y, m r^2 about the true mass centre
    centres = np.array([model.chain.origins[w] + model.chain.arms[w, w] for w in range(2)])
    corners = 2.0 * CORNERS[3] - 1.0
    for at, weight in zip(product(points, repeat=3), map(math.prod, product(weights, repeat=3)),
                          strict=True):  # fmt: skip
        sides = 1.0 + corners * at
        slopes = np.stack([corners[:, k] * np.delete(sides, k, 1).prod(axis=1) for k in range(3)])
        x = model.points[model.cells]
        mass = density * weight * np.linalg.det(slopes @ x / 8.0)
        body = model.body_of_point[model.cells[:, 0]]
        arm = np.einsum("a,nad->nd", sides.prod(axis=1) / 8.0, x)[:, :2] - centres[body]
        of = mass * np.stack([np.ones(len(mass)), *arm.T, (arm**2).sum(axis=1)])
        found += np.stack([np.bincount(body, row) for row in of], axis=1)
    # densities in steps of 1e-3
    np.testing.assert_allclose(found[:, 0], model.chain.mass, rtol=3e-4)
    np.testing.assert_allclose(found[:, 3], model.chain.inertia, rtol=3e-4)
    assert np.abs(found[:, 1:3] / found[:, :1]).max() < 2e-4 * 0.04
    text = calculix_impact.deck(model, material, *(np.zeros_like(model.points),) * 2, 1e-3)
    assert text.count("*SOLID SECTION") == len(np.unique(density)) + 1


@pytest.mark.parametrize(
    ("code", "said", "answer"),
    [
        (0, " Job finished\n", COMPLETED),
        (None, "", TIMED_OUT),
        (201, " *ERROR: too many cutbacks\n best solution and residuals", NOT_CONVERGED),
        (0, "no convergence", NOT_CONVERGED),
        (201, "x\n *ERROR in e_c3d: nonpositive jacobian\n", "stopped: *ERROR in e_c3d: nonpositive"
         " jacobian"),
        (-11, "", "stopped: exit code -11"),
    ],
)  # fmt: skip
def test_how_it_ended(code: int | None, said: str, answer: str) -> None:
    assert calculix.answer(code, said) == answer


def program(folder: Path, body: str) -> None:
    """A stand-in for ccx."""
    path = folder / calculix.PROGRAM
    path.write_text(f"#!/bin/sh\n{body}\n", encoding="ascii")
    path.chmod(0o755)


def test_a_run_that_takes_too_long_is_killed(tmp_path: Path, monkeypatch: Patch) -> None:
    (tmp_path / "printed").write_text(PRINTED, encoding="ascii")
    program(tmp_path, f"/bin/cp {tmp_path}/printed job.dat\nexec /bin/sleep 60")
    monkeypatch.setenv("PATH", str(tmp_path))
    ran = calculix.run_calculix("", timeout_s=0.5)
    assert (ran.answer, calculix_impact.floor_forces(ran.printed)[0].size) == (TIMED_OUT, 2)
