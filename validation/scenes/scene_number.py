"""What a number of a scene may be: its unit, its bounds, and the sentence that states them.

Contract: a ``SceneNumber`` stands beside a type in ``Annotated`` and is the field's entire
validation. Bounds are stated once; both the check and the error text come from them.
"""

import math
import sys
from dataclasses import dataclass
from typing import Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema


@dataclass(frozen=True)
class SceneNumber:
    """A finite number (or one per phalanx) with a unit and bounds.

    unit : SI unit, "" for a pure number.
    above, below : open bounds; at_least, at_most : closed bounds.
    integer : whether only whole numbers are allowed.
    advice : what to do instead, appended to the refusal.
    per_phalanx : whether a list with one number per phalanx is allowed.
    only_list : whether only such a list is allowed.
    per : what a list has one number for.
    or_word : a word that is allowed instead of a number, none if empty.
    """

    unit: str = ""
    above: float = -math.inf
    at_least: float = -math.inf
    below: float = math.inf
    at_most: float = math.inf
    integer: bool = False
    advice: str = ""
    per_phalanx: bool = False
    only_list: bool = False
    per: str = "phalanx"
    or_word: str = ""

    def allowed(self) -> str:
        """The sentence that says what is allowed."""
        named = ((">", self.above), (">=", self.at_least), ("<", self.below), ("<=", self.at_most))
        bounds = [f"{word} {bound:g}" for word, bound in named if math.isfinite(bound)]
        number = "whole number" if self.integer else "number"
        if self.only_list:
            kind = f"a list with one {number} per {self.per}"
        elif self.per_phalanx:
            kind = f"a {number} or a list with one per phalanx"
        else:
            kind = f"a {number}"
        return (
            f"must be {kind}"
            + (f" in {self.unit}" if self.unit else "")
            + (f", {' and '.join(bounds)}" if bounds else "")
            + (f', or "{self.or_word}"' if self.or_word else "")
        )

    def _refuse(self, value: object) -> PydanticCustomError:
        advice = self.advice
        if isinstance(value, str) and value[:1].isdigit():
            unit = f"in {self.unit}, " if self.unit else ""
            advice = f"write it as a number {unit}without unit or quotes"
        # A braced text would be read as a template: the message travels in the context.
        return PydanticCustomError(
            "quantity", "{text}", {"text": self.allowed() + (f"; {advice}" if advice else "")}
        )

    def _number(self, item: object, whole: object) -> float | int:
        if isinstance(item, bool) or not isinstance(item, int | float):
            raise self._refuse(whole if not isinstance(item, str) else item)
        if self.integer and not isinstance(item, int):
            raise self._refuse(whole)
        inside = self.above < item < self.below and self.at_least <= item <= self.at_most
        if not inside or abs(item) > sys.float_info.max:  # a whole number may be longer
            raise self._refuse(whole)
        return item if self.integer else float(item)

    def check(self, value: object) -> float | int | str | tuple[float | int, ...]:
        """Return the checked value, or raise a refusal."""
        if isinstance(value, str) and value and value == self.or_word:
            return value
        if isinstance(value, list | tuple):
            if not (self.per_phalanx or self.only_list) or not value:
                raise self._refuse(value)
            return tuple(self._number(item, value) for item in value)
        if self.only_list:
            raise self._refuse(value)
        return self._number(value, value)

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.check)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        bounds = {
            "exclusiveMinimum": self.above,
            "minimum": self.at_least,
            "exclusiveMaximum": self.below,
            "maximum": self.at_most,
        }
        number: JsonSchemaValue = {"type": "integer" if self.integer else "number"}
        number |= {word: bound for word, bound in bounds.items() if math.isfinite(bound)}
        several = {"type": "array", "items": number, "minItems": 1}
        kinds = [number] * (not self.only_list) + [several] * (self.per_phalanx or self.only_list)
        kinds += [{"const": self.or_word}] * bool(self.or_word)
        unit = {"unit": self.unit} if self.unit else {}
        return (kinds[0] if len(kinds) == 1 else {"anyOf": kinds}) | unit


@dataclass(frozen=True)
class OrTable(SceneNumber):
    """A number as above, or a table that says more."""

    table: Any = None

    def check(self, value: object) -> Any:
        """Return the checked value or the table made from it, or raise a refusal."""
        if isinstance(value, dict):
            return self.table.model_validate(value)
        return value if isinstance(value, self.table) else super().check(value)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        plain = super().__get_pydantic_json_schema__(schema, handler)
        unit = {"unit": plain.pop("unit")} if "unit" in plain else {}
        return {"anyOf": [plain, handler(self.table.__pydantic_core_schema__)]} | unit


@dataclass(frozen=True)
class Rows:
    """A list of rows, each of which is checked as a list by `row`."""

    row: SceneNumber

    def _check(self, value: object) -> tuple[Any, ...]:
        if not isinstance(value, list | tuple) or not value:
            kind = "must be a list of rows, one per time; each"
            raise PydanticCustomError(
                "quantity", "{text}", {"text": f"{kind} {self.row.allowed()}"}
            )
        return tuple(self.row.check(row) for row in value)

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self._check)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        row = self.row.__get_pydantic_json_schema__(schema, handler)
        unit = {"unit": row.pop("unit")} if "unit" in row else {}
        return {"type": "array", "items": row, "minItems": 1} | unit
