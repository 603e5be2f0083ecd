"""What a file of curves doesn't say by itself: ``NAME.toml`` beside it, NAME with its ending."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from validation.errors import UserError
from validation.harness.quantities import ESTIMATED, TIP_VELOCITY
from validation.harness.record_schema import LARGEST, SIGNED
from validation.models.curves import TIMES
from validation.scenes.load import read_toml
from validation.scenes.messages import one_line
from validation.scenes.scene_number import SceneNumber

Axis = Literal["x", "-x", "y", "-y", "z", "-z"]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


def _scalar(key: str) -> SceneNumber:
    """What a tap's number may be: all but the signed ones are positive where there is a tap."""
    if key in (TIP_VELOCITY, *SIGNED):
        return SceneNumber(at_least=-LARGEST, at_most=LARGEST)
    if key in TIMES:
        return SceneNumber(at_least=0.0, at_most=LARGEST)
    return SceneNumber(above=0.0, at_most=LARGEST)


def _numbers(bounds: Callable[[str], SceneNumber]) -> Any:
    """A table of a tap's numbers by their keys, SI units."""
    fields: Any = {}
    for key in ESTIMATED:
        one: Any = Annotated[float, bounds(key)]
        two = Annotated[list[one], Field(min_length=2, max_length=2)]
        fields[key] = (two if key == TIP_VELOCITY else one, None)
    return create_model("Numbers", __base__=_Table, **fields)


if TYPE_CHECKING:
    Scalars = BaseModel
    Errors = BaseModel
else:
    Scalars = _numbers(_scalar)
    Errors = _numbers(lambda _: SceneNumber(at_least=0.0, at_most=LARGEST))


class Sidecar(_Table):
    """The keys of ``NAME.toml``. Axes: F_n pushes the tip up, F_t acts on it along +X."""

    scene: str | None = None  # that the curves belong to
    source: str = ""  # whose they are, in words
    time_offset_s: Annotated[float, SceneNumber("s")] = 0.0  # the file's time as the motion starts
    half_model: bool = False  # the forces are those of half a symmetric body
    threshold_N: Annotated[float, SceneNumber("N", at_least=0.0)] = 0.0  # of the file: no contact
    time_unit: Literal["s", "ms", "us"] = "s"  # of a solver's output; a CSV's header says it
    force_unit: Literal["N", "kN", "mN"] = "N"
    normal: Axis = "y"  # in a CSV its sign alone counts
    tangential: Axis = "x"
    interface: str | int | None = None  # rcforc's number, CalculiX's slave set
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
