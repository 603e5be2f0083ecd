"""Adapter of the solid model in three dimensions."""

from validation.models import solid
from validation.models.adapter import Checkpoint, Outcome, Progress
from validation.scenes.load import NamedScene


def warm_up() -> None:
    """Load compiled code."""
    solid.warm_up("fem3d", 3)


def run(
    scene: NamedScene, progress: Progress | None = None, checkpoint: Checkpoint | None = None
) -> Outcome:
    """Run the model."""
    return solid.solve(scene, "fem3d", 3, progress, checkpoint)
