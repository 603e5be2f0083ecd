"""What a given number may be: declared beside its field, checked when its object is made."""

import math
from dataclasses import dataclass, fields
from typing import Any, Literal, get_args, get_origin


@dataclass(frozen=True)
class Bound:
    """Unit and bounds of a finite number, as the metadata of an ``Annotated`` field.

    Parameters
    ----------
    unit : SI unit, "" for a pure number
    above, below : open bounds
    at_least, at_most : closed bounds
    integer : whether only whole numbers are allowed
    advice : what is usual, or what to do instead
    """

    unit: str = ""
    above: float = -math.inf
    at_least: float = -math.inf
    below: float = math.inf
    at_most: float = math.inf
    integer: bool = False
    advice: str = ""

    def holds(self, value: Any) -> bool:
        """Whether a value is such a number."""
        if isinstance(value, bool) or not isinstance(value, int if self.integer else (int, float)):
            return False
        inside = self.above < value < self.below and self.at_least <= value <= self.at_most
        return bool(inside)

    def allowed(self) -> str:
        """The words that say what is allowed, and the advice."""
        named = ((">", self.above), (">=", self.at_least), ("<", self.below), ("<=", self.at_most))
        bounds = " and ".join(f"{word} {bound:g}" for word, bound in named if math.isfinite(bound))
        words = "a whole number" if self.integer else "a finite number"
        words += f" in {self.unit}" if self.unit else ""
        words += f", {bounds}" if bounds else ""
        return words + (f"; {self.advice}" if self.advice else "")


def check_fields(owner: Any, error: type[ValueError] = ValueError) -> None:
    """Check every field that declares a `Bound`, a ``Literal`` or a truth value; a tuple's numbers
    one by one.

    A ``Literal`` may be one of a union with classes. None passes where it is the default.

    Raises
    ------
    ValueError
        As `error`, naming the field, its value and what is allowed.
    """
    for field in fields(owner):
        key, value = field.name, getattr(owner, field.name)
        if value is None and field.default is None:
            continue
        members = get_args(field.type)
        names = next((m for m in members if get_origin(m) is Literal), field.type)
        names = Literal[False, True] if field.type is bool else names
        others = tuple(m for m in members if isinstance(m, type))
        if get_origin(names) is Literal and not (
            value in get_args(names) or isinstance(value, others)
        ):
            allowed = ", ".join(map(repr, get_args(names)))
            raise error(f"{key} = {value!r}: must be one of {allowed}")
        for bound in getattr(field.type, "__metadata__", ()):
            named = {key: value}
            if isinstance(value, tuple):
                named = {f"{key}[{n}]": item for n, item in enumerate(value, start=1)}
            for name, number in named.items():
                if not bound.holds(number):
                    raise error(f"{name} = {number!r}: must be {bound.allowed()}")
