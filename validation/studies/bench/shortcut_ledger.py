"""The skip ledger's lines: what a shortcut saves in time and what it changes in the result."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

NAMES = ("peak_normal_force_N", "normal_impulse_N_s", "contact_duration_s")


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

    frame = pd.DataFrame([asdict(entry) for entry in entries])
    frame.insert(frame.columns.get_loc("peak_change"), "speedup", [e.speedup for e in entries])
    return frame
