"""Bounds on parameters: declared in a field's type, checked when the object is made."""

import math
import operator
import sys
from dataclasses import dataclass, fields, is_dataclass
from numbers import Real
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

import numpy as np

# types of names and truth values; without them 1.0 would equal True, and arrays compare by element
NAME_TYPES = (str, bool, np.bool_)


@dataclass(frozen=True)
class Bound:
    """Unit and bounds of a finite number, as the metadata of an ``Annotated`` field.

    unit : SI unit, "" for a pure number. integer : whether only whole numbers are allowed.
    above, below : open bounds. at_least, at_most : closed bounds.
    advice : what is usual, or what to do instead.
    """

    unit: str = ""
    above: float = -math.inf
    at_least: float = -math.inf
    below: float = math.inf
    at_most: float = math.inf
    integer: bool = False
    advice: str = ""

    def holds(self, value: Any) -> bool:
        """Whether a value is a number within the bounds; numpy's may be, truth values may not."""
        if isinstance(value, bool):
            return False
        if not (hasattr(value, "__index__") if self.integer else isinstance(value, Real)):
            return False
        number = _plain(value)
        inside = self.above < number < self.below and self.at_least <= number <= self.at_most
        return inside and abs(number) <= sys.float_info.max  # a whole number may exceed it

    def allowed(self) -> str:
        """Describe in words what is allowed, and add the advice."""
        named = ((">", self.above), (">=", self.at_least), ("<", self.below), ("<=", self.at_most))
        bounds = " and ".join(f"{word} {bound:g}" for word, bound in named if math.isfinite(bound))
        words = "a whole number" if self.integer else "a finite number"
        words += f" in {self.unit}" if self.unit else ""
        words += f", {bounds}" if bounds else ""
        return words + (f"; {self.advice}" if self.advice else "")


def check_fields(owner: Any, error: type[ValueError] = ValueError) -> None:
    """Check every field that declares a `Bound`, a ``Literal``, a truth value or a dataclass; a
    tuple number by number.

    A ``Literal`` may be part of a union with dataclasses. None passes if it is the default.
    Numbers of numpy types are stored as plain ones.

    Raises ValueError: as `error`, naming the field, its value and what is allowed.
    """
    for field in fields(owner):
        key, value = field.name, getattr(owner, field.name)
        if value is None and field.default is None:
            continue
        bounds = getattr(field.type, "__metadata__", ())
        of: Any = field.type.__origin__ if bounds else field.type  # type: ignore[union-attr]
        members = get_args(of) if get_origin(of) in (Union, UnionType) else (of,)
        names = [n for m in members if get_origin(m) is Literal for n in get_args(m)]
        names += [False, True] if bool in members else []
        kinds = [m for m in members if isinstance(m, type) and is_dataclass(m)]
        known = isinstance(value, NAME_TYPES) and value in names
        if (names or kinds) and not (known or isinstance(value, tuple(kinds))):
            allowed = [*map(repr, names), *(f"a {kind.__name__}" for kind in kinds)]
            raise error(f"{key} = {value!r}: must be {' or '.join(allowed)}")
        if not bounds:
            continue
        many = get_origin(of) is tuple
        if many and not isinstance(value, tuple):
            raise error(f"{key} = {value!r}: must be a tuple; each {bounds[0].allowed()}")
        named = {f"{key}[{n}]": x for n, x in enumerate(value, 1)} if many else {key: value}
        for bound in bounds:
            for name, number in named.items():
                check_number(name, number, bound, error)
        kept = tuple(map(_plain, named.values()))
        object.__setattr__(owner, key, kept if many else kept[0])


def check_number(name: str, value: Any, bound: Bound, error: type[ValueError] = ValueError) -> None:
    """Raise ValueError, as `error`, if a value is not a number within the bound."""
    if not bound.holds(value):
        raise error(f"{name} = {value!r}: must be {bound.allowed()}")


def check_dim(dim: Any) -> None:
    """Raise ValueError if a number of dimensions is neither 2 nor 3."""
    if dim not in (2, 3):
        raise ValueError(f"dim = {dim!r}: must be 2 or 3")


def _plain(number: Any) -> int | float:
    """Convert to int if the number's type is an integer, else to float; inf if beyond a float."""
    try:
        return operator.index(number) if hasattr(number, "__index__") else float(number)
    except OverflowError:
        return math.inf


def check_kind(name: str, value: Any, kind: type) -> None:
    """Raise ValueError if a value is not an instance of `kind`."""
    if not isinstance(value, kind):
        raise ValueError(f"{name} = {value!r}: must be a {kind.__name__}")
