"""Memory and time that a run will need, estimated before anything is allocated."""

from hcm.parameters import Finger, ParameterError, Settings
from hcm.results.result import COLUMNS

# The largest memory that a run may need, bytes.
MEMORY_LIMIT = 4 * 2**30
# Bytes a beam element takes: its matrices, its four unknowns' vectors and band, their copies at
# `EVENT_ROWS` events of one table, and the lists that they are built from.
ELEMENT_BYTES = 20_000
# s per element and step: three Newton iterations on a 2020s core.
SECONDS_A_STEP = 1e-6
# Each value of the history, including two for each hinge, is held twice at the end.
COPIES = 2


def _memory(finger: Finger, settings: Settings) -> float:
    """Bytes that a run may need at `max_steps` steps."""
    elements = sum(p.elements for p in finger.phalanges)
    row = 8 * (len(COLUMNS) + 2 * len(finger.phalanges)) * COPIES
    frame = 8 * 4 * (elements + len(finger.phalanges)) * COPIES
    rows, frames = settings.max_steps, len(settings.frame_times)
    return float(ELEMENT_BYTES * elements + row * rows + frame * frames)


def most_steps(finger: Finger) -> int:
    """Largest `max_steps` that `check_size` accepts for a finger without frames or an end time."""
    one = _memory(finger, Settings(max_steps=1))
    row = _memory(finger, Settings(max_steps=2)) - one
    return 1 + int(max(MEMORY_LIMIT - one, 0.0) / row)


def check_size(finger: Finger, settings: Settings, start_s: float = 0.0) -> None:
    """Refuse a run that would need too much memory or too many steps.

    start_s : when it starts, s.

    Raises ParameterError: the run may need more memory than `MEMORY_LIMIT`, or more steps than
        `max_steps` allows.
    """
    elements, memory = sum(p.elements for p in finger.phalanges), _memory(finger, settings)
    if memory > MEMORY_LIMIT:
        frames = f" and {len(settings.frame_times)} frame_times" if settings.frame_times else ""
        raise ParameterError(
            f"max_steps = {settings.max_steps}, with {elements} elements{frames}, may need"
            f" {memory / 2**30:.3g} GiB: must need at most"
            f" {MEMORY_LIMIT / 2**30:g} GiB; reduce it, or the elements or frames"
        )
    if settings.end_time is None:
        return
    steps = (settings.end_time - start_s) / max(settings.flight_step, settings.contact_step)
    if steps > settings.max_steps:
        raise ParameterError(
            f"end_time = {settings.end_time!r}: asks for at least {steps:.3g} steps,"
            f" {SECONDS_A_STEP * steps * elements:.3g} s of solving: must be at most"
            f" max_steps = {settings.max_steps} steps away; raise flight_step or max_steps, or"
            " reduce end_time"
        )
