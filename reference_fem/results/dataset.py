"""A run as an xarray dataset: every name with its unit, the run's origin in the attributes."""

import json
import platform
from collections.abc import Mapping
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


def unit_of(name: str) -> str:
    """The unit that a name ends in, "1" if it has none."""
    return next((unit for ending, unit in UNITS if name.endswith(ending)), "1")


def run_dataset(
    curves: Mapping[str, Named], numbers: Named, errors: Named, **attributes: Any
) -> "xarray.Dataset":
    """The dataset of a run's curves, numbers and errors.

    curves : arrays by name, keyed by their dimension: "time", or another, which is put before their
        names. numbers : scalars and pairs; None becomes nan. errors : those of the numbers, stored
        as ``NAME_error``. attributes : text as it is, all else as JSON in ``NAME_json``.
    """
    import xarray

    def variable(name: str, value: Any, *over: str) -> tuple[Any, Any, dict[str, str]]:
        array = np.array(np.nan if value is None else value)  # a copy: the result stays as it is
        axes = (f"{name}_axis{axis}" for axis in range(len(over), array.ndim))
        return (*over, *axes), array, {"units": unit_of(name)}

    found = {name: variable(name, value) for name, value in numbers.items()}
    found |= {f"{name}_error": variable(name, error) for name, error in errors.items()}
    for over, arrays in curves.items():
        named = {name if over == "time" else f"{over}_{name}": a for name, a in arrays.items()}
        found |= {name: variable(name, array, over) for name, array in named.items()}
    attrs = {name: value for name, value in attributes.items() if isinstance(value, str)}
    for name in attributes.keys() - attrs:
        attrs[f"{name}_json"] = json.dumps(attributes[name], default=_members)
    times = [name for name in found if name.endswith("time_s") and found[name][0]]
    return xarray.Dataset(found, attrs=dict(sorted(attrs.items()))).set_coords(times)


def versions(*packages: str) -> dict[str, str]:
    """Versions of Python and of these packages; empty for one that is not installed."""
    found = {name: [d.version for d in metadata.distributions(name=name)] for name in packages}
    return {"python": platform.python_version(), **{k: " ".join(v) for k, v in found.items()}}


def _members(value: Any) -> Any:
    return value.tolist() if hasattr(value, "tolist") else vars(value)
