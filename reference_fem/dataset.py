"""A run as an xarray dataset: every name with its unit, the run's origin in the attributes."""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from importlib import metadata
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray

Named = Mapping[str, Any]
UNITS = (  # endings of names, longest first, and the unit that they stand for
    ("_m_per_s", "m/s"), ("_N_s", "N s"), ("_Pa", "Pa"), ("_MB", "MB"), ("_m2", "m2"),
    ("_N", "N"), ("_J", "J"), ("_m", "m"), ("_s", "s"),
)  # fmt: skip
PACKAGES = ("fingertap", "numpy", "numba", "scikit-fem")


def unit_of(name: str) -> str:
    """The unit that a name ends in, "1" if it has none."""
    return next((unit for ending, unit in UNITS if name.endswith(ending)), "1")


def run_dataset(
    history: Named, others: Mapping[str, Named], numbers: Named, errors: Named, **attributes: Any
) -> xarray.Dataset:
    """The run's curves and numbers.

    history : arrays over time, ``time_s`` among them, which becomes the coordinate. others : arrays
    over further dimensions, by the dimension's name, which is set before theirs. numbers : scalars
    and pairs; None is nan. errors : of the numbers, named ``NAME_error``. attributes : what is no
    text becomes JSON, under a name that says so.
    """
    import xarray

    def variable(name: str, value: Any, *over: str) -> tuple[Any, Any, dict[str, str]]:
        array = np.asarray(np.nan if value is None else value)
        axes = (f"{name}_axis{axis}" for axis in range(len(over), array.ndim))
        return (*over, *axes), array, {"units": unit_of(name)}

    found = {name: variable(name, array, "time") for name, array in history.items()}
    for over, arrays in others.items():
        found |= {f"{over}_{name}": variable(name, array, over) for name, array in arrays.items()}
    found |= {name: variable(name, value) for name, value in numbers.items()}
    for name, error in errors.items():
        over, array, attribute = variable(name, error)
        found[f"{name}_error"] = over, array, attribute
    told = {
        name if isinstance(value, str) else f"{name}_json": value
        if isinstance(value, str)
        else json.dumps(value, default=_plain)
        for name, value in attributes.items()
    }
    times = [name for name in found if name.endswith("time_s") and found[name][0]]
    return xarray.Dataset(found, attrs=told).set_coords(times)


def versions() -> dict[str, str]:
    """Of the program, of Python and of what computes."""
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = "source tree"
    return found


def _plain(value: Any) -> Any:
    """What JSON lacks."""
    if is_dataclass(value) and not isinstance(value, type):
        return asdict(value)
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else str(value)
