"""Bounds on parameters: declared in a field's type, checked when the object is made."""

import math
import operator
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from numbers import Real
from typing import Any, Literal, get_args, get_origin

import numpy as np

PLAIN = {float, int}
# types of names and truth values; without them 1.0 would equal True, and arrays compare by element
NAME_TYPES = (str, bool, np.bool_)


class ParameterError(ValueError):
    """A parameter lies outside what the model can compute with."""


@dataclass(frozen=True)
class Bound:
    """Unit and bounds of a finite number, as the metadata of an ``Annotated`` field.

    unit : SI unit, "" for a pure number. integer : whether only whole numbers are allowed.
    above, below : open bounds. at_least, at_most : closed bounds.
    """

    unit: str = ""
    above: float = -math.inf
    at_least: float = -math.inf
    below: float = math.inf
    at_most: float = math.inf
    integer: bool = False

    def interval(self) -> tuple[float, float]:
        """Smallest and largest float allowed."""
        least, most = math.nextafter(self.above, math.inf), math.nextafter(self.below, -math.inf)
        return max(self.at_least, least), min(self.at_most, most)

    def holds(self, value: Any) -> bool:
        """Whether a value is a number within the bounds; numpy's may be, truth values may not."""
        # in this order: the check against an abstract class costs ten times the rest
        plain = value.__class__ in PLAIN
        if not (plain or isinstance(value, Real)) or isinstance(value, bool):
            return False
        if self.integer and not hasattr(value, "__index__"):
            return False
        number = value if plain else _plain(value)
        low, high = self.interval()
        return low <= number <= high

    def allowed(self) -> str:
        """Describe in words what is allowed."""
        named = ((">", self.above), (">=", self.at_least), ("<", self.below), ("<=", self.at_most))
        bounds = " and ".join(f"{word} {bound:g}" for word, bound in named if math.isfinite(bound))
        kind = "a whole number" if self.integer else "a finite number"
        return kind + (f" in {self.unit}" if self.unit else "") + (f", {bounds}" if bounds else "")


def check_fields(owner: Any) -> None:
    """Check every field that declares a `Bound`, a ``Literal``, a truth value or a dataclass; a
    tuple item by item.

    None passes if it is the default. Numbers, numpy's included, are stored as int where the bound
    asks for whole ones, else as float.

    Raises ParameterError: naming the field, its value and what is allowed.
    """
    for name, default, bounds, names, kinds, many, plain, low, high in _declared(owner.__class__):
        value = getattr(owner, name)
        if value.__class__ is plain and low <= value <= high:  # as most are
            continue
        if value is None and default is None:
            continue
        if names and not (isinstance(value, NAME_TYPES) and value in names):
            allowed = " or ".join(map(repr, names))
            raise ParameterError(f"{name} = {value!r}: must be {allowed}")
        if many and not isinstance(value, tuple):
            each = [bound.allowed() for bound in bounds] + [f"a {kind.__name__}" for kind in kinds]
            raise ParameterError(f"{name} = {value!r}: must be a tuple; each {', '.join(each)}")
        parts = value if many else (value,)
        for part in parts:
            for kind in kinds:
                check_kind(name, part, kind)
            for bound in bounds:
                if not bound.holds(part):
                    raise ParameterError(f"{name} = {part!r}: must be {bound.allowed()}")
        # kernels are compiled for int or for float
        if bounds and not {plain}.issuperset(map(type, parts)):
            kept = tuple(map(plain, parts))
            object.__setattr__(owner, name, kept if many else kept[0])


def _plain(number: Any) -> int | float:
    """Convert to int if the number's type is an integer, else to float; inf if beyond a float."""
    try:
        return operator.index(number) if hasattr(number, "__index__") else float(number)
    except OverflowError:
        return math.inf


def check_kind(name: str, value: Any, kind: type) -> None:
    """Raise `ParameterError` if a value is not an instance of `kind`."""
    if not isinstance(value, kind):
        raise ParameterError(f"{name} = {value!r}: must be a {kind.__name__}")


@cache
def _declared(owner: type) -> tuple[tuple[Any, ...], ...]:
    """Of each field that declares any: name, default, bounds, allowed values and dataclasses,
    whether it is a tuple, the type that its numbers are stored as, and the range of a single one.
    """
    found = []
    for each in fields(owner):
        bounds = getattr(each.type, "__metadata__", ())
        of: Any = each.type.__origin__ if bounds else each.type  # type: ignore[union-attr]
        members = get_args(of) or (of,)
        names = members if get_origin(of) is Literal else (False, True) if bool in members else ()
        kinds = tuple([m for m in members if isinstance(m, type) and is_dataclass(m)])
        if names or bounds or kinds:
            plain = (int if bounds[0].integer else float) if bounds else None
            many = get_origin(of) is tuple
            low, high = bounds[0].interval() if bounds and not many else (math.inf, -math.inf)
            found.append((each.name, each.default, bounds, names, kinds, many, plain, low, high))
    return tuple(found)
