"""The whole step of the reference beside its force kernel: contact, update and audits included."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from reference_fem.model import Model

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# The faces of VTK's cells that look down, outward oriented.
LOWER = {2: [0, 1], 3: [0, 1, 5, 4]}
FALL_M_PER_S = 1.0
# Of all velocities, m/s: a finger has turned, and none of its numbers is zero as before the wave in
# a body that moves along Y alone. (That costs nothing: with 240 layers of cells a step without
# noise took 0.95 to 0.98 of the time of one with it.)
NOISE = 1e-3


@dataclass(frozen=True)
class BlockCase:
    """A free block that falls on the surface, all of its lower side touching.

    Pieces of one length are timed, so that a busy moment hits them alike.

    steps : explicit steps, or calls of the force kernel, of each piece
    force : the force kernel alone
    step : the steps as a tap's window takes them, with their audit (what is recorded, and when to
        end, are not asked)
    searching_step : `step` with a search of all elements for inverted ones
    searches : one audit in so many searches
    memory_MB : arrays of model and state
    loop_bytes : what one evaluation of the force reads of one element, nodal arrays excepted
    """

    steps: int
    force: Callable[[], object]
    step: Callable[[], object]
    searching_step: Callable[[], object]
    searches: int
    memory_MB: float
    loop_bytes: float


def falling_block(points: Floats, cells: Integers, element: str, material: Any) -> "Model":
    """Model of a block without hinges right above the surface, centred about Y = 0."""
    import meshes
    import reference_fem
    from reference_fem.model import build_model

    points = points.copy()
    points[:, 1] -= points[:, 1].mean()  # the thickness of a plane model is that of a round section
    facets = cells[:, LOWER[points.shape[1]]]
    low = points[:, 1].min()
    lowest = facets[(points[facets, 1] == low).all(axis=1)]
    mesh = meshes.FingerMesh(
        points=points,
        cells=cells,
        node_sets={"pole": np.array([0])},
        facet_sets={"surface": lowest},
        cell_sets={"phalanx_1": np.arange(len(cells))},
    )
    surface = reference_fem.Surface(height=-float(low), friction=0.5)
    settings = reference_fem.Settings(element=element)
    return build_model(mesh, (material,), surface, reference_fem.Drive(), settings)


def falling_block_case(points: Floats, cells: Integers, element: str, material: Any) -> BlockCase:
    """What is timed on one mesh with one element."""
    from reference_fem.dynamics.energy import sample
    from reference_fem.dynamics.guards import FULL_SEARCH, failure
    from reference_fem.dynamics.loop import audit_interval
    from reference_fem.dynamics.step import advance, start_state
    from reference_fem.settings import Settings

    model = falling_block(points, cells, element, material)
    interval = audit_interval(model)
    velocity = NOISE * np.random.default_rng(0).standard_normal(model.points.shape)
    velocity[:, 1] -= FALL_M_PER_S
    start = start_state(model, np.zeros_like(model.points), velocity, 0.0)
    state, _ = advance(model, start, 1, True)
    force = np.empty_like(model.points)
    settings = Settings()
    energy = sample(model, state, advance(model, state, 1, True)[1], 0.0).energy_balance_J

    def steps(audits: int) -> Floats:
        after, block = advance(model, state, interval, True)
        taken = sample(model, state, block, energy)
        found = failure(model, settings, state, block, taken, taken.kinetic_energy_J, audits)
        if found is not None:
            raise RuntimeError(f"the block that is timed failed: {found}")
        return after.displacement

    def forces() -> Floats:
        for _ in range(interval):
            model.kernel.internal_force(state.displacement, force)
        return force

    return BlockCase(
        steps=interval,
        force=forces,
        step=lambda: steps(1),
        searching_step=lambda: steps(0),
        searches=FULL_SEARCH,
        memory_MB=array_bytes(model, state) / 1e6,
        loop_bytes=model.kernel.loop_bytes / len(cells),
    )


def array_bytes(*holders: object) -> int:
    """Bytes of all arrays in dataclasses, tuples and mappings, e.g. a `Model` and a `State`.

    Views count once, with the array that they look into. Workspaces count in full, though pages of
    them that are never touched take no memory.
    """
    owners: dict[int, np.ndarray] = {}
    for holder in holders:
        for array in _arrays(holder):
            while isinstance(array.base, np.ndarray):
                array = array.base
            owners[id(array)] = array
    return sum(array.nbytes for array in owners.values())


def _arrays(holder: object) -> Iterator[np.ndarray]:
    if isinstance(holder, np.ndarray):
        yield holder
    elif is_dataclass(holder) and not isinstance(holder, type):
        for field in fields(holder):
            yield from _arrays(getattr(holder, field.name))
    elif isinstance(holder, Mapping):
        for item in holder.values():
            yield from _arrays(item)
    elif isinstance(holder, tuple | list):
        for item in holder:
            yield from _arrays(item)
