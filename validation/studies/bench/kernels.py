"""Element updates per second of the reference on a box of 60,000: force kernels, whole steps."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from validation.harness.timing import shortest_in_turns
from validation.peers.bar import DENSITY, YOUNG, box
from validation.studies.bench.whole_step import falling_block_case

if TYPE_CHECKING:
    import pandas as pd

BOX = (100, 25, 24)  # elements along x, y, z
SHEET = (300, 200)
POISSON = 0.4
THREADS = (1, 2)
BUDGET_S = 15.0
TURNS = 60  # pieces take 5 to 60 ms


@dataclass(frozen=True)
class Speed:
    """Updates per second of one kernel on a number of threads, alone and in the whole step.

    updates_per_s, step_updates_per_s : element updates of the force, and of whole steps
    memory_MB : arrays of the model and its state
    loop_bytes : read of one element per update, nodal arrays excepted
    """

    element: str
    threads: int
    elements: int
    updates_per_s: float
    step_updates_per_s: float
    memory_MB: float
    loop_bytes: float
    runs: int


def measure_box(counts: tuple[int, ...], threads: tuple[int, ...], budget_s: float) -> list[Speed]:
    """Time the force and the whole step of every element of one dimension."""
    import numba

    from reference_fem import Material
    from reference_fem.model import ELEMENTS

    points, cells = box(counts)
    before = numba.get_num_threads()
    available = [n for n in threads if n <= numba.config.NUMBA_NUM_THREADS]

    def on(count: int, run: Callable[[], object]) -> None:
        numba.set_num_threads(count)
        run()

    material = Material(YOUNG, POISSON, DENSITY)
    built = {
        name: falling_block_case(points, cells, name, material) for name in ELEMENTS[len(counts)]
    }
    cases = [(name, count) for name in built for count in available]
    pieces = [
        partial(on, count, piece)
        for name, count in cases
        for piece in (built[name].force, built[name].step, built[name].searching_step)
    ]
    try:
        timed = shortest_in_turns(pieces, budget_s, most=TURNS)
    finally:
        numba.set_num_threads(before)
    speeds = []
    for number, (name, count) in enumerate(cases):
        force, step, search = (t.wall_time_s for t in timed[3 * number : 3 * number + 3])
        updates = built[name].steps * len(cells)
        more = max(0.0, search - step) / built[name].searches
        speeds.append(
            Speed(
                element=name,
                threads=count,
                elements=len(cells),
                updates_per_s=updates / force,
                step_updates_per_s=updates / (step + more),
                memory_MB=built[name].memory_MB,
                loop_bytes=built[name].loop_bytes,
                runs=timed[3 * number].runs,
            )
        )
    return speeds


def measure_kernels(progress: Callable[[float, str], None]) -> list[Speed]:
    """Solid hexahedra, then plane quadrilaterals."""
    progress(0.0, "hexahedra's kernels")
    solid = measure_box(BOX, THREADS, BUDGET_S)
    progress(0.8, "quadrilaterals' kernels")
    return solid + measure_box(SHEET, THREADS, BUDGET_S)


def table(speeds: list[Speed]) -> "pd.DataFrame":
    """One row a kernel and number of threads."""
    import pandas as pd

    one = {s.element: s.updates_per_s for s in speeds if s.threads == 1}
    return pd.DataFrame(
        {
            "element": s.element,
            "elements": s.elements,
            "threads": s.threads,
            "million_updates_per_s": s.updates_per_s / 1e6,
            "over_one_thread": s.updates_per_s / one[s.element],
            "million_step_updates_per_s": s.step_updates_per_s / 1e6,
            "step_over_kernel": s.updates_per_s / s.step_updates_per_s,
            "bytes_per_element": s.loop_bytes,
            "model_and_state_MB": s.memory_MB,
            "runs": s.runs,
        }
        for s in speeds
    )
