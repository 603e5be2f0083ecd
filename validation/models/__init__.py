"""One adapter per model: scene in, ``Outcome`` out.

Contract of an adapter module:

- ``warm_up()`` runs a tiny scene so that compiled code is loaded before anything is timed;
- ``run(scene, progress, checkpoint)`` translates the scene, times the solve alone, and returns an
  ``Outcome``; it raises ``UserError`` for what the model cannot take, and lets a solver's status
  through as the record's status. A model that has nothing to resume ignores the checkpoint.

A model's package is imported inside these functions, not when its adapter is.
"""

import importlib
from typing import Literal, get_args

from validation.models.adapter import Adapter

ModelName = Literal["hcm", "fem3d", "fem2d"]
MODEL_NAMES: tuple[ModelName, ...] = get_args(ModelName)


def adapter(name: ModelName) -> Adapter:
    """The adapter of a model."""
    module: Adapter = importlib.import_module(f"validation.models.{name}")
    return module
