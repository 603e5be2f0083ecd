"""What a given number may be: declared beside its field, checked when its object is made."""

import math
import operator
from dataclasses import dataclass, fields
from functools import cache
from numbers import Real
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
        """Whether a value is such a number; numpy's are, truth values are not."""
        if isinstance(value, bool):
            return False
        if not (hasattr(value, "__index__") if self.integer else isinstance(value, Real)):
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
    """Check every field that declares a `Bound`, a ``Literal`` or a truth value; a tuple's numbers
    one by one.

    None passes where it is the default. Numbers of numpy's are kept as plain ones.

    Raises
    ------
    ParameterError
        Naming the field, its value and what is allowed.
    """
    for name, default, bounds, names, many in _declared(owner.__class__):
        value = getattr(owner, name)
        if value is None and default is None:
            continue
        if names and value not in names:
            allowed = " or ".join(map(repr, names))
            raise ParameterError(f"{name} = {value!r}: must be {allowed}")
        for bound in bounds:
            if many and not isinstance(value, tuple):
                raise ParameterError(f"{name} = {value!r}: must be a tuple; each {bound.allowed()}")
            for number in value if many else (value,):
                if not bound.holds(number):
                    raise ParameterError(f"{name} = {number!r}: must be {bound.allowed()}")
            kept = tuple(map(_plain, value)) if many else _plain(value)
            object.__setattr__(owner, name, kept)


def _plain(number: Any) -> int | float:
    """The same number, an int where it is whole by its kind, else a float."""
    return operator.index(number) if hasattr(number, "__index__") else float(number)


def check_kind(name: str, value: Any, kind: type) -> None:
    """Raise `ParameterError` where a value is no `kind`."""
    if not isinstance(value, kind):
        raise ParameterError(f"{name} = {value!r}: must be a {kind.__name__}")


@cache
def _declared(
    kind: type,
) -> tuple[tuple[str, Any, tuple[Bound, ...], tuple[Any, ...], bool], ...]:
    """Name, default, bounds and allowed values of the fields that declare any; whether a tuple."""
    found = []
    for field in fields(kind):
        names = get_args(field.type) if get_origin(field.type) is Literal else ()
        if field.type is bool or bool in get_args(field.type):
            names = (False, True)
        bounds = getattr(field.type, "__metadata__", ())
        if names or bounds:
            many = get_origin(getattr(field.type, "__origin__", None)) is tuple
            found.append((field.name, field.default, bounds, names, many))
    return tuple(found)
