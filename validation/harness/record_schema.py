"""What a stored run has to hold: keys, types, shapes, and finite numbers where needed.

A digest shows that an entry is what was written, not that a run wrote it: anyone who can write to a
store's folder can make both. What passes here can be printed, compared and written to files.
"""

import math
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, create_model

from validation.harness.quantities import ESTIMATED, QUANTITIES, TIP_VELOCITY

COUNTS = ("compression_to_restitution", "stick_to_slip", "slip_to_stick", "steps", "elements")
SIGNED = ("peak_tangential_force_N", "peak_stress_R_Pa", "energy_residual")
LARGEST = 1e300  # beyond it a unit's prefix can make a number infinite


def _text(text: str) -> str:
    """Refuse text that HDF5's attributes cannot hold."""
    if "\0" in text:
        raise ValueError("holds a null byte")
    return text


Text = Annotated[str, AfterValidator(_text)]
Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]
Positive = Annotated[float, Field(ge=0.0, le=LARGEST, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=0, le=2**63)]


def _infinite_if_null(error: float | None) -> float:
    """An error in JSON, which has no infinity: null is one that could not be estimated."""
    return math.inf if error is None else error


class _Part(BaseModel):
    model_config = ConfigDict(strict=True, extra="allow")


def _kind(key: str) -> Any:
    if key == TIP_VELOCITY:
        return tuple[Number, Number] | None
    if key == "reverse_slip":
        return bool | None
    if key in COUNTS:
        return Count | None
    return (Number if key in SIGNED else Positive) | None


_Summary: Any = create_model(  # type: ignore[call-overload]
    "_Summary", __base__=_Part, **{entry.key: (_kind(entry.key), ...) for entry in QUANTITIES}
)

_Error = Annotated[Positive | None, AfterValidator(_infinite_if_null)]
_errors = {
    key: (tuple[_Error, _Error] if key == TIP_VELOCITY else _Error, None) for key in ESTIMATED
}
_Errors: Any = create_model(  # type: ignore[call-overload]
    "_Errors", __config__=ConfigDict(strict=True, extra="forbid"), **_errors
)


class _Provenance(_Part):
    scene_toml: Text
    created: Text


class _Choice(_Part):
    setting: Text
    value: Text
    reason: Text


class _Accuracy(_Part):
    model_config = ConfigDict(strict=True, extra="forbid")

    wanted: Positive | None = None
    expected: _Error = None
    choices: list[_Choice] = []


class _Record(_Part):
    model_config = ConfigDict(strict=True, extra="forbid")

    scene: Text
    model: Text
    variant: Text
    status: Text
    ok: bool
    message: Text
    summary: _Summary
    errors: _Errors
    events: tuple[tuple[Number, Text], ...]
    statistics: dict[Text, Number | Count | bool | Text | None]
    accuracy: _Accuracy
    provenance: _Provenance


def record_values(content: bytes) -> dict[str, Any]:
    """The fields of a `RunRecord` from the JSON of a stored one; its events are pairs.

    Raises ValueError: it is not a valid record; names the key and what is wrong.
    """
    try:
        record = _Record.model_validate_json(content)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(map(str, first["loc"]))
        raise ValueError(f"{key or 'the record'}: {first['msg']}") from error
    if record.ok != (record.status == "COMPLETED"):
        raise ValueError(f"status: {record.status} and ok = {record.ok} contradict each other")
    values: dict[str, Any] = record.model_dump(exclude_unset=True)
    if values["accuracy"]:  # what was not estimated is left out
        values["accuracy"] = record.accuracy.model_dump()
    return values


def stated_errors(values: Mapping[str, Any]) -> dict[str, Any]:
    """The errors of a record from JSON."""
    return _Errors.model_validate(values, strict=False).model_dump(exclude_unset=True)


def check_arrays(arrays: Mapping[str, NDArray[Any]], needed: tuple[str, ...]) -> None:
    """Check arrays over time: equal length, numbers, times that are finite and never decrease.

    needed : names of one-dimensional arrays that must be there, unless there are no arrays at all.

    Raises ValueError: names the array and what is wrong.
    """
    if not arrays:
        return
    for name in needed:
        if name not in arrays or arrays[name].ndim != 1:
            raise ValueError(f"{name} is missing or not one-dimensional")
    time = arrays["time_s"]
    for name, array in arrays.items():
        if not name.isidentifier():
            raise ValueError(f"{name!r} does not name an array")
        if array.dtype.kind not in "biuf" or array.ndim == 0 or len(array) != len(time):
            raise ValueError(f"{name} is not {len(time)} rows of numbers")
    steps = np.diff(time.astype(float))
    if not (np.isfinite(time).all() and (steps >= 0.0).all()) or math.isinf(np.sum(steps)):
        raise ValueError("time_s is not finite or runs back")
