"""What ``fingertap converge`` refines, one thing at a time."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

ROOT = math.sqrt(2.0)
TIP_MESH, SHAFT_MESH, PENALTY = "mesh: tip", "mesh: shaft", "penalty"

# At refinement 1: edges of the shaft, m for a finger of 15 mm; edges of the tip over the radius of
# the patch of contact, and the growth from one to the next beyond EVEN of that radius.
SECTION, AXIAL = 0.736e-3, 0.76e-3
TIP, GROWTH, EVEN = 0.2, 1.15, 1.3
# Of an edge at the tip, where the patch's centre lies in its cell; and the relaxation time over the
# time that a bar's wave takes along that edge.
PHASES, DAMPING = (-0.5, -0.25, 0.0, 0.25), 0.1

Overrides = Mapping[str, float | str | tuple[float, ...]]


@dataclass(frozen=True)
class Level:
    """A refined quantity's size, and the scene's keys for each run whose mean is its value."""

    size: float
    runs: tuple[Overrides, ...]


@dataclass(frozen=True)
class Tip:
    """What a study's sizes are told by.

    scale : the finger's diameter over 15 mm
    patch, radius : of contact as predicted, and of the tip, m
    relaxation, wave_speed : of each phalanx's material, s, and of a bar of the last one's, m/s
    """

    scale: float
    patch: float
    radius: float
    relaxation: tuple[float, ...]
    wave_speed: float


@dataclass(frozen=True)
class Refinement:
    """Levels from coarse to fine.

    name : what is refined.
    size_name : what a level's size is.
    order : the method's formal order in it.
    """

    name: str
    size_name: str
    order: float
    levels: tuple[Level, ...]


def mesh_sizes(
    scale: float, shaft: float, tip_size: float, growth: float, patch_size: float = 0.0
) -> dict[str, float | str]:
    """Sizes of a shaft at that refinement (times the sizes above) and of a tip, m."""
    return {
        "solver.fem.section_size": scale * SECTION * shaft,
        "solver.fem.axial_size": scale * AXIAL * shaft,
        "solver.fem.tip_size": tip_size,
        "solver.fem.growth": growth,
        "solver.fem.patch_size": patch_size,
    }


def refinements(tip: Tip, quick: bool) -> tuple[Refinement, ...]:
    """All refinements: those of the tip and of the penalty by surface pressure, others by impulses.

    The shaft's has a fine tip throughout: on a coarse one, which the section's own edges
    cut in two, it would show the tip's error. The step's error does not depend on the mesh much.

    An edge of the tip that is split in two halves its size and takes the root of the growth: with
    both, and not the tip's size alone, the graded part converges too. Where in its cell the patch
    lies changes the peak by as much as the mesh's mean error: a level is the mean over PHASES.
    Waves as short as an edge ring, and friction makes them grow (`reference_fem.contact.surface`),
    which a peak holds: all materials have a relaxation time, in proportion to the edge.

    Parameters
    ----------
    quick : coarser levels and fewer of them: minutes, and a wider error bar
    """

    def sizes(shaft: float, t: float) -> Overrides:
        edge = t * TIP * tip.patch
        least = DAMPING * edge / tip.wave_speed
        return {
            **mesh_sizes(tip.scale, shaft, edge, GROWTH**t, EVEN * tip.patch),
            "material.relaxation_time": tuple(max(least, own) for own in tip.relaxation),
        }

    def turned(t: float, factor: float = 1000.0) -> tuple[Overrides, ...]:
        keys: Overrides = {"solver.fem.contact": "surface", "solver.fem.surface_factor": factor}
        cell = t * TIP * tip.patch / tip.radius
        return tuple({**sizes(2.0, t), **keys, "solver.fem.turn": p * cell} for p in PHASES)

    # Tips of those that don't refine it.
    for_shaft, for_penalty, for_step = (2.0 * ROOT,) * 3 if quick else (ROOT, 2.0, 2.0)
    tips = (4.0, 3.0, 2.0) if quick else (3.0, 2.0, 1.5, 1.2)
    shafts = (2.0 * ROOT, 2.0, ROOT) if quick else (2.0 * ROOT, 2.0, ROOT, 1.0)

    def levels(overrides: Mapping[float, Overrides]) -> tuple[Level, ...]:
        impulse = {"solver.fem.contact": "impulse"}
        return tuple(Level(size, ({**keys, **impulse},)) for size, keys in overrides.items())

    at_tip = tuple(Level(1e3 * t * TIP * tip.patch, turned(t)) for t in tips)
    penalty = tuple(Level(1.0 / f, turned(for_penalty, f)) for f in (100.0, 300.0, 1000.0))
    shaft = {1e3 * tip.scale * SECTION * s: sizes(s, for_shaft) for s in shafts}
    step = {s: {**sizes(2.0, for_step), "solver.fem.step_factor": s} for s in (0.9, 0.45, 0.225)}
    return (
        Refinement(TIP_MESH, "edge at the contact, mm", 2.0, at_tip),
        Refinement(PENALTY, "1 / penalty factor", 1.0, penalty),
        Refinement(SHAFT_MESH, "edge of the section, mm", 2.0, levels(shaft)),
        Refinement("step", "step over stable step", 2.0, levels(step)),
    )
