"""Hanging nodes: exact linear fields, kept momentum and energy, and a step that is no smaller."""

from dataclasses import replace

import numpy as np
import pytest

import meshes
import reference_fem as rf
from meshes.topology import outer_facets
from reference_fem.dynamics.step import advance, start_state
from reference_fem.elements.kinds import hex8
from reference_fem.stable_step import lanczos_frequency
from reference_fem.ties import follow, hand_on, ties_of
from tests.reference_fem.taps import GEOMETRY, SOFT, body, tap

SIZING = meshes.Sizing(4e-3, 5e-3, 8e-4, growth=1.4, patch_size=1e-3, halvings=2, full_volume=True)
MESH = meshes.finger_hexahedra(GEOMETRY, SIZING)
TIES = ties_of(MESH.ties)
NONE = np.empty(0, dtype=np.int64)


def _kernel() -> object:
    young, poisson, density = (np.full(len(MESH.cells), x) for x in (1e9, 0.4, 1400.0))
    return hex8(MESH.points, MESH.cells, young, poisson, density)


def test_a_linear_field_leaves_no_force_inside() -> None:
    """Patch test: sides of whole and of halved cells balance once forces are handed on."""
    kernel = _kernel()
    gradient = 1e-3 * np.random.default_rng(1).standard_normal((3, 3))
    field, force = MESH.points @ gradient.T, np.empty_like(MESH.points)
    followed = field.copy()
    follow(followed, np.ones(len(field)), TIES)
    assert followed == pytest.approx(field, abs=1e-16)
    kernel.internal_force(field, force)
    free = np.ones(len(field), dtype=bool)
    outside = np.concatenate([outer_facets(MESH.cells[c]) for c in MESH.cell_sets.values()])
    alone = ~np.isin(outside, MESH.ties).all(axis=1)
    free[np.unique(outside[alone])] = False
    scale = np.abs(force).max()
    assert np.abs(force[TIES.nodes]).max() > 0.01 * scale
    hand_on(force, TIES)
    assert np.isin(MESH.ties[:, 1:], np.flatnonzero(free)).any()
    assert np.abs(force[free]).max() < 1e-10 * scale


def test_mass_and_its_first_moment_are_kept() -> None:
    mass = _kernel().lumped_mass
    kept = TIES.sums(mass)
    assert kept.sum() == pytest.approx(mass.sum(), rel=1e-14)
    assert kept @ MESH.points == pytest.approx(mass @ MESH.points, rel=1e-13)
    assert (kept[TIES.nodes] == 0.0).all()


def test_the_highest_frequency_is_that_of_the_tied_mesh_and_none_above_the_free_one() -> None:
    """Against a dense eigenvalue problem T^T K T v = w^2 M v of the last phalanx's end."""
    cells = MESH.cells[MESH.cell_sets["phalanx_3"]]
    small = np.unique(MESH.cells[np.isin(MESH.cells, MESH.ties[:, 0]).any(axis=1)])
    cells = cells[np.isin(cells, small).all(axis=1)]
    nodes, local = np.unique(cells, return_inverse=True)
    inside = np.isin(MESH.ties, nodes).all(axis=1)
    ties = ties_of(np.searchsorted(nodes, MESH.ties[inside]))
    young, poisson, density = (np.full(len(cells), x) for x in (1e9, 0.4, 1400.0))
    kernel = hex8(MESH.points[nodes], local.reshape(cells.shape), young, poisson, density)
    kernel, loose = (
        replace(kernel, lumped_mass=m) for m in (ties.sums(kernel.lumped_mass), kernel.lumped_mass)
    )
    size, step = len(nodes), 1e-9
    free = np.setdiff1d(np.arange(size), ties.nodes)
    ones, stiffness = np.ones(size), np.empty((3 * size, 3 * free.size))
    for column, (node, d) in enumerate((n, d) for n in free for d in range(3)):
        u, force = np.zeros((size, 3)), np.empty((size, 3))
        u[node, d] = step
        follow(u, ones, ties)
        kernel.internal_force(u, force)
        hand_on(force, ties)
        stiffness[:, column] = force.ravel() / step
    rows = (3 * free[:, None] + np.arange(3)).ravel()
    root = np.repeat(kernel.lumped_mass[free], 3) ** -0.5
    matrix = root[:, None] * stiffness[rows] * root
    exact = np.sqrt(np.linalg.eigvalsh(0.5 * (matrix + matrix.T))[-1])
    found = lanczos_frequency(kernel, np.zeros(size), NONE, ties)
    assert exact <= found * (1 + 1e-6)
    assert found == pytest.approx(exact, rel=5e-3)
    assert exact < lanczos_frequency(loose, np.zeros(size), NONE)


def test_a_free_body_keeps_its_momenta() -> None:
    """Thrown, spinning and deformed: linear and angular momentum to rounding, energy to 1e-4."""
    last = np.asarray(MESH.cell_sets["phalanx_3"])
    nodes, local = np.unique(MESH.cells[last], return_inverse=True)
    number = np.full(len(MESH.points), -1)
    number[nodes] = np.arange(len(nodes))
    ball = replace(
        MESH,
        points=MESH.points[nodes],
        cells=local.reshape(-1, 8),
        node_sets={"pole": number[MESH.node_sets["pole"]], "symmetry": number[
            np.intersect1d(MESH.node_sets["symmetry"], nodes)]},
        facet_sets={"surface": number[MESH.facet_sets["surface"]]},
        cell_sets={"phalanx_1": np.arange(len(last))},
        ties=number[MESH.ties],
        shape=None,
    )  # fmt: skip
    model = body(ball, rf.Material(1e8, 0.3, 1000.0))
    x = model.points - model.mass @ model.points / model.mass.sum()
    velocity = np.zeros_like(x)
    velocity[:, 0], velocity[:, 1] = 1.0 - 200.0 * x[:, 1], 200.0 * x[:, 0]
    velocity += 0.3 * np.sin(300.0 * x) * [1, 1, 0]
    follow(velocity, np.ones(len(x)), model.ties)
    state = start_state(model, np.zeros_like(x), velocity, 0.0)
    linear, turning, energy = [], [], []
    for _ in range(12):
        u = state.displacement
        state, block = advance(model, state, 25, False)
        v, at = block.velocity, x + u
        linear.append(model.mass @ v[:, :2])
        turning.append(model.mass @ (at[:, 0] * v[:, 1] - at[:, 1] * v[:, 0]))
        energy.append(0.5 * model.mass @ (v * v).sum(axis=1) + block.stored_J)
    assert np.ptp(linear, axis=0).max() < 1e-12 * np.abs(linear).max()
    assert np.ptp(turning) < 1e-4 * abs(turning[0])  # of second order in the step, as the energy
    assert np.ptp(energy) < 1e-3 * energy[0]
    apart = state.displacement[model.ties.nodes]
    apart = apart - state.displacement[model.ties.of].mean(axis=1)
    assert np.abs(apart).max() < 1e-13


@pytest.mark.parametrize("law", ["impulse", "penalty", "surface"])
def test_a_tap_on_halved_cells_is_that_on_fine_blocks(law: str) -> None:
    """Peak and impulse to what the two meshes are apart; force equals the change of momentum."""
    settings = {"contact": law, "estimate": False, "penalty_factor": 1.0}
    # on edges as long as the patch's radius, those of MESH, the peak depends on where nodes lie
    sizing = replace(SIZING, tip_size=6e-4)
    fine, halved = (
        tap(meshes.finger_hexahedra(GEOMETRY, s), SOFT, **settings).summary
        for s in (replace(sizing, halvings=0), sizing)
    )
    assert halved.elements < 0.5 * fine.elements
    assert halved.peak_normal_force_N == pytest.approx(fine.peak_normal_force_N, rel=0.08)
    assert halved.normal_impulse_N_s == pytest.approx(fine.normal_impulse_N_s, rel=0.03)
    assert halved.energy_residual < 1e-3
