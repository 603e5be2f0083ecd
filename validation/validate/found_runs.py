"""The runs of a validation, and how they are found."""

from collections.abc import Sequence
from dataclasses import dataclass

from validation.harness.record import RunRecord
from validation.models.variants import all_variants
from validation.validate.plan import (
    HOLES,
    OWN_PROCESS,
    PAPER,
    PAPER_REDUCED,
    PAPER_REFERENCE,
    Plan,
    RunName,
)


@dataclass(frozen=True)
class Runs:
    """All runs of a validation."""

    records: tuple[RunRecord, ...]
    plan: Plan = PAPER

    @property
    def scenes(self) -> tuple[str, ...]:
        """Names of the scenes."""
        return tuple(self.plan.scenes)

    def find(self, scene: str, which: RunName) -> RunRecord | None:
        """The completed run of a scene with that model and variant."""
        return next(
            (r for r in self.records if r.ok and (r.scene, r.model, r.variant) == (scene, *which)),
            None,
        )

    def find_all(self, scene: str, which: Sequence[RunName]) -> list[RunRecord]:
        """The completed runs of a scene among these models and variants."""
        return [run for one in which if (run := self.find(scene, one)) is not None]

    def of_model(self, scene: str, model: str) -> RunRecord | None:
        """A model's own run of a scene: the first of its jobs, if it completed."""
        found = next((r for r in self.records if (r.scene, r.model) == (scene, model)), None)
        return found if found is not None and found.ok else None

    def reference(self, scene: str) -> RunRecord | None:
        """The run or data with which the first screen compares."""
        data = self.plan.data.get(scene)
        return data.record if data else self.of_model(scene, self.plan.reference)

    def compared(self, scene: str) -> list[RunRecord]:
        """The completed runs of the models that are compared."""
        runs = (self.of_model(scene, model) for model in self.plan.models)
        return [run for run in runs if run is not None]

    def references(self, scene: str) -> list[RunRecord]:
        """The runs with which the models are compared; the first screen's comes first."""
        first = self.reference(scene)
        others = self.find_all(scene, OWN_PROCESS[1:]) if self.plan.in_full else []
        return ([] if first is None else [first]) + [run for run in others if run is not first]

    def comparisons(self, scene: str) -> list[tuple[RunRecord, list[RunRecord]]]:
        """The compared runs with their references; then PAPER_REDUCED with PAPER_REFERENCE."""
        own, rung = self.find(scene, PAPER_REDUCED), self.find(scene, PAPER_REFERENCE)
        papers = [] if own is None or rung is None else [(own, [rung])]
        return [(run, self.references(scene)) for run in self.compared(scene)] + papers

    def drawn_runs(self, scene: str) -> list[RunRecord]:
        """The runs whose forces are drawn."""
        return self.compared(scene) + self.references(scene)

    def spread_over(self, scene: str) -> list[RunRecord]:
        """The completed 3D runs with various meshes and penalty factors, all with plain hinges."""
        solids = [r for r in self.records if r.ok and r.scene == scene and r.model == "fem3d"]
        return [run for run in solids if run.variant != HOLES.variant]

    def measured(self) -> list[RunRecord]:
        """The runs that had a process to themselves when their memory was read."""
        first = {(run.scene, run.model): run for run in reversed(self.records)}
        of = (*self.plan.models, self.plan.reference)
        alone = OWN_PROCESS if self.plan.in_full else ()
        return [
            run
            for run in self.records
            if (run.model, run.variant) in alone
            or (run.model in of and run is first[run.scene, run.model])
        ]

    def failures(self) -> list[RunRecord]:
        """The runs that did not complete, without those of `assumption_jobs`."""
        own = {v.name for v in all_variants()}
        return [run for run in self.records if not run.ok and run.variant not in own]
