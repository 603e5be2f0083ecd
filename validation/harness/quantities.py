"""The scalars of a run, with key, title and unit: the rows of every list and table.

A key is its name in ``RunRecord.summary`` and in JSON, and ends in the SI unit of its value. Tables
for people show it with a prefix: ``contact_duration_s`` in us.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from validation.harness.uncertainty import DIGITS

# As in `hcm.results.dataset`, which is not imported: the reference must not depend on hcm.
UNITS = (  # endings of names, longest first, and the unit that they stand for
    ("_m_per_s", "m/s"), ("_N_s", "N s"), ("_Pa", "Pa"), ("_MB", "MB"), ("_m2", "m2"),
    ("_N", "N"), ("_J", "J"), ("_m", "m"), ("_s", "s"),
)  # fmt: skip
FACTORS = {"": 1.0, "m": 1e3, "u": 1e6, "n": 1e9, "M": 1e-6}  # by the units' prefixes


def unit_of(name: str) -> str:
    """The unit that a name ends in, "1" if it has none."""
    return next((unit for ending, unit in UNITS if name.endswith(ending)), "1")


def finite(number: float | None) -> float | None:
    """A scalar as a finite float, or None."""
    return None if number is None or not math.isfinite(number) else float(number)


class Scalars(Protocol):
    """A run's scalars by their keys, such as a `RunRecord` has."""

    @property
    def summary(self) -> Mapping[str, Any]:
        """Scalars in SI units; None for those that the run lacks."""

    @property
    def errors(self) -> Mapping[str, Any]:
        """Estimated absolute errors of the scalars."""


@dataclass(frozen=True)
class Quantity:
    """A scalar of a run.

    key : its name; in ``RunRecord.summary`` too, unless it is a component.
    title : its name in tables and pages.
    prefix : of the unit shown there, a key of ``FACTORS``.
    component_of : key of the vector in the summary, and the axis; None for a scalar of its own.
    solid : whether only the finite-element models have it.
    digits : number of digits shown if no error is stated.
    """

    key: str
    title: str
    prefix: str = ""
    component_of: tuple[str, int] | None = None
    solid: bool = False
    digits: int = 4

    @property
    def parts(self) -> tuple["Quantity", ...]:
        """The components of a vector, else itself."""
        return COMPONENTS if self.key == TIP_VELOCITY else (self,)

    @property
    def unit(self) -> str:
        """The unit that tables show, empty for a pure number."""
        unit = unit_of(self.key)
        return "" if unit == "1" else self.prefix + unit

    @property
    def factor(self) -> float:
        """Ratio of the shown number to the one in SI units."""
        return FACTORS[self.prefix]

    def value(self, record: Scalars | None) -> float | None:
        """The value in SI units; None without a run, or if it has none."""
        return None if record is None else finite(self._of(record.summary))

    def stated(self, record: Scalars | None) -> float | None:
        """Estimated error in SI units, may be infinite; None if there is no estimate."""
        return None if record is None else self._of(record.errors)

    def error(self, record: Scalars | None) -> float | None:
        """Estimated error in the shown unit."""
        error = self.stated(record)
        return None if error is None else self.factor * error

    def _of(self, table: Mapping[str, Any]) -> float | None:
        if self.component_of is None:
            return table.get(self.key)
        vector, axis = self.component_of
        components = table.get(vector)
        return None if components is None else components[axis]

    def read(self, record: Scalars | None) -> float | None:
        """The value in the shown unit; None without a run, or if it has none."""
        value = self.value(record)
        return None if value is None else self.factor * value


TIP_VELOCITY = "tip_velocity_at_contact_m_per_s"
QUANTITIES = (  # in the order of JSON and of the terminal
    Quantity("contact_time_s", "time of first contact", "m"),
    Quantity(TIP_VELOCITY, "tip velocity at contact"),
    Quantity("peak_normal_force_N", "peak Fn"),
    Quantity("peak_normal_force_time_s", "time of peak Fn after contact", "u"),
    Quantity("first_peak_normal_force_N", "first peak Fn"),
    Quantity("peak_tangential_force_N", "peak Ft"),
    Quantity("contact_duration_s", "contact duration", "u"),
    Quantity("normal_impulse_N_s", "normal impulse", "m"),
    Quantity("compression_to_restitution", "compression to restitution", digits=DIGITS),
    Quantity("stick_to_slip", "stick to slip", digits=DIGITS),
    Quantity("slip_to_stick", "slip to stick", digits=DIGITS),
    Quantity("reverse_slip", "reverse slip"),
    Quantity("peak_stress_R_Pa", "peak stress at R", "M"),
    Quantity("energy_residual", "energy residual", digits=2),
    Quantity("wall_time_s", "solve time", digits=3),
    Quantity("peak_memory_MB", "peak memory", digits=3),
    Quantity("steps", "steps", digits=DIGITS),
    Quantity("elements", "elements", solid=True, digits=DIGITS),
    Quantity("time_step_s", "time step", "n", solid=True),
)
COMPONENTS = (
    Quantity("tip_velocity_x_m_per_s", "tip velocity vx at contact", "", (TIP_VELOCITY, 0)),
    Quantity("tip_velocity_y_m_per_s", "tip velocity vy at contact", "", (TIP_VELOCITY, 1)),
)
ESTIMATED = (  # scalars for which a run states errors
    *("contact_time_s", TIP_VELOCITY, "peak_normal_force_N", "peak_normal_force_time_s"),
    *("peak_tangential_force_N", "contact_duration_s", "normal_impulse_N_s", "peak_stress_R_Pa"),
)
SUMMARY_KEYS = tuple(entry.key for entry in QUANTITIES if not entry.solid)
SOLID_KEYS = tuple(entry.key for entry in QUANTITIES if entry.solid)


_BY_KEY = {entry.key: entry for entry in QUANTITIES + COMPONENTS}


def quantity(key: str) -> Quantity:
    """The quantity with this key; raises KeyError if there is none."""
    return _BY_KEY[key]


def quantities(*keys: str) -> tuple[Quantity, ...]:
    """The quantities with these keys, in this order."""
    return tuple(quantity(key) for key in keys)


OF_A_TAP = quantities("peak_normal_force_N", "normal_impulse_N_s", "contact_duration_s")
TAP_AND_STRESS = (*OF_A_TAP, *quantities("peak_stress_R_Pa"))
OF_THE_FLIGHT = quantities("contact_time_s", "tip_velocity_x_m_per_s", "tip_velocity_y_m_per_s")
COMPARED = (  # quantities by which two models are compared
    *quantities("peak_normal_force_N", "peak_tangential_force_N", "normal_impulse_N_s"),
    *quantities("contact_duration_s", "peak_normal_force_time_s"),
    *OF_THE_FLIGHT,
    *quantities("peak_stress_R_Pa"),
)
