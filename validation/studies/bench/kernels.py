"""Element updates per second of the reference on a box of 60,000: force kernels, whole steps.

A whole step comprises contact, update and audits as well as the force.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import partial
from typing import Any

import numba
import numpy as np

import reference_fem as fem
from reference_fem.dynamics.energy import sample
from reference_fem.dynamics.guards import FULL_SEARCH, failure
from reference_fem.dynamics.loop import audit_interval
from reference_fem.dynamics.state import LoopState
from reference_fem.dynamics.step import advance, start_state
from reference_fem.model import ELEMENTS, Model
from validation.harness.timing import shortest_in_turns
from validation.models.adapter import Progress
from validation.peers.bar import DENSITY, YOUNG, Floats, Integers, box
from validation.peers.own_bar import box_model

BOX = (100, 25, 24)  # elements along x, y, z
SHEET = (300, 200)
POISSON = 0.4
THREADS = (1, 2)
BUDGET_S = 15.0
TURNS = 60  # pieces take 5 to 60 ms
FALL_M_PER_S = 1.0
# Added to all velocities, m/s: a finger has turned and none of its numbers is zero, unlike those
# before the wave in a body that moves along Y alone. (It hardly matters: with 240 layers of cells a
# step without noise took 0.95 to 0.98 of the time of one with it.)
NOISE = 1e-3


@dataclass(frozen=True)
class Speed:
    """Element updates per second of one kernel on a number of threads, alone and in whole steps.

    over_one_thread : how many times as fast as on one thread
    step_over_kernel : time of a whole step over that of its force
    bytes_per_element : read by one evaluation of the force, nodal arrays excepted
    """

    element: str
    elements: int
    threads: int
    million_updates_per_s: float
    over_one_thread: float
    million_step_updates_per_s: float
    step_over_kernel: float
    bytes_per_element: float
    model_and_state_MB: float
    runs: int


@dataclass(frozen=True)
class BlockCase:
    """A free block that falls on the surface, all of its lower side touching.

    steps : explicit steps, or calls of the force kernel, of each piece
    pieces : of one length, so that a busy moment affects them alike: the force kernel alone; the
        steps as a tap's window takes them, with their audit (but no records and no test for the
        end); the same with a search of all elements for inverted ones, as one audit in
        `FULL_SEARCH` has it
    """

    steps: int
    pieces: tuple[Callable[[], object], ...]
    bytes_per_element: float
    model_and_state_MB: float


def falling_block(points: Floats, cells: Integers, element: str, material: fem.Material) -> Model:
    """Model of a block without hinges just above the surface, centred about Y = 0."""
    points = points.copy()
    points[:, 1] -= points[:, 1].mean()  # the thickness of a plane model is that of a round section
    surface = fem.Surface(height=-float(points[:, 1].min()), friction=0.5)
    settings = fem.Settings(element=element)
    return box_model(points, cells, material, surface, fem.Drive(), settings)


def falling_block_case(
    points: Floats, cells: Integers, element: str, material: fem.Material
) -> BlockCase:
    """The case to be timed on one mesh with one element."""
    model = falling_block(points, cells, element, material)
    interval = audit_interval(model)
    velocity = NOISE * np.random.default_rng(0).standard_normal(model.points.shape)
    velocity[:, 1] -= FALL_M_PER_S
    start = start_state(model, np.zeros_like(model.points), velocity, 0.0)
    state, _ = advance(model, start, 1, True)
    force = np.empty_like(model.points)
    settings = fem.Settings()
    energy = sample(model, state, advance(model, state, 1, True)[1], 0.0).energy_balance_J

    def steps(audits: int) -> Floats:
        after, block = advance(model, state, interval, True)
        taken = sample(model, state, block, energy)
        now = LoopState(state, 0.0, largest_kinetic_J=taken.kinetic_energy_J, audits=audits)
        found = failure(model, settings, now, block, taken)
        if found is not None:
            raise RuntimeError(f"the block that is timed failed: {found}")
        return after.displacement

    def forces() -> Floats:
        for _ in range(interval):
            model.kernel.internal_force(state.displacement, force)
        return force

    return BlockCase(
        steps=interval,
        pieces=(forces, partial(steps, 1), partial(steps, 0)),
        bytes_per_element=model.kernel.loop_bytes / len(cells),
        model_and_state_MB=array_bytes(model, state) / 1e6,
    )


def array_bytes(*holders: object) -> int:
    """Bytes of all arrays in dataclasses, tuples and mappings, e.g. a `Model` and a `State`.

    Views count once, with the array that they look into. Workspaces count in full, though pages of
    them that are never touched take no memory.
    """
    owners: dict[int, np.ndarray] = {}
    left: list[Any] = list(holders)
    while left:
        holder = left.pop()
        if isinstance(holder, np.ndarray):
            while isinstance(holder.base, np.ndarray):
                holder = holder.base
            owners[id(holder)] = holder
        elif is_dataclass(holder) and not isinstance(holder, type):
            left += [getattr(holder, field.name) for field in fields(holder)]
        elif isinstance(holder, Mapping):
            left += holder.values()
        elif isinstance(holder, tuple | list):
            left += holder
    return sum(array.nbytes for array in owners.values())


def measure_box(counts: tuple[int, ...], threads: tuple[int, ...], budget_s: float) -> list[Speed]:
    """Time the force and the whole step of every element of one dimension, one thread first."""
    points, cells = box(counts)
    before = numba.get_num_threads()
    available = [n for n in threads if n <= numba.config.NUMBA_NUM_THREADS]

    def on(count: int, run: Callable[[], object]) -> None:
        numba.set_num_threads(count)
        run()

    built = {
        name + ", neo-Hookean" * (law == fem.NEO_HOOKE): falling_block_case(
            points, cells, name, fem.Material(YOUNG, POISSON, DENSITY, law=law)
        )
        for name, law in ELEMENTS[len(counts)]
    }
    cases = [(name, count) for name in built for count in available]
    pieces = [partial(on, count, piece) for name, count in cases for piece in built[name].pieces]
    try:
        timed = shortest_in_turns(pieces, budget_s, most=TURNS)
    finally:
        numba.set_num_threads(before)
    one: dict[str, float] = {}
    speeds = []
    for number, (name, count) in enumerate(cases):
        block, (force, step, search) = built[name], timed[3 * number : 3 * number + 3]
        updates = block.steps * len(cells)
        more = max(0.0, search.wall_time_s - step.wall_time_s) / FULL_SEARCH
        alone = updates / force.wall_time_s
        whole = updates / (step.wall_time_s + more)
        speeds.append(
            Speed(
                element=name,
                elements=len(cells),
                threads=count,
                million_updates_per_s=alone / 1e6,
                over_one_thread=alone / one.setdefault(name, alone),
                million_step_updates_per_s=whole / 1e6,
                step_over_kernel=alone / whole,
                bytes_per_element=block.bytes_per_element,
                model_and_state_MB=block.model_and_state_MB,
                runs=force.runs,
            )
        )
    return speeds


def measure_kernels(progress: Progress) -> list[Speed]:
    """Measure solid hexahedra, then plane quadrilaterals."""
    progress(0.0, "hexahedra's kernels")
    solid = measure_box(BOX, THREADS, BUDGET_S)
    progress(0.8, "quadrilaterals' kernels")
    return solid + measure_box(SHEET, THREADS, BUDGET_S)
