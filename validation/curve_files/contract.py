"""The contract of a reader: a file's text and the `Sidecar` beside it in, `Samples` out.

The sidecar says what a file of curves doesn't say by itself: ``NAME.toml``, NAME with its ending.
"""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, ValidationError, create_model
from pydantic_core import PydanticCustomError

from validation.errors import UserError
from validation.harness.quantities import ESTIMATED, TIP_VELOCITY
from validation.harness.record import Floats
from validation.harness.record_schema import LARGEST, SIGNED
from validation.models.curves import TIMES
from validation.scenes.load import read_toml
from validation.scenes.messages import one_line, show
from validation.scenes.scene_number import SceneNumber
from validation.scenes.tables import Table

FACTORS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "N": 1.0, "kN": 1e3, "mN": 1e-3}  # to SI
LARGEST_SAMPLE = 1e12  # s, N: nothing of a tap is larger
Interface = Annotated[str | None, BeforeValidator(lambda v: f"{v}" if type(v) is int else v)]
Axis = Literal["x", "-x", "y", "-y", "z", "-z"]


def _scalar(key: str) -> SceneNumber:
    """What a tap's number may be: all but the signed ones are positive where there is a tap."""
    if key in (TIP_VELOCITY, *SIGNED):
        return SceneNumber(at_least=-LARGEST, at_most=LARGEST)
    if key in TIMES:
        return SceneNumber(at_least=0.0, at_most=LARGEST)
    return SceneNumber(above=0.0, at_most=LARGEST)


def _pair(value: object) -> object:
    if not isinstance(value, list) or len(value) != 2:
        text = "must be a list of two numbers, [x, y]"
        raise PydanticCustomError("quantity", "{text}", {"text": text})
    return value


def _numbers(bounds: Callable[[str], SceneNumber]) -> Any:
    """A table of a tap's numbers by their keys, SI units."""
    fields: Any = {}
    for key in ESTIMATED:
        one: Any = Annotated[float, bounds(key)]
        two = Annotated[list[one], BeforeValidator(_pair)]
        fields[key] = (two if key == TIP_VELOCITY else one, None)
    return create_model("Numbers", __base__=Table, **fields)


if TYPE_CHECKING:
    Scalars = BaseModel
    Errors = BaseModel
else:
    Scalars = _numbers(_scalar)
    Errors = _numbers(lambda _: SceneNumber(at_least=0.0, at_most=LARGEST))


class Sidecar(Table):
    """The keys of ``NAME.toml``. Axes: F_n pushes the tip up, F_t acts on it along +X."""

    scene: str | None = None  # that the curves belong to
    source: str = ""  # whose they are, in words
    time_offset_s: Annotated[
        float, SceneNumber("s", at_least=-LARGEST_SAMPLE, at_most=LARGEST_SAMPLE)
    ] = 0.0  # the file's time as the motion starts
    half_model: bool = False  # the forces are those of half a symmetric body
    threshold_N: Annotated[float, SceneNumber("N", at_least=0.0)] = 0.0  # of the file: no contact
    time_unit: Literal["s", "ms", "us"] = "s"  # of a solver's output; a CSV's header says it
    force_unit: Literal["N", "kN", "mN"] = "N"
    normal: Axis = "y"  # in a CSV y or -y, and tangential x or -x: the sign alone counts
    tangential: Axis = "x"
    interface: Interface = None  # rcforc's number, CalculiX's SLAVE or SLAVE/MASTER
    side: Literal["slave", "master"] = "slave"  # the finger's
    scalars: Scalars = Scalars()  # that the source states itself, instead of the curves'
    uncertainty: Errors = Errors()  # absolute, one standard deviation, instead of the columns'


def read_sidecar(path: Path) -> Sidecar:
    """The keys beside a file of curves; the defaults where there are none.

    Raises UserError: it can't be read, or a key is unknown or not what it may be.
    """
    beside = path.with_name(f"{path.name}.toml")
    try:
        return Sidecar.model_validate(
            read_toml(beside, str(beside)) if os.path.exists(beside) else {}
        )
    except ValidationError as error:
        raise UserError(f"{beside}: {one_line(error, Sidecar)}") from error


@dataclass(frozen=True)
class Samples:
    """Contact force over time as a file states it, in SI units, not yet checked as a tap.

    lines, time_s : (n,), line of the file, and its time.
    forces : (n,) each, N, by the names ``normal_force``, ``tangential_force`` and these with
        ``_sigma``; the first is always there.
    notes : what was taken for granted.
    """

    lines: NDArray[np.int64]
    time_s: Floats
    forces: Mapping[str, Floats]
    notes: tuple[str, ...] = ()


def number(text: str, place: str) -> float:
    """A cell as a finite number; the place begins the refusal."""
    try:
        value = float(text if "_" not in text else "")  # to Python alone 1_000 is a number
    except ValueError:
        value = np.inf
    if not abs(value) <= LARGEST_SAMPLE:
        raise UserError(f"{place}: {show(text)} is not a number of up to {LARGEST_SAMPLE:g}")
    return value
