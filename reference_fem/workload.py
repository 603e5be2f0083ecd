"""How long a run will take, estimated before it starts."""

import math

from reference_fem.model import Model
from reference_fem.settings import Settings

# Element updates per second of one thread, of the order measured for every element (README).
UPDATES_PER_S = 1e7
YEAR_S = 365.25 * 86400.0


class TooLongError(ValueError):
    """A run would take more than `Settings.max_steps` steps."""


def check_work(model: Model, settings: Settings, start_s: float) -> None:
    """Refuse a run whose known length is more than `settings.max_steps` steps.

    The known length is the end time, or the longest explicit flight to wait for, or else the
    transit of a wave along the last phalanx, as no tap is shorter (the soft finger's contact takes
    4.2 of them in 3D, 2.0 in plane stress).

    Raises TooLongError: with the number of steps and the time that they would take.
    """
    remedy = "shorten it"
    if settings.end_time_s is not None:
        key, end = f"solver.fem.end_time = {settings.end_time_s:g}", settings.end_time_s
    elif settings.flight != "rigid":
        key, end = (
            f"solver.fem.max_flight_time = {settings.max_flight_time_s:g}",
            start_s + settings.max_flight_time_s,
        )
    else:
        key, end = f"solver.fem.step_factor = {settings.step_factor:g}", start_s + model.transit_s
        remedy = "raise it, enlarge the smallest elements"
    steps = (end - start_s) / model.step_s
    if steps > settings.max_steps:
        raise TooLongError(
            f"{key}: asks for {math.ceil(steps):.3g} steps of {model.step_s:.3g} s, about "
            f"{duration(steps * len(model.cells) / UPDATES_PER_S)} with {len(model.cells)} "
            f"elements; above solver.fem.max_steps = {settings.max_steps}: {remedy} or raise that"
        )


def duration(seconds: float) -> str:
    """A time as text, in years, days, hours or seconds, whichever is the largest that fits."""
    for unit, length in (("years", YEAR_S), ("days", 86400.0), ("hours", 3600.0)):
        if seconds >= 2.0 * length:
            return f"{seconds / length:.3g} {unit}"
    return f"{seconds:.3g} s"
