"""One adapter per model: scene in, `Outcome` out. The contract is `adapter.Adapter`."""

import importlib
from typing import Any, Literal, get_args

from validation.models.adapter import Adapter

ModelName = Literal["hcm", "fem3d", "fem2d"]
MODEL_NAMES: tuple[ModelName, ...] = get_args(ModelName)


def adapter_module(name: str) -> str:
    """Where a model's adapter is: the solid models, which differ by their dimension, share one."""
    return "validation.models.hcm" if name == "hcm" else "validation.models.solid"


def adapter(name: ModelName) -> Adapter:
    """The adapter of a model."""
    module: Any = importlib.import_module(adapter_module(name))
    found: Adapter = module if name == "hcm" else module.Solid(name)
    return found
