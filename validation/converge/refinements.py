"""What ``fingertap converge`` refines, one thing at a time."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from validation.errors import UserError
from validation.scenes.load import sets

ROOT = math.sqrt(2.0)
TIP_MESH, SHAFT_MESH, PENALTY = "mesh: tip", "mesh: shaft", "penalty"
TIP_PRESSED = "mesh: tip, surface pressure"

# At refinement 1: edges of the shaft, m, for a finger of 15 mm; edges of the tip over the radius of
# the contact patch, and their growth from one to the next beyond EVEN times that radius.
SECTION, AXIAL = 0.736e-3, 0.76e-3
TIP, GROWTH, EVEN = 0.2, 1.15, 1.3
# Edges of the tip are at most this share of the section's: a tip of longer ones is meshed evenly,
# with the section's, whatever its level asks for.
BELOW_SECTION = 0.95

LevelKeys = Mapping[str, float | str]
PRESET_KEY = "solver.fem.preset"
# Only a level's own sizes apply: an accuracy would bring halvings and damping too.
NO_ACCURACY: LevelKeys = {"solver.fem.accuracy": "none"}


@dataclass(frozen=True)
class Refinement:
    """What is refined, in steps from coarse to fine.

    name : what is refined.
    size_name : what the size of a level measures.
    order : the method's formal order in that size.
    levels : the scene's keys for each level, by its size.
    """

    name: str
    size_name: str
    order: float
    levels: Mapping[float, LevelKeys]

    @property
    def of_mesh(self) -> bool:
        """Whether each level has a mesh of its own."""
        return self.name in (TIP_MESH, TIP_PRESSED, SHAFT_MESH)


def mesh_sizes(
    scale: float, shaft: float, tip_size: float, growth: float, patch_size: float = 0.0
) -> dict[str, float | str]:
    """Scene keys of a mesh: the shaft's sizes (`shaft` times those above) and the tip's, m."""
    return {
        "solver.fem.section_size": scale * SECTION * shaft,
        "solver.fem.axial_size": scale * AXIAL * shaft,
        "solver.fem.tip_size": tip_size,
        "solver.fem.growth": growth,
        "solver.fem.patch_size": patch_size,
    }


def refinements(scale: float, patch: float, quick: bool) -> tuple[Refinement, ...]:
    """All refinements: of the tip, the penalty, the shaft and the step.

    Contact is by impulses; the tip is also refined under surface pressure, the penalty only so. The
    shaft is refined with a fine tip throughout: with a coarse one, which the section's own edges
    cut in two, it would show the tip's error. The step's error hardly depends on the mesh.
    If the tip's edges are split in two, their size is halved and their growth is its square root:
    only with both, not with the size alone, does the graded part converge too. On a patch so large
    that its shares would exceed `BELOW_SECTION` on any level, all of the tip's edges are shorter.

    scale : the finger's diameter over 15 mm
    patch : predicted radius of the contact patch, m
    quick : coarser and fewer levels: takes minutes, with a wider error bar
    """
    # Size of the tip where something else is refined.
    for_shaft, for_penalty, for_step = (2.0 * ROOT,) * 3 if quick else (ROOT, 2.0, 2.0)
    # On edges above 0.4 of the patch's radius the peak scatters by 2 % and shows no trend.
    tips = (4.0, 2.0 * ROOT, 2.0) if quick else (2.0, 2.0**0.75, ROOT, 2.0**0.25, 1.0)
    shafts = (2.0 * ROOT, 2.0, ROOT) if quick else (2.0 * ROOT, 2.0, ROOT, 1.0)
    shortest = min(2.0 / max(*tips, for_penalty, for_step), min(shafts) / for_shaft)
    edge = min(TIP * patch, BELOW_SECTION * scale * SECTION * shortest)

    def sizes(shaft: float, tip: float) -> dict[str, float | str]:
        alone = {PRESET_KEY: "contact", **NO_ACCURACY, "solver.fem.contact": "impulse"}
        own = mesh_sizes(scale, shaft, tip * edge, GROWTH**tip, EVEN * patch)
        return {**alone, **own}

    factors = (100.0, 300.0, 1000.0) if quick else (100.0, 300.0, 1000.0, 3000.0)
    steps = (0.9, 0.45, 0.225)
    surface: dict[str, float | str] = {"solver.fem.contact": "surface"}
    tip = {1e3 * t * edge: sizes(2.0, t) for t in tips}
    pressed = {size: {**keys, **surface} for size, keys in tip.items()}
    shaft = {1e3 * scale * SECTION * s: sizes(s, for_shaft) for s in shafts}
    pressure = {**sizes(2.0, for_penalty), **surface}
    penalty = {1.0 / f: {**pressure, "solver.fem.surface_factor": f} for f in factors}
    step = {s: {**sizes(2.0, for_step), "solver.fem.step_factor": s} for s in steps}
    return (
        Refinement(TIP_MESH, "edge at the contact, mm", 2.0, tip),
        Refinement(TIP_PRESSED, "edge at the contact, mm", 2.0, pressed),
        Refinement(PENALTY, "1 / penalty factor", 1.0, penalty),
        Refinement(SHAFT_MESH, "edge of the section, mm", 2.0, shaft),
        Refinement("step", "step over stable step", 2.0, step),
    )


def check_given(overrides: Sequence[str], wanted: Sequence[Refinement]) -> None:
    """Refuse a ``KEY=VALUE`` that no level would keep.

    Raises UserError: every level sets that key itself.
    """
    always = set.intersection(*(set(keys) for one in wanted for keys in one.levels.values()))
    if "solver.fem.accuracy" in always:  # then the models' common accuracy has no effect either
        always |= {"solver.accuracy"}
    if taken := [key for one in overrides for key in sorted(always) if sets(one, key)]:
        raise UserError(f"--set {taken[0]}: a convergence study sets it itself; leave it out")
