"""What ``fingertap validate`` runs, and how its runs are found again."""

from collections.abc import Sequence
from dataclasses import dataclass

from validation.harness.record import RunRecord
from validation.runs.execute import Job
from validation.scenes.load import without_estimate

SCENES = ("hard", "soft")
REFERENCE = ("fem3d", "ls-dyna-like")
FAST = ("fem3d", "fast")
HOLES = ("fem3d", "ls-dyna-like shaft holes")
PLANE = ("fem2d", "fast")
REDUCED = ("hcm", "")
ALONE = (REDUCED, REFERENCE, FAST, PLANE)  # first in their process: its memory is theirs
MESHES = {"": "N = 60", "N=30": "N = 30", "N=15": "N = 15"}  # variants of hcm, paper's fig. 7
SHAFT_RADIUS = 2.5e-3  # m; the paper draws holes and gives no size
PENALTY = "solver.fem.penalty_factor"
PENALTIES = (0.4, 1.6)  # beside both presets' 0.1


def groups(scene: str, estimate: bool = True) -> list[list[Job]]:
    """Jobs of one scene; each group shares a process, whose memory is its first job's.

    Parameters
    ----------
    estimate : whether the runs that the page's tables compare state their errors; others don't.
    """
    beams, solid = without_estimate("hcm"), without_estimate("fem3d")
    own, reference = without_estimate("hcm", not estimate), without_estimate("fem3d", not estimate)
    preset = "solver.fem.preset=ls-dyna-like"
    holes = f"solver.fem.shaft_radius={SHAFT_RADIUS}"
    return [
        [
            Job(scene, "hcm", own),
            Job(scene, "hcm", ("finger.elements=10", *beams), "N=30"),
            Job(scene, "hcm", ("finger.elements=5", *beams), "N=15"),
        ],
        [
            Job(scene, "fem3d", (preset, *reference), REFERENCE[1], True),
            Job(scene, "fem3d", (preset, holes, *solid), HOLES[1]),
        ],
        [
            Job(scene, "fem3d", reference, FAST[1]),
            *(
                Job(scene, "fem3d", (f"{PENALTY}={p}", *solid), f"fast penalty {p:g}")
                for p in PENALTIES
            ),
        ],
        [Job(scene, "fem2d", reference, PLANE[1])],
    ]


@dataclass(frozen=True)
class Runs:
    """All runs of a validation."""

    records: tuple[RunRecord, ...]

    def find(self, scene: str, which: tuple[str, str]) -> RunRecord | None:
        """The completed run of a scene with that model and variant."""
        return next(
            (r for r in self.records if r.ok and (r.scene, r.model, r.variant) == (scene, *which)),
            None,
        )

    def several(self, scene: str, which: Sequence[tuple[str, str]]) -> list[RunRecord]:
        """Those of the named runs that completed."""
        return [run for one in which if (run := self.find(scene, one)) is not None]

    def references(self, scene: str) -> list[RunRecord]:
        """The runs that the reduced model is compared with."""
        return self.several(scene, ALONE[1:])

    def spread_over(self, scene: str) -> list[RunRecord]:
        """The three-dimensional runs over meshes and penalty factors, all with plain hinges."""
        solids = [r for r in self.records if r.ok and r.scene == scene and r.model == "fem3d"]
        return [run for run in solids if run.variant != HOLES[1]]

    def measured(self) -> list[RunRecord]:
        """The runs that had a process to themselves when their memory was read."""
        return [run for run in self.records if (run.model, run.variant) in ALONE]

    def failures(self) -> list[RunRecord]:
        """The runs that did not complete."""
        return [run for run in self.records if not run.ok]
