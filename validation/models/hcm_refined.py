"""The reduced model with the refined assumptions where the scene states none of its own switches.

This module is its `adapter.Adapter`: `hcm` with ``solver.hcm.assumptions = "refined"``, under a
name of its own beside the paper's model.
"""

from dataclasses import replace
from functools import partial

from validation.models import hcm
from validation.models.adapter import Checkpoint, Kind, Outcome, Progress
from validation.scenes.load import NamedScene, changed_scene

name = "hcm-refined"
kind: Kind = "reduced"
settings = hcm.settings
resumable = hcm.resumable
sources: tuple[str, ...] = (__name__,)
independent_of = hcm.independent_of
refusal = hcm.refusal
warm_up = partial(hcm.warm_up_kernels, hcm.Kernels(refined=True))


def run(
    scene: NamedScene, progress: Progress | None = None, checkpoint: Checkpoint | None = None
) -> Outcome:
    """Run the reduced model on the scene with the refined assumptions."""
    refined = changed_scene(scene.name, scene.document, (hcm.REFINED,), scene.name)
    outcome = hcm.run(refined, progress)
    del checkpoint
    return replace(outcome, record=replace(outcome.record, model=name))
