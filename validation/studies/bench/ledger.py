"""A line of the skip ledger: what a shortcut saves in time and what it changes in the result."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

NAMES = ("peak_normal_force_N", "normal_impulse_N_s", "contact_duration_s")
# hcm's settings that the ledger is measured with: error control, the cheapest mesh.
CONTROLLED = (
    "solver.hcm.flight_step=1e-3",
    "solver.hcm.flight_tolerance=1e-7",
    "solver.hcm.contact_step=1e-5",
    "solver.hcm.contact_tolerance=1e-9",
)
FIVE = ("finger.elements=5",)


@dataclass(frozen=True)
class Entry:
    """One line of the ledger; times in s, errors relative, None where there is no switch."""

    shortcut: str
    model: str
    switched_off_by: str
    time_with_s: float | None = None
    time_without_s: float | None = None
    peak_change: float | None = None
    impulse_change: float | None = None
    duration_change: float | None = None
    note: str = ""

    @property
    def speedup(self) -> float | None:
        """Time without the shortcut over the time with it."""
        if self.time_with_s is None or self.time_without_s is None:
            return None
        return self.time_without_s / self.time_with_s

    @property
    def largest_change(self) -> float | None:
        """The largest relative change of peak, impulse and duration; None if there is none."""
        changes = (self.peak_change, self.impulse_change, self.duration_change)
        return max((change for change in changes if change is not None), default=None)


def changes(with_it: Any, without: Any) -> tuple[float, float, float]:
    """Relative changes of peak, impulse and duration between two runs' summaries."""
    peak, impulse, duration = (
        abs(getattr(with_it, name) / getattr(without, name) - 1.0) for name in NAMES
    )
    return peak, impulse, duration


def table(entries: Sequence[Entry]) -> "pd.DataFrame":
    """One row a shortcut."""
    import pandas as pd

    return pd.DataFrame(
        {
            "shortcut": e.shortcut,
            "model": e.model,
            "switched_off_by": e.switched_off_by,
            "time_with_s": e.time_with_s,
            "time_without_s": e.time_without_s,
            "speedup": e.speedup,
            "peak_change": e.peak_change,
            "impulse_change": e.impulse_change,
            "duration_change": e.duration_change,
            "note": e.note,
        }
        for e in entries
    )
