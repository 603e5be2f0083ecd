"""What a work-precision point is: what was run, what it cost, how far it is from the truth."""

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from validation.compare.tap_errors import TapErrors

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd


@dataclass(frozen=True)
class Point:
    """One setting of one solver. A run that failed has a status, and no errors."""

    study: str
    solver: str
    series: str
    setting: str
    status: str
    wall_time_s: float
    runs: int
    steps: int | None = None
    errors: TapErrors | None = None

    @property
    def ok(self) -> bool:
        """Whether there is a time and an error to draw."""
        return self.errors is not None and math.isfinite(self.wall_time_s)

    def row(self) -> dict[str, Any]:
        """One row of the table."""
        values = asdict(self)
        values.pop("errors")
        names = ("peak", "impulse", "duration", "event_s")
        found = {name: getattr(self.errors, name, None) for name in names}
        return {
            **values,
            "peak_error": found["peak"],
            "impulse_error": found["impulse"],
            "duration_error": found["duration"],
            "event_error_s": found["event_s"],
        }


def front(points: "Sequence[Point]", quantity: str) -> list[tuple[float, float]]:
    """Time and error of the settings that no other one beats in both, by rising time."""
    found: list[tuple[float, float]] = []
    pairs = sorted((p.wall_time_s, float(getattr(p.errors, quantity))) for p in points if p.ok)
    for time, error in pairs:
        if not found or error < found[-1][1]:
            found.append((time, error))
    return found


def table(points: "Sequence[Point]") -> "pd.DataFrame":
    """The points, one a row."""
    import pandas as pd

    return pd.DataFrame([point.row() for point in points])
