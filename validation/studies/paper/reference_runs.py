"""The 3D reference's runs behind Tables 2 and 3, and how its peak forces depend on its choices.

The ls-dyna-like preset repeats the printed number of elements; the article gives neither its mesh
nor its penalty, so both are varied: penalty factors on that mesh and on one with a tenth of the
elements, and the preset that `fingertap converge` has found to be converged.
"""

import math
from collections.abc import Callable, Mapping

from validation.harness.record import RunRecord
from validation.models.adapter import Progress

JUDGED = "ls-dyna-like"
SOFTER, COARSE, CONVERGED = "ls-dyna-like penalty 0.05", "fast", "converged"
PENALTIES = {JUDGED: 0.1, SOFTER: 0.05}  # on the same mesh
COARSE_PENALTIES = {"fast penalty 0.02": 0.02, COARSE: 0.1, "fast penalty 0.5": 0.5}
VARIANTS: dict[str, tuple[str, ...]] = {
    JUDGED: ("solver.fem.preset=ls-dyna-like",),
    SOFTER: ("solver.fem.preset=ls-dyna-like", "solver.fem.penalty_factor=0.05"),
    **{
        name: ("solver.fem.preset=fast", f"solver.fem.penalty_factor={factor!r}")
        for name, factor in COARSE_PENALTIES.items()
    },
    CONVERGED: ("solver.fem.preset=converged",),
}

Runner = Callable[[tuple[str, ...], str], Mapping[str, RunRecord]]


# Records by variant and scene; a run that failed is absent.
References = Mapping[str, Mapping[str, RunRecord]]


def value_of(references: References, variant: str, scene: str, key: str) -> float | None:
    """One scalar, None where the run is absent."""
    record = references.get(variant, {}).get(scene)
    return record.value(key) if record else None


def run_references(run: Runner, progress: Progress) -> References:
    """Run all variants on both scenes; ``run`` takes overrides and the variant's name."""
    records = {}
    for i, (name, overrides) in enumerate(VARIANTS.items()):
        progress(i / len(VARIANTS), f"reference, {name}")
        records[name] = run(overrides, name)
    return records


def penalty_for(target: float, values: Mapping[float, float]) -> float:
    """Penalty factor at which a force has the target's size, by a power law through two values."""
    (p0, f0), (p1, f1) = sorted(values.items())
    slope = math.log(abs(f1 / f0)) / math.log(p1 / p0)
    return float(p0 * abs(target / f0) ** (1 / slope))


def sensitivity(references: References, scene: str, key: str, printed: float) -> str:
    """How a peak force depends on penalty and mesh, and which penalty gives the printed one."""

    def text(variants: Mapping[str, float]) -> tuple[dict[float, float], str]:
        found = {
            factor: value
            for name, factor in variants.items()
            if (value := value_of(references, name, scene, key)) is not None
        }
        words = ", ".join(f"{found[f]:.4g} N at {f:g}" for f in sorted(found))
        return found, words

    parts = []
    same_mesh, words = text(PENALTIES)
    if len(same_mesh) == 2:
        needed = penalty_for(printed, same_mesh)
        parts.append(f"penalty factor on this mesh: {words}; {needed:.2g} would give the print")
    coarse, words = text(COARSE_PENALTIES)
    if coarse:
        record = references[COARSE].get(scene)
        count = int(record.summary["elements"]) if record else 0
        parts.append(f"with {count} elements: {words}")
    limit = value_of(references, CONVERGED, scene, key)
    if limit is not None:
        parts.append(f"converged in mesh, penalty and step: {limit:.4g} N")
    return "; ".join(parts)
