"""What ``fingertap validate`` runs, and how its runs are found."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import hcm
from validation.curve_files.read import Reference
from validation.harness.record import RunRecord
from validation.models import adapter, default_accuracy, estimate_override
from validation.models.variants import all_variants
from validation.runs.execute import Job
from validation.scenes.load import NamedScene, load_scene
from validation.scenes.scene import Scene
from validation.scenes.solver_tables import NO_ACCURACY


class RunName(NamedTuple):
    """A run of a scene by its model and what was changed of it."""

    model: str
    variant: str


DEFAULT_REFERENCE = RunName("fem3d", "contact")  # the default reference, on the first screen
PAPER_REFERENCE = RunName("fem3d", "ls-dyna-like")  # stands in for the paper's
FAST = RunName("fem3d", "fast")
HOLES = RunName("fem3d", "ls-dyna-like shaft holes")
PLANE = RunName("fem2d", "fast")
PAPER_REDUCED = RunName("hcm", "N=60")  # 20 elements a phalanx, whatever accuracy is the default
REFINED = "hcm-refined"
# Runs that come first in their process, so that its memory is theirs.
OWN_PROCESS = (PAPER_REDUCED, DEFAULT_REFERENCE, PAPER_REFERENCE, FAST, PLANE)
MESHES = {f"N={n}": f"N = {n}" for n in (60, 30, 15)}  # variants of hcm, the paper's fig. 7
SHAFT_SHARE = 1 / 6  # radius over the smallest diameter; the paper draws holes but gives no size
PENALTY = "solver.fem.penalty_factor"
NO_FEM_ACCURACY = f"solver.fem.accuracy={NO_ACCURACY}"  # with a preset, which decides it
PENALTIES = (0.4, 1.6)  # beside both presets' 0.1
VARIED = (  # keys of the solid that the paper's comparison varies
    *("mesh", "preset", "contact", "penalty_factor", "shaft_radius"),
    *("section_size", "axial_size", "tip_size", "growth", "patch_size", "halvings"),
    *("full_volume", "element"),
)


@dataclass(frozen=True)
class Plan:
    """Which models are compared with which reference, and on which scenes.

    scenes : the source of each scene, by its name.
    models : the compared models; the first is the headline's.
    reference : the model that they are compared with.
    data : by the scene's name, curves from a file that replace the reference's run.
    tolerances : largest difference by a quantity's key, percent.
    """

    scenes: Mapping[str, str] = field(default_factory=lambda: {"hard": "hard", "soft": "soft"})
    models: tuple[str, ...] = (PAPER_REDUCED.model,)
    reference: str = PAPER_REFERENCE.model
    data: Mapping[str, Reference] = field(default_factory=dict)
    tolerances: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def loaded(self) -> Mapping[str, NamedScene]:
        """The scenes by name."""
        return {name: load_scene(source) for name, source in self.scenes.items()}

    @property
    def leads_to_refined(self) -> bool:
        """Whether both reduced models, the paper's and the refined one, are compared."""
        return {PAPER_REDUCED.model, REFINED} <= set(self.models)

    @property
    def notes(self) -> list[str]:
        """Lines on what was done to the data, and on what is left out."""
        noted = [f"{scene}, {note}" for scene, data in self.data.items() for note in data.notes]
        noted += [
            f"{scene}: what hertz and partial_slip are worth is left out, as a contact without them"
            " has a spring and the scene no tip.normal_stiffness"
            for scene, given in self.loaded.items()
            if REFINED in self.models and given.tables.tip.normal_stiffness is None
        ]
        noted += [
            f"{scene}: plane stress ({PLANE.model}) is left out: {refused}"
            for scene, given in self.loaded.items()
            if self.in_full and (refused := adapter(PLANE.model).refusal(given))
        ]
        return noted + [
            f"the paper's comparison, over several meshes, is left out: {scene} states {key}"
            for scene, key in self.decided.items()
        ]

    @cached_property
    def decided(self) -> Mapping[str, str]:
        """Scenes that state a key which the paper's comparison varies, with the first such key."""
        asked = self.loaded.items() if self._asked_in_full else ()
        keys = ((name, decisive_keys(given.tables)) for name, given in asked)
        return {name: found[0] for name, found in keys if found}

    @property
    def _asked_in_full(self) -> bool:
        return (
            self.reference == PAPER_REFERENCE.model
            and PAPER_REDUCED.model in self.models
            and not self.data
        )

    @property
    def in_full(self) -> bool:
        """Whether the paper's comparison is made: its ladder, meshes, penalties and holes."""
        return self._asked_in_full and not self.decided


PAPER = Plan()


def decisive_keys(tables: Scene) -> list[str]:
    """The keys of meshes, contact laws, holes and assumptions that a scene states although the
    paper's comparison varies them itself and names its runs by them.
    """
    stated = tables.solver.hcm.stated(hcm.Assumptions)
    beams = list(stated) if hcm.Assumptions(**stated).any else []
    solid = [key for key in VARIED if key in tables.solver.fem.model_fields_set]
    return [f"solver.fem.{key}" for key in solid] + [f"solver.hcm.{key}" for key in beams]


def validation_jobs(plan: Plan, estimate: bool = True) -> list[list[Job]]:
    """Jobs of all scenes; a group shares a process, whose memory counts for its first job."""
    jobs = []
    for source in plan.scenes.values():
        if plan.in_full:
            jobs += paper_jobs(source, estimate)
        done = {job.model for group in jobs for job in group if job.scene == source}
        wanted = [*plan.models, *([] if plan.data else [plan.reference])]
        jobs += [
            [Job(source, model, default_overrides(source, model, estimate), None, True)]
            for model in dict.fromkeys(wanted)
            if model not in done
        ]
        if REFINED in plan.models:
            jobs += [assumption_jobs(source)]
    return jobs


def first_jobs(plan: Plan) -> dict[tuple[str, str], Job]:
    """By source and model, the model's own job on that scene: its first (`Runs.of_model`)."""
    return {
        (j.scene, j.model): j for group in reversed(validation_jobs(plan)) for j in reversed(group)
    }


def default_overrides(scene: str, model: str, estimate: bool) -> tuple[str, ...]:
    """Overrides of a model's own run: its default accuracy, and whether it states its errors."""
    accuracy = default_accuracy(model, load_scene(scene).tables)
    return (*accuracy, *estimate_override(model, estimate))


def assumption_jobs(scene: str, overrides: Sequence[str] = ()) -> list[Job]:
    """The reduced model between the paper's assumptions and the refined ones; with those that need
    no tip.normal_stiffness if the scene has none.
    """
    beams = estimate_override(PAPER_REDUCED.model)
    known = load_scene(scene, overrides).tables.tip.normal_stiffness is not None
    return [
        Job(scene, PAPER_REDUCED.model, (*overrides, *beams, *v.overrides), v.name)
        for v in all_variants()
        if known or not v.assumptions.needs_stiffness
    ]


def paper_jobs(scene: str, estimate: bool = True) -> list[list[Job]]:
    """Jobs of one scene in the paper's comparison; the first of a group is measured.

    estimate : whether the runs in the page's tables state their errors; the others never do.
    """
    beams, solid = estimate_override("hcm"), estimate_override("fem3d")
    own, reference = (estimate_override(model, estimate) for model in ("hcm", "fem3d"))
    solid_default = default_overrides(scene, "fem3d", estimate)
    fixed = f"solver.hcm.accuracy={NO_ACCURACY}"
    preset, fast = (
        (NO_FEM_ACCURACY, f"solver.fem.preset={of.variant}") for of in (PAPER_REFERENCE, FAST)
    )
    given = load_scene(scene)
    radius = SHAFT_SHARE * given.tables.smallest_diameter
    holes = f"solver.fem.shaft_radius={radius:g}"
    plane = Job(scene, PLANE.model, (*fast, *reference), PLANE.variant)
    return [
        [Job(scene, "hcm", default_overrides(scene, "hcm", estimate))],
        [
            Job(scene, "hcm", (fixed, "finger.elements=20", *own), PAPER_REDUCED.variant),
            Job(scene, "hcm", (fixed, "finger.elements=10", *beams), "N=30"),
            Job(scene, "hcm", (fixed, "finger.elements=5", *beams), "N=15"),
        ],
        [Job(scene, "fem3d", solid_default, DEFAULT_REFERENCE.variant, True)],
        [
            Job(scene, "fem3d", (*preset, *reference), PAPER_REFERENCE.variant),
            Job(scene, "fem3d", (*preset, holes, *solid), HOLES.variant),
        ],
        [
            Job(scene, "fem3d", (*fast, *reference), FAST.variant),
            *(
                Job(scene, "fem3d", (*fast, f"{PENALTY}={p}", *solid), f"fast penalty {p:g}")
                for p in PENALTIES
            ),
        ],
        *([] if adapter(PLANE.model).refusal(given) else [[plane]]),
    ]


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
