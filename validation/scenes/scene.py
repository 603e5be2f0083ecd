"""A scene: its tables, and whether they fit together."""

import math
from typing import Any, Self

from pydantic import model_validator

from validation.scenes.solver_tables import SolverTable
from validation.scenes.tables import (
    ELEMENTS_ADVICE,
    DriveTable,
    FingerTable,
    MaterialTable,
    Numbers,
    StartTable,
    SurfaceTable,
    Table,
    TipTable,
    TorqueTable,
    refuse,
)

MAX_TOTAL_ELEMENTS = 20_000  # with more, a planar beam model is no longer a reduced one
ELEMENTS = 20  # per phalanx, if neither they nor an accuracy are stated


class Scene(Table):
    """A finger, what it taps, what drives it, and how each model solves it."""

    finger: FingerTable
    material: MaterialTable
    surface: SurfaceTable
    tip: TipTable = TipTable()
    drive: DriveTable = DriveTable()
    start: StartTable = StartTable()
    solver: SolverTable = SolverTable.model_validate({})

    def per_phalanx(self, values: Numbers | tuple[int, ...] | str) -> tuple[Any, ...]:
        """One value per phalanx, whether the scene gives one or a list."""
        if isinstance(values, tuple):
            return values
        return (values,) * self.finger.phalanges

    def rows(self, *columns: Numbers | tuple[int, ...] | str) -> list[tuple[Any, ...]]:
        """A row of numbers for each phalanx."""
        return list(zip(*map(self.per_phalanx, columns), strict=True))

    @property
    def elements(self) -> tuple[float, ...]:
        """Beam elements of each phalanx; `ELEMENTS` if none are stated."""
        return self.per_phalanx(self.finger.elements or ELEMENTS)

    @property
    def tip_radius(self) -> float:
        """R of the last phalanx's round end, m."""
        return 0.5 * self.per_phalanx(self.finger.diameter)[-1]

    @property
    def smallest_diameter(self) -> float:
        """Smallest diameter of all phalanges, m."""
        return min(self.per_phalanx(self.finger.diameter))

    @property
    def total_length(self) -> float:
        """Length of the stretched finger, m."""
        return sum(self.per_phalanx(self.finger.length))

    @property
    def start_state(self) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
        """Angles (rad) and rates (rad/s) of the phalanges at the start; None: horizontal, at rest.

        None lets a solver use its own default start, to the same bits.
        """
        if self.start == StartTable():
            return None
        angles, rates = (self.per_phalanx(v or 0.0) for v in (self.start.angles, self.start.rates))
        return angles, rates

    def _start_depth(self) -> float:
        """Depth of the finger's lowest point below the fixed hinge at the start, m.

        Hinges have sections of radius R_w. At the tip the end of its axis counts: how low its round
        end reaches depends on the model.
        """
        angles, _ = self.start_state or ((0.0,) * self.finger.phalanges, ())
        depth, lowest = 0.0, 0.0
        for length, diameter, angle in self.rows(self.finger.length, self.finger.diameter, angles):
            section, before = 0.5 * diameter * abs(math.cos(angle)), depth
            depth += length * math.sin(angle)
            lowest = max(lowest, before + section, depth)
        return lowest

    @property
    def torque_rows(self) -> tuple[tuple[float, ...], ...]:
        """Joint torques, N m: one row, or one for each time of a table; zeros if none are given."""
        torques = self.drive.torques
        if isinstance(torques, TorqueTable):
            return torques.values
        return (torques or (0.0,) * self.finger.phalanges,)

    @property
    def tangential_ratio(self) -> float:
        """Tangential over normal stiffness eta^-2, by default Mindlin's 2(1 - nu)/(2 - nu)."""
        if self.tip.tangential_ratio is not None:
            return self.tip.tangential_ratio
        nu = self.per_phalanx(self.material.poisson_ratio)[-1]
        return 2 * (1 - nu) / (2 - nu)

    @model_validator(mode="after")
    def _tables_fit_together(self) -> Self:
        count = self.finger.phalanges
        for key, value in ((f"{t}.{name}", value) for t, table in self for name, value in table):
            if isinstance(value, tuple) and len(value) != count:  # every list is by phalanx
                raise refuse(
                    key,
                    list(value),
                    f"has {len(value)} numbers for {count} phalanges; "
                    f"give {count}, or change finger.phalanges",
                )
        for row in self.torque_rows:
            if len(row) != count:
                raise refuse(
                    "drive.torques.values",
                    list(row),
                    f"is a row of {len(row)} numbers for {count} phalanges; give {count}, or "
                    "change finger.phalanges",
                )
        elements = sum(self.elements)
        if elements > MAX_TOTAL_ELEMENTS:
            raise refuse(
                "finger.elements",
                self.finger.elements,
                f"asks for {elements:.0f} beam elements, {_cost(elements)}: "
                f"at most {MAX_TOTAL_ELEMENTS} are allowed; {ELEMENTS_ADVICE}",
            )
        last = self.per_phalanx(self.finger.length)[-1]
        if last <= self.tip_radius:
            raise refuse(
                "finger.length",
                self.finger.length,
                f"leaves the last phalanx {last:g} m, no longer than its round end of "
                f"{self.tip_radius:g} m: lengthen it, or reduce finger.diameter",
            )
        if self.surface.height <= (lowest := self._start_depth()):
            raise refuse(
                "surface.height",
                self.surface.height,
                f"must be > {lowest:g}: at the start the finger reaches this low, and the surface "
                "would cut it",
            )
        if self.surface.height >= self.total_length:
            raise refuse(
                "surface.height",
                self.surface.height,
                f"is never reached: the stretched finger is {self.total_length:g} m long; "
                f"set surface.height below {self.total_length:g} or lengthen finger.length",
            )
        return self


def _cost(elements: float) -> str:
    """Memory and time that the reduced model would need for this many elements."""
    from hcm.workload import ELEMENT_BYTES, SECONDS_A_STEP

    memory, step = ELEMENT_BYTES * elements / 2**30, SECONDS_A_STEP * elements
    return f"some {memory:.2g} GiB and {step:.2g} s a time step"
