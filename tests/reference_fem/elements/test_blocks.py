"""What elements of every kind owe to blocks and threads: any number, any order, the same bits."""

import numba
import numpy as np
import pytest

import reference_fem as rf
from reference_fem.elements.blocks import Blocks
from reference_fem.elements.loops import add_force
from reference_fem.elements.threads import (
    OWN_HIGH,
    OWN_LOW,
    START,
    STOP,
    add_buffers,
    thread_shares,
    zero_forces,
)
from tests.reference_fem.boxes import boxes
from tests.reference_fem.elements.bodies import KINDS, SIZE, each_kind, force, grid


def mesh(kind: str, counts: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    return grid(*counts[: KINDS[kind][1]], distortion=0.1, seed=1)


def displacement(points: np.ndarray) -> np.ndarray:
    return 0.1 * SIZE * np.random.default_rng(2).standard_normal(points.shape)


@each_kind
@pytest.mark.parametrize("n", [1, 15, 16, 17, 33])
def test_any_number_of_elements(kind: str, n: int) -> None:
    """A mesh is the sum of its elements, whatever the last block lacks."""
    points, cells = mesh(kind, (n, 1, 1))
    u, build = displacement(points), KINDS[kind][0]
    together, singles = build(points, cells), [build(points, cells[i : i + 1]) for i in range(n)]
    expected = np.sum([force(k, u) for k in singles], axis=0)
    tolerance = 1e-12 * np.abs(expected).max()
    assert np.allclose(force(together, u), expected, rtol=0, atol=tolerance)
    total = np.sum([k.energies(u) for k in singles], axis=0)
    assert together.energies(u) == pytest.approx(total, rel=1e-12)
    assert together.min_det_F(u) == min(k.min_det_F(u) for k in singles)


@each_kind
def test_order_of_elements_does_not_matter(kind: str) -> None:
    points, cells = mesh(kind, (5, 4, 3))
    u, build = displacement(points), KINDS[kind][0]
    shuffled = build(points, np.random.default_rng(9).permutation(cells))
    f = force(build(points, cells), u)
    assert np.allclose(force(shuffled, u), f, rtol=0, atol=1e-12 * np.abs(f).max())


@numba.njit
def add_forces(blocks: Blocks, u: np.ndarray, shares: np.ndarray, t: int, out: np.ndarray) -> None:
    for block in range(shares[t, START], shares[t, STOP]):
        add_force(blocks, u, block, shares[t], t, out, None, None)


@each_kind
@pytest.mark.parametrize("threads", [1, 2, 3, 7])
@pytest.mark.parametrize("order", ["local", "random"])
def test_shares_of_any_number_of_threads_meet(kind: str, threads: int, order: str) -> None:
    """Played one after the other: what the threads do does not depend on who is first."""
    points, cells = mesh(kind, (40, 3, 2))
    build = KINDS[kind][0]
    if order == "random":
        place = np.random.default_rng(3).permutation(len(points))
        moved = np.empty_like(points)
        moved[place] = points
        points, cells = moved, np.random.default_rng(4).permutation(place[cells])
    k = build(points, cells)
    u = displacement(points)
    blocks = k.blocks._replace(
        scratch=np.zeros((threads, k.blocks.scratch.shape[1])),
        buffers=np.full((threads, *points.shape), np.nan),
    )
    shares = thread_shares(blocks.node_range, threads)
    out = np.full(points.shape, np.nan)
    for t in reversed(range(threads)):
        zero_forces(blocks, shares, t, out)
        add_forces(blocks, u, shares, t, out)
    add_buffers(blocks, shares, out)
    expected = force(k, u)
    assert np.allclose(out, expected, rtol=0, atol=1e-13 * np.abs(expected).max())
    own = (shares[:, OWN_HIGH] - shares[:, OWN_LOW]).sum() / len(points)
    assert own == 1.0 if threads == 1 else own < 1.0


@each_kind
@pytest.mark.skipif(numba.config.NUMBA_NUM_THREADS < 2, reason="one core")
def test_the_same_bits_for_one_number_of_threads(kind: str) -> None:
    points, cells = mesh(kind, (9, 7, 5))
    k, u = KINDS[kind][0](points, cells), displacement(points)
    found = {}
    for threads in (1, 2):
        numba.set_num_threads(threads)
        found[threads] = force(k, u), k.energies(u), k.min_det_F(u)
        for _ in range(20):
            assert np.array_equal(force(k, u), found[threads][0])
            assert (k.energies(u), k.min_det_F(u)) == found[threads][1:]
    tolerance = 1e-13 * np.abs(found[1][0]).max()
    assert np.allclose(found[1][0], found[2][0], rtol=0, atol=tolerance)
    assert found[1][1] == pytest.approx(found[2][1], rel=1e-12)
    assert found[1][2] == found[2][2]


@each_kind
@pytest.mark.parametrize("counts", [(9, 7, 5), (1, 1, 1)])
def test_audited_force_is_the_force_and_the_energies(
    kind: str, counts: tuple[int, int, int]
) -> None:
    points, cells = mesh(kind, counts)
    k, u = KINDS[kind][0](points, cells), displacement(points)
    out = np.full(points.shape, np.nan)
    stored = k.force(u, out, audited=True)[:2]
    expected = force(k, u)
    assert np.allclose(out, expected, rtol=0, atol=1e-13 * np.abs(expected).max())
    assert stored == k.energies(u)
    assert stored[0] > 0.0
    with pytest.raises(ValueError, match="out is"):
        k.force(u, np.empty((3, 3)), audited=True)
    u[-1, 0] = np.nan
    assert np.isnan(k.force(u, out, audited=True).stored)
    assert np.isnan(out[-1, 0])


@each_kind
def test_inverted_and_lost_elements_are_seen(kind: str) -> None:
    points, cells = mesh(kind, (5, 4, 3))
    k = KINDS[kind][0](points, cells)
    u = np.zeros(points.shape)
    assert k.min_det_F(u) == pytest.approx(1.0, rel=1e-12)
    u[cells[-1, -2]] -= 1.6 * SIZE  # the far corner passes through the element
    assert k.min_det_F(u) < 0
    u[3, 1] = np.nan
    assert np.isnan(k.min_det_F(u))
    assert np.isnan(force(k, u)).any()
    assert np.isnan(k.energies(u)[0])


@pytest.mark.skipif(numba.config.NUMBA_NUM_THREADS < 2, reason="one core")
@pytest.mark.parametrize("element", ["hex8-sri", "hex8-one-point"])
def test_a_run_on_two_threads_repeats_to_the_bit(element: str) -> None:
    """And on one thread it differs by round-off, which the tap of a soft brick hardly magnifies."""
    brick = boxes((0.02,), (0.005, 0.005), (6, 2, 2))
    soft = rf.Material(youngs_modulus=1e7, poisson_ratio=0.3, density=1000.0)
    runs = [
        rf.simulate(
            brick, (soft,), rf.Surface(height=0.01, friction=0.2), rf.Drive(gravity=9.8),
            rf.Settings(element=element, threads=threads),
        )
        for threads in (2, 2, 1)
    ]  # fmt: skip
    first, again, alone = (r.forces.normal_force_N for r in runs)
    assert np.array_equal(first, again)
    for name in ("strain_energy_J", "kinetic_energy_J", "energy_balance_J"):
        assert np.array_equal(getattr(runs[0].history, name), getattr(runs[1].history, name))
    assert np.array_equal(runs[0].snapshots[-1].displacement, runs[1].snapshots[-1].displacement)
    assert np.allclose(alone, first, rtol=0, atol=1e-6 * first.max())
