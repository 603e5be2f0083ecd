"""Adapter of the plane-stress model."""

from validation.models import solid
from validation.models.adapter import Checkpoint, Outcome, Progress
from validation.scenes.load import NamedScene


def warm_up() -> None:
    """Load compiled code."""
    solid.warm_up("fem2d", 2)


def run(
    scene: NamedScene, progress: Progress | None = None, checkpoint: Checkpoint | None = None
) -> Outcome:
    """Run the model."""
    return solid.solve(scene, "fem2d", 2, progress, checkpoint)
