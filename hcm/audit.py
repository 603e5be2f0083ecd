"""The energy audit of a table of accepted steps."""

from __future__ import annotations

import math

from hcm.arrays import Floats
from hcm.compiled import kernel_with
from hcm.loop import COLUMNS

# Energies held, then losses, lie between these two.
KINETIC, DRIVE_WORK = COLUMNS.index("kinetic"), COLUMNS.index("drive_work")


@kernel_with()
def total_energy(row: Floats) -> float:
    """Energy held and lost, less the drive's work, J."""
    total = row[KINETIC]
    for column in range(KINETIC + 1, DRIVE_WORK):
        total += row[column]
    return total - row[DRIVE_WORK]


@kernel_with()
def largest_imbalance(start: Floats, rows: Floats) -> tuple[float, float]:
    """Largest kinetic energy and largest |energy balance| against `start`, J; NaN if any is NaN.

    start : (len(COLUMNS),) the run's first row. rows : (m, len(COLUMNS)).
    """
    kinetic, largest = start[KINETIC], 0.0
    first = total_energy(start)
    for i in range(rows.shape[0]):
        balance = abs(total_energy(rows[i]) - first)
        if not math.isfinite(balance):
            return kinetic, math.nan
        kinetic, largest = max(kinetic, rows[i, KINETIC]), max(largest, balance)
    return kinetic, largest
