"""What a given number may be: declared beside its field, checked when its object is made."""

import math
import operator
from dataclasses import dataclass, fields
from typing import Any, Literal, get_args, get_origin


class ParameterError(ValueError):
    """A parameter lies outside what the model can compute with."""


@dataclass(frozen=True)
class Bound:
    """Unit and bounds of a finite number, as the metadata of an ``Annotated`` field.

    Parameters
    ----------
    unit : SI unit, "" for a pure number.
    above, below : open bounds.
    at_least, at_most : closed bounds.
    integer : whether only whole numbers are allowed.
    """

    unit: str = ""
    above: float = -math.inf
    at_least: float = -math.inf
    below: float = math.inf
    at_most: float = math.inf
    integer: bool = False

    def holds(self, value: Any) -> bool:
        """Whether a value is such a number; numpy's integers are whole, truth values are not."""
        if self.integer:
            if isinstance(value, bool) or not hasattr(value, "__index__"):
                return False
        elif not isinstance(value, (int, float)):
            return False
        inside = self.above < value < self.below and self.at_least <= value <= self.at_most
        return bool(inside)

    def allowed(self) -> str:
        """The words that say what is allowed."""
        named = ((">", self.above), (">=", self.at_least), ("<", self.below), ("<=", self.at_most))
        bounds = " and ".join(f"{word} {bound:g}" for word, bound in named if math.isfinite(bound))
        kind = "a whole number" if self.integer else "a finite number"
        return kind + (f" in {self.unit}" if self.unit else "") + (f", {bounds}" if bounds else "")


def check_fields(owner: Any) -> None:
    """Check every field that declares a `Bound` or a ``Literal``; a tuple's numbers one by one.

    None passes where it is the default. Whole numbers are kept as plain ints.

    Raises
    ------
    ParameterError
        Naming the field, its value and what is allowed.
    """
    for field in fields(owner):
        value = getattr(owner, field.name)
        if value is None and field.default is None:
            continue
        if get_origin(field.type) is Literal and value not in get_args(field.type):
            names = " or ".join(map(repr, get_args(field.type)))
            raise ParameterError(f"{field.name} = {value!r}: must be {names}")
        for bound in getattr(field.type, "__metadata__", ()):
            for number in value if isinstance(value, tuple) else (value,):
                if not bound.holds(number):
                    raise ParameterError(f"{field.name} = {number!r}: must be {bound.allowed()}")
            if bound.integer:
                object.__setattr__(owner, field.name, operator.index(value))
