"""What ``fingertap converge`` refines, one thing at a time."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

ROOT = math.sqrt(2.0)
TIP_MESH, SHAFT_MESH, PENALTY = "mesh: tip", "mesh: shaft", "penalty"

# Edges at refinement 1, m for a finger of 15 mm, and the growth of one edge to the next.
SECTION, AXIAL, TIP, GROWTH = 0.736e-3, 0.76e-3, 1e-4, 1.25

Overrides = Mapping[str, float | str]


@dataclass(frozen=True)
class Level:
    """One run of a refinement: the refined quantity's size, and the scene's keys for it."""

    size: float
    overrides: Overrides


@dataclass(frozen=True)
class Refinement:
    """Levels from coarse to fine.

    Attributes
    ----------
    name : what is refined.
    size_name : what a level's size is.
    order : the method's formal order in it.
    """

    name: str
    size_name: str
    order: float
    levels: tuple[Level, ...]


def mesh_sizes(scale: float, shaft: float, tip: float) -> dict[str, float | str]:
    """Sizes at refinements `shaft` and `tip` (times the sizes above).

    An edge split in two halves its size and takes the root of the growth: with both, and not the
    tip's size alone, the graded part converges too.
    """
    return {
        "solver.fem.section_size": scale * SECTION * shaft,
        "solver.fem.axial_size": scale * AXIAL * shaft,
        "solver.fem.tip_size": scale * TIP * tip,
        "solver.fem.growth": GROWTH**tip,
    }


def refinements(scale: float, quick: bool) -> tuple[Refinement, ...]:
    """All refinements, with contact by impulses; that of the penalty by surface pressure.

    The shaft's has a fine tip throughout: on a coarse one, which the section's own edges
    cut in two, it would show the tip's error. The step's error does not depend on the mesh much.

    The peak is not asymptotic in the tip's edge, nor can it be soon: the patch grows by whole
    rings of nodes, and where its rim lies between two rings changes from level to level. On the
    hard finger a first edge of 0.09, 0.1 and 0.11 mm gives 280.1, 282.3 and 280.4 N, as much
    of a change as from 0.1 to 0.07 and 0.05 mm (279.4, 279.8 N); contact by surface pressure
    goes the same way.

    Parameters
    ----------
    scale
        The finger's diameter over 15 mm.
    quick
        Coarser levels and fewer of them: minutes, and a wider error bar.
    """
    impulse: dict[str, float | str] = {"solver.fem.contact": "impulse"}
    # Tips of those that don't refine it.
    for_shaft, for_penalty, for_step = (2.0, 2.0, 2.0) if quick else (1.0, ROOT, 2.0)
    tips = (2.0 * ROOT, 2.0, ROOT) if quick else (2.0, ROOT, 1.0, 1.0 / ROOT, 0.5)
    shafts = (2.0 * ROOT, 2.0, ROOT) if quick else (2.0 * ROOT, 2.0, ROOT, 1.0)
    factors = (100.0, 300.0, 1000.0) if quick else (100.0, 300.0, 1000.0, 3000.0)
    steps = (0.9, 0.45, 0.225)

    def levels(overrides: Mapping[float, Overrides]) -> tuple[Level, ...]:
        return tuple(Level(size, {**impulse, **keys}) for size, keys in overrides.items())

    millimetres = 1e3 * scale * TIP
    tip = {t * millimetres: mesh_sizes(scale, 2.0, t) for t in tips}
    shaft = {1e3 * scale * SECTION * s: mesh_sizes(scale, s, for_shaft) for s in shafts}
    pressure: dict[str, float | str] = {
        **mesh_sizes(scale, 2.0, for_penalty),
        "solver.fem.contact": "surface",
    }
    penalty = {1.0 / f: {**pressure, "solver.fem.surface_factor": f} for f in factors}
    step = {s: {**mesh_sizes(scale, 2.0, for_step), "solver.fem.step_factor": s} for s in steps}
    return (
        Refinement(TIP_MESH, "edge at the contact, mm", 2.0, levels(tip)),
        Refinement(PENALTY, "1 / penalty factor", 1.0, levels(penalty)),
        Refinement(SHAFT_MESH, "edge of the section, mm", 2.0, levels(shaft)),
        Refinement("step", "step over stable step", 2.0, levels(step)),
    )
