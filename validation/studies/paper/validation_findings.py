"""Sections 4.1 and 5: tables 2 and 3, figs. 7 and 9."""

from collections.abc import Mapping

import numpy as np

from validation.compare.claims import read_claims
from validation.compare.verdict import error_percent
from validation.harness.record import RunRecord
from validation.studies.paper.ledger import Finding
from validation.studies.paper.readings import CaseRuns, curve, scalar, transitions
from validation.studies.paper.reference_runs import (
    JUDGED,
    VARIANTS,
    References,
    sensitivity,
    value_of,
)

NORMAL, TANGENTIAL = "peak_normal_force_N", "peak_tangential_force_N"
# In Table 2's order: claims T2.1 to T2.4 are hcm's, 5 to 8 the reference's, 9 to 12 the errors.
PEAKS = (("hard", NORMAL), ("hard", TANGENTIAL), ("soft", NORMAL), ("soft", TANGENTIAL))
SLIP_MU = 0.5  # of both scenes
COSTS = {"times": "wall_time_s", "memories": "peak_memory_MB"}
NO_REFERENCE = "no reference run"


def _peaks(
    runs: CaseRuns, references: References, printed: Mapping[str, float]
) -> dict[str, Finding]:
    """Table 2: peak forces of both models, and their differences."""
    rows = {}
    for number, (scene, key) in enumerate(PEAKS, start=1):
        mine, theirs = scalar(runs, scene, key), value_of(references, JUDGED, scene, key)
        rows[f"T2.{number}"] = Finding(mine)
        wanted = printed[f"T2.{number + 4}"]
        reason = sensitivity(references, scene, key, wanted)
        if key == TANGENTIAL:
            ratio = abs(wanted) / printed[f"T2.{number + 3}"]
            reason += (
                f"; the printed forces are in the ratio {ratio:.3f},"
                f" ours slides throughout with mu = {SLIP_MU:g}"
            )
        rows[f"T2.{number + 4}"] = Finding(theirs, reason)
        value = error_percent(mine, theirs)
        others = "; ".join(
            f"{name} {abs(error):.3g} %"
            for name in VARIANTS
            if name != JUDGED
            and (error := error_percent(mine, value_of(references, name, scene, key))) is not None
        )
        rows[f"T2.{number + 8}"] = Finding(
            None if value is None else abs(value),
            f"hcm {mine:.4g} N against {theirs:.4g} N of the ls-dyna-like reference (other model);"
            f" the error is as uncertain as the reference: {others}"
            if theirs is not None else NO_REFERENCE,
            "the printed forces 32.218 and 29.683 N differ by"
            f" {100 * 2.535 / 32.218:.2f} % of the one and {100 * 2.535 / 29.683:.2f} % of the"
            " other, neither of which is 7.80 %" if number == 4 else "",
        )  # fmt: skip
    return rows


def _costs(
    apart: Mapping[str, RunRecord], references: References, printed: Mapping[str, float]
) -> dict[str, Finding]:
    """Table 3: time, then memory, of both models; odd claims are the hard scene's."""
    rows = {}
    for first, scene in ((1, "hard"), (2, "soft")):
        for start, (what, key) in zip((first, first + 4), COSTS.items(), strict=True):
            ids = (f"T3.{start}", f"T3.{start + 2}")
            mine = apart[scene].value(key) if scene in apart else None
            ours = (mine, value_of(references, JUDGED, scene, key))
            for id_, value in zip(ids, ours, strict=True):
                reason = _other_machine(what, printed[id_], value, [printed[i] for i in ids], ours)
                rows[id_] = Finding(value, reason)
    return rows


def _other_machine(
    what: str, printed: float, value: float | None, prints: list[float],
    ours: tuple[float | None, float | None],
) -> str:  # fmt: skip
    """Why a run time or memory can't agree: how far off it is, and the models' ratio instead.

    prints, ours : printed and our values, of the reduced model and of the reference.
    """
    parts = [f"another program on another machine (4-core laptop of 2016): {what} can't agree"]
    if value is not None:
        parts.append(f"printed over ours {printed / value:.3g}")
    parts.append(f"reference over reduced model: printed {prints[1] / prints[0]:.3g}")
    if ours[0] is not None and ours[1] is not None:
        parts[-1] += f", ours {ours[1] / ours[0]:.3g}"
        if what == "times":
            parts[-1] += " (our reference starts just before contact, from a rigid flight)"
    return "; ".join(parts)


def validation_findings(
    runs: CaseRuns, apart: Mapping[str, RunRecord], references: References
) -> dict[str, Finding]:
    """Findings by claim.

    ``apart`` holds hcm's run of each scene in a process of its own, ``references`` those of the 3D
    model; a run that failed is absent.
    """
    printed = {id_: c.number for id_, c in read_claims().items() if c.where.startswith("Table")}
    rows = _peaks(runs, references, printed) | _costs(apart, references, printed)
    for number, scene in enumerate(("hard", "soft"), start=1):
        time, force = curve(runs[scene], "normal_force_N")
        coarse = np.interp(time, *curve(runs[f"{scene} N=15"], "normal_force_N"), right=0.0)
        gap = 100 * float(np.abs(coarse - force).max() / force.max())
        rows[f"F7.{number}"] = Finding(
            gap < 1.0, f"largest difference of Fn between N = 15 and 60: {gap:.2g} % of the peak"
        )
        count = transitions(runs[scene])
        rows[f"F9.{number}"] = Finding(
            1e3 * scalar(runs, scene, "contact_duration_s"),
            f"{count} compression-restitution transition{'s' if count > 1 else ''}",
        )
    hard, soft = (scalar(runs, scene, NORMAL) for scene in ("hard", "soft"))
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
        f"largest error of a peak force against the ls-dyna-like reference: {max(known):.2g} %"
        if known else NO_REFERENCE,
    )  # fmt: skip
    return rows
