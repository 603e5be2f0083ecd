"""Sections 4.1 and 5: tables 2 and 3, figs. 7 and 9."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from validation.compare.claims import read_claims
from validation.compare.differences import error_percent
from validation.harness.record import RunRecord
from validation.studies.paper.ledger import Finding
from validation.studies.paper.readings import Runs, curve, scalar, transitions
from validation.studies.paper.reference_runs import JUDGED, VARIANTS, References, sensitivity

PEAKS = {"normal": "peak_normal_force_N", "tangential": "peak_tangential_force_N"}
SLIP_MU = 0.5  # of both scenes
TIME, MEMORY = "wall_time_s", "peak_memory_MB"


def _errors(runs: Runs, references: References) -> dict[str, Finding]:
    rows = {}
    for id_, scene, which in (
        ("T2.9", "hard", "normal"), ("T2.10", "hard", "tangential"),
        ("T2.11", "soft", "normal"), ("T2.12", "soft", "tangential"),
    ):  # fmt: skip
        mine, key = scalar(runs, scene, PEAKS[which]), PEAKS[which]
        theirs = references.value(JUDGED, scene, key)
        value = error_percent(mine, theirs)
        others = "; ".join(
            f"{name} {abs(error):.3g} %"
            for name in VARIANTS
            if name != JUDGED
            and (error := error_percent(mine, references.value(name, scene, key))) is not None
        )
        rows[id_] = Finding(
            None if value is None else abs(value),
            f"hcm {mine:.4g} N against {theirs:.4g} N of the ls-dyna-like reference (other model);"
            f" the error is as uncertain as the reference: {others}"
            if theirs is not None else "no reference run",
        )  # fmt: skip
    return rows


def _reference_rows(references: References, alone: Mapping[str, RunRecord]) -> dict[str, Finding]:
    claims = {claim.id: claim for claim in read_claims()}
    rows = {}
    for id_, scene, which in (
        ("T2.5", "hard", "normal"), ("T2.6", "hard", "tangential"),
        ("T2.7", "soft", "normal"), ("T2.8", "soft", "tangential"),
    ):  # fmt: skip
        printed = float(claims[id_].value)
        reason = sensitivity(references, scene, PEAKS[which], printed)
        if which == "tangential":
            normal = float(claims[f"T2.{int(id_[3:]) - 1}"].value)
            reason += (
                f"; the printed forces are in the ratio {abs(printed) / normal:.3f},"
                f" ours slides throughout with mu = {SLIP_MU:g}"
            )
        rows[id_] = Finding(references.value(JUDGED, scene, PEAKS[which]), reason)
    for scene, ids in (("hard", ("T3.1", "T3.3", "T3.5", "T3.7")),
                       ("soft", ("T3.2", "T3.4", "T3.6", "T3.8"))):  # fmt: skip
        mine = alone.get(scene)
        ours = [
            mine.value(TIME) if mine else None, references.value(JUDGED, scene, TIME),
            mine.value(MEMORY) if mine else None, references.value(JUDGED, scene, MEMORY),
        ]  # fmt: skip
        printed_ones = [float(claims[id_].value) for id_ in ids]
        for i, (id_, value) in enumerate(zip(ids, ours, strict=True)):
            first = 2 * (i // 2)
            rows[id_] = Finding(
                value, _machine(printed_ones[i], value, printed_ones[first:], ours[first:], i < 2)
            )
    return rows


def _machine(
    printed: float, ours: float | None, prints: list[float], values: list[float | None], time: bool
) -> str:
    """Why a run time or a memory can't agree: how far off it is, and the models' ratio instead."""
    what = "time" if time else "memory"
    parts = [f"another program on another machine (4-core laptop of 2016): {what}s can't agree"]
    if ours is not None:
        parts.append(f"printed over ours {printed / ours:.3g}")
    parts.append(f"reference over reduced model: printed {prints[1] / prints[0]:.3g}")
    if values[0] is not None and values[1] is not None:
        parts[-1] += f", ours {values[1] / values[0]:.3g}"
        if time:
            parts[-1] += " (our reference starts just before contact, from a rigid flight)"
    return "; ".join(parts)


def validation_findings(
    runs: Runs, alone: Mapping[str, RunRecord], references: References
) -> dict[str, Finding]:
    """Findings by claim.

    ``alone`` holds hcm's run of each scene in a process of its own, ``references`` those of the 3D
    model; a run that failed is absent.
    """
    rows = {**_reference_rows(references, alone), **_errors(runs, references)}
    hard, soft = (scalar(runs, s, PEAKS["normal"]) for s in ("hard", "soft"))
    for id_, scene, which in (
        ("T2.1", "hard", "normal"), ("T2.2", "hard", "tangential"),
        ("T2.3", "soft", "normal"), ("T2.4", "soft", "tangential"),
    ):  # fmt: skip
        rows[id_] = Finding(scalar(runs, scene, PEAKS[which]))
    error = abs(-32.218 + 29.683)
    rows["T2.12"] = Finding(
        rows["T2.12"].value,
        rows["T2.12"].reason,
        f"the printed forces 32.218 and 29.683 N differ by {100 * error / 32.218:.2f} % of the one"
        f" and {100 * error / 29.683:.2f} % of the other, neither of which is 7.80 %",
    )
    for id_, scene in (("F7.1", "hard"), ("F7.2", "soft")):
        time, force = curve(runs[scene], "normal_force_N")
        coarse = np.interp(time, *curve(runs[f"{scene} N=15"], "normal_force_N"), right=0.0)
        gap = 100 * float(np.abs(coarse - force).max() / force.max())
        rows[id_] = Finding(
            gap < 1.0, f"largest difference of Fn between N = 15 and 60: {gap:.2g} % of the peak"
        )
    for id_, scene in (("F9.1", "hard"), ("F9.2", "soft")):
        count = transitions(runs[scene])
        rows[id_] = Finding(
            1e3 * scalar(runs, scene, "contact_duration_s"),
            f"{count} compression-restitution transition{'s' if count > 1 else ''}",
        )
    rows["C4.1.1"] = Finding(
        100 * soft / hard,
        "",
        f"the printed peaks 64.435 and 173.084 N make it {100 * 64.435 / 173.084:.1f} %,"
        " and the conclusion prints a decrease of 63 %",
    )
    rows["C5.1"] = Finding(100 * (1 - soft / hard))
    errors = [rows[id_].value for id_ in ("T2.9", "T2.10", "T2.11", "T2.12")]
    known = [float(error) for error in errors if error is not None]
    rows["A.2"] = Finding(
        max(known) < 8.0 if len(known) == len(errors) else None,
        f"largest error of a peak force against the ls-dyna-like reference: {max(known):.2g} %"
        if known else "no reference run",
    )  # fmt: skip
    return rows
