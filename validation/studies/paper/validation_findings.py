"""Sections 4.1 and 5: tables 2 and 3, figs. 7 and 9, and the 3D reference's runs behind them.

The ls-dyna-like preset repeats the printed number of elements; the article gives neither its mesh
nor its penalty, so both are varied: penalty factors on that mesh and on one with a tenth of the
elements, and the preset that `fingertap converge` has found to be converged.
"""

import math
from collections.abc import Mapping

import numpy as np

from validation.compare.claims import read_claims
from validation.compare.differences import error_percent
from validation.harness.record import RunRecord
from validation.studies.paper.ledger import Finding
from validation.studies.paper.readings import CaseRuns, curve, scalar, transitions

NORMAL, TANGENTIAL = "peak_normal_force_N", "peak_tangential_force_N"
# In Table 2's order: claims T2.1 to T2.4 are hcm's, 5 to 8 the reference's, 9 to 12 the errors.
PEAKS = (("hard", NORMAL), ("hard", TANGENTIAL), ("soft", NORMAL), ("soft", TANGENTIAL))
# In Table 3's order, with the first of a quantity's four claims: both scenes of hcm's, then of the
# reference's.
COSTS = ((1, "times", "wall_time_s"), (5, "memories", "peak_memory_MB"))
SLIP_MU = 0.5  # of both scenes
OTHER_MACHINE = "another program on another machine (4-core laptop of 2016)"
NO_REFERENCE = "no reference run"
REDUCED, JUDGED = "hcm", "ls-dyna-like"
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
# Records by variant and scene, also of hcm's run of each scene in a process of its own; a run that
# failed is absent.
References = dict[str, Mapping[str, RunRecord]]


def value_of(references: References, variant: str, scene: str, key: str) -> float | None:
    """One scalar, None where the run is absent."""
    record = references.get(variant, {}).get(scene)
    return record.value(key) if record else None


def penalty_for(target: float, values: Mapping[float, float]) -> float:
    """Penalty factor at which a force has the target's size, by a power law through two values."""
    (p0, f0), (p1, f1) = sorted(values.items())
    slope = math.log(abs(f1 / f0)) / math.log(p1 / p0)
    return float(p0 * abs(target / f0) ** (1 / slope))


def sensitivity(references: References, scene: str, key: str, printed: float) -> str:
    """How a peak force depends on penalty and mesh, and which penalty gives the printed one."""

    def forces(variants: Mapping[str, float]) -> dict[float, float]:
        found = {of: value_of(references, name, scene, key) for name, of in variants.items()}
        return {of: force for of, force in sorted(found.items()) if force is not None}

    def text(found: Mapping[float, float]) -> str:
        return ", ".join(f"{force:.4g} N at {of:g}" for of, force in found.items())

    parts, same_mesh, coarse = [], forces(PENALTIES), forces(COARSE_PENALTIES)
    if len(same_mesh) == 2:
        needed = f"{penalty_for(printed, same_mesh):.2g} would give the print"
        parts.append(f"penalty factor on this mesh: {text(same_mesh)}; {needed}")
    if coarse:
        count = value_of(references, COARSE, scene, "elements") or 0
        parts.append(f"with {count:.0f} elements: {text(coarse)}")
    limit = value_of(references, CONVERGED, scene, key)
    if limit is not None:
        parts.append(f"preset {CONVERGED}: {limit:.3g} N")
    return "; ".join(parts)


def _peaks(
    runs: CaseRuns, references: References, printed: Mapping[str, float]
) -> dict[str, Finding]:
    """Table 2: peak forces of both models, and their differences."""
    rows = {}
    for number, (scene, key) in enumerate(PEAKS, start=1):
        mine = scalar(runs[scene], key)
        errors = {
            name: error_percent(mine, value_of(references, name, scene, key)) for name in VARIANTS
        }
        theirs, error = value_of(references, JUDGED, scene, key), errors.pop(JUDGED)
        rows[f"T2.{number}"] = Finding(mine)
        wanted = printed[f"T2.{number + 4}"]
        reason = sensitivity(references, scene, key, wanted)
        if key == TANGENTIAL:
            ratio = abs(wanted) / printed[f"T2.{number + 3}"]
            ours = "" if theirs is None else f", ours slides throughout with mu = {SLIP_MU:g}"
            ratios = f"the printed forces are in the ratio {ratio:.3f}{ours}"
            reason = "; ".join(filter(None, (reason, ratios)))
        rows[f"T2.{number + 4}"] = Finding(theirs, reason)
        others = "; ".join(
            f"{name} {abs(other):.3g} %" for name, other in errors.items() if other is not None
        )
        rows[f"T2.{number + 8}"] = Finding(
            None if error is None else abs(error),
            f"hcm {mine:.4g} N against {theirs:.4g} N of the ls-dyna-like reference (other model);"
            f" the error is as uncertain as the reference: {others}"
            if theirs is not None else NO_REFERENCE,
            "the printed forces 32.218 and 29.683 N differ by"
            f" {100 * 2.535 / 32.218:.2f} % of the one and {100 * 2.535 / 29.683:.2f} % of the"
            " other, neither of which is 7.80 %" if number == 4 else "",
        )  # fmt: skip
    return rows


def _costs(references: References, printed: Mapping[str, float]) -> dict[str, Finding]:
    """Table 3: why a time or memory can't agree, and the models' ratio instead."""
    rows = {}
    for first, what, key in COSTS:
        for number, scene in enumerate(("hard", "soft"), start=first):
            ids = (f"T3.{number}", f"T3.{number + 2}")
            mine, theirs = (value_of(references, of, scene, key) for of in (REDUCED, JUDGED))
            ratio = f"reference over reduced model: printed {printed[ids[1]] / printed[ids[0]]:.3g}"
            if mine is not None and theirs is not None:
                ratio += f", ours {theirs / mine:.3g}"
                if what == "times":
                    ratio += " (our reference starts just before contact, from a rigid flight)"
            for id_, value in zip(ids, (mine, theirs), strict=True):
                own = "" if value is None else f"printed over ours {printed[id_] / value:.3g}; "
                rows[id_] = Finding(value, f"{OTHER_MACHINE}: {what} can't agree; {own}{ratio}")
    return rows


def validation_findings(runs: CaseRuns, references: References) -> dict[str, Finding]:
    """Findings by claim."""
    printed = {id_: c.number for id_, c in read_claims().items() if c.where.startswith("Table")}
    rows = _peaks(runs, references, printed) | _costs(references, printed)
    for number, scene in enumerate(("hard", "soft"), start=1):
        time, force = curve(runs[scene], "normal_force_N")
        coarse = np.interp(time, *curve(runs[f"{scene} N=15"], "normal_force_N"), right=0.0)
        gap = 100 * float(np.abs(coarse - force).max() / force.max())
        rows[f"F7.{number}"] = Finding(
            gap < 1.0, f"largest difference of Fn between N = 15 and 60: {gap:.2g} % of the peak"
        )
        count = transitions(runs[scene])
        rows[f"F9.{number}"] = Finding(
            1e3 * scalar(runs[scene], "contact_duration_s"),
            f"{count} compression-restitution transition{'s' if count > 1 else ''}",
        )
    hard, soft = (scalar(runs[scene], NORMAL) for scene in ("hard", "soft"))
    rows["C4.1.1"] = Finding(
        100 * soft / hard,
        "",
        f"the printed peaks 64.435 and 173.084 N make it {100 * 64.435 / 173.084:.1f} %,"
        " and the conclusion prints a decrease of 63 %",
    )
    rows["C5.1"] = Finding(100 * (1 - soft / hard))
    errors = [rows[f"T2.{number}"].value for number in (9, 10, 11, 12)]
    known = [float(error) for error in errors if error is not None]
    rows["A.2"] = Finding(
        max(known) < 8.0 if len(known) == len(errors) else None,
        f"largest error of a peak force against the ls-dyna-like reference: {max(known):.2g} %,"
        " as uncertain as each of them"
        if known else NO_REFERENCE,
    )  # fmt: skip
    return rows
