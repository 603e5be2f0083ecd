"""Results of a convergence study: orders, limits, uncertainties, and the preset's error."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from validation.compare.grid_convergence import Convergence, convergence
from validation.converge.refinement_runs import CAUTIONS, PEAKS, Values
from validation.converge.refinements import PENALTY, TIP_MESH, Refinement
from validation.harness.console import say
from validation.harness.files import file_digest, safe_name
from validation.harness.quantities import COMPARED, OF_A_TAP, Quantity
from validation.models.inputs import run_inputs
from validation.scenes.scene import Scene

PRESET = "preset"
STUDIED = "scene.json"  # the study's scene, stored beside its tables
Convergences = Mapping[tuple[str, Quantity], Convergence]  # by the refinement's name and quantity


@dataclass(frozen=True)
class RefinedRuns:
    """What is known of a refinement's completed levels, by their sizes from coarse to fine."""

    refinement: Refinement
    values: Mapping[float, Values]

    @property
    def sizes(self) -> list[float]:
        """Sizes of the levels, coarse to fine."""
        return list(self.values)

    def numbers(self, entry: Quantity) -> list[float]:
        """One quantity over the levels, SI; empty where a level has none."""
        values = [values[entry.key] for values in self.values.values()]
        return [] if None in values else [float(value) for value in values if value is not None]


def level_rows(results: Sequence[RefinedRuns]) -> list[dict[str, Any]]:
    """One row per run."""
    return [
        {"refinement": found.refinement.name, "refined": found.refinement.size_name, "size": size}
        | values
        for found in results
        for size, values in found.values.items()
    ]


def cautions(results: Sequence[RefinedRuns], preset: Values | None) -> list[str]:
    """Sentences on peaks that have no limit, and what the finest level of each refinement, and the
    preset, say of themselves.
    """
    runs = {found.refinement.name: [*found.values.values()] for found in results}
    if preset is not None:
        runs[PRESET] = [preset]
    spiked = [
        f"{name}: the peak force of {spikes} of {len(values)} levels is a spike of a few steps or"
        " elements, which has no limit: none is given"
        for name, values in runs.items()
        if (spikes := sum(one[PEAKS[0]] is None for one in values))
    ]
    own = {name: values[-1][CAUTIONS] for name, values in runs.items() if values}
    return [*spiked, *(f"{name}, finest: {text}" for name, text in own.items() if text)]


def judged(results: Sequence[RefinedRuns]) -> Convergences:
    """Verdict on each refinement and quantity that has three levels."""
    return {
        (found.refinement.name, entry): convergence(found.sizes, numbers, found.refinement.order)
        for found in results
        for entry in OF_A_TAP
        if len(numbers := found.numbers(entry)) >= 3
    }


def verdict_rows(verdicts: Convergences) -> list[dict[str, Any]]:
    """One row per refinement and quantity."""
    return [
        {
            "refinement": name,
            "quantity": entry.key,
            "finest": found.finest,
            "limit": found.limit,
            "order": found.order,
            "asymptotic": "yes" if found.asymptotic else "not asymptotic",
            "uncertainty_percent": 100 * found.uncertainty,
            "spread_percent": 100 * found.spread,
            "from_limit_percent": 100 * (found.finest / found.limit - 1),
        }
        for (name, entry), found in verdicts.items()
    ]


def study_name(scene: str, model: str, quick: bool = False) -> str:
    """Name of a study's folder."""
    return safe_name(f"{scene}-{model}" + ("-quick" if quick else ""))


def preset_rows(
    preset: Values, verdicts: Convergences, refined: Sequence[str]
) -> list[dict[str, Any]]:
    """Compare the preset `converged` with the limit of the tip's refinement; a row per quantity.

    Its uncertainty is its distance from the limit plus the uncertainties of all meshes and of the
    step: a plain sum, as they need not be independent. Its contact by impulses has no penalty.
    A quantity that one of the `refined` has no verdict on has no row.
    """
    rows, needed = [], [name for name in refined if name != PENALTY]
    for entry in OF_A_TAP:
        value = preset[entry.key]
        if not isinstance(value, float) or any((name, entry) not in verdicts for name in needed):
            continue
        tip = verdicts[TIP_MESH, entry]
        off = value / tip.limit - 1
        others = sum(verdicts[name, entry].uncertainty for name in needed)
        rows.append(
            {
                "refinement": PRESET,
                "quantity": entry.key,
                "finest": value,
                "limit": tip.limit,
                "uncertainty_percent": 100 * (abs(off) + others),
                "from_limit_percent": 100 * off,
            }
        )
    return rows


def study_of(tables: Scene, model: str, table: Path) -> dict[str, Any]:
    """What a study's ``convergence.csv`` belongs to, to be stored beside it: the scene, the code
    and libraries that made it, and its own digest.
    """
    inputs = run_inputs(tables, model, __name__, convergence_sha256=file_digest(table))
    made_by = inputs.pop("program")
    return inputs | {key: made_by[key] for key in ("source", "versions")}


def preset_uncertainties(folder: Path, tables: Scene) -> dict[str, float]:
    """Relative uncertainties of the preset `converged` by key, from a study's ``convergence.csv``.

    Empty if there is no such file, or if it is that of another scene; also, with a line that says
    so, if it was made by other code, of whatever scene, or has changed.
    """
    path, studied = folder / "convergence.csv", folder / STUDIED
    if not (path.is_file() and studied.is_file()):
        return {}
    try:
        found, now = json.loads(studied.read_bytes()), study_of(tables, "fem3d", path)
        changed = {key for key in now if found.get(key) != now[key]}
    except (OSError, ValueError, AttributeError):
        changed = {"convergence_sha256"}
    older = bool(changed & {"source", "versions"})
    if not older and changed & {"tables", "mesh_sha256"}:
        return {}
    if changed:
        why = "was made by other code or libraries" if older else "is damaged"
        say(f"{folder}: the study {why} and is left out; fingertap converge makes it anew")
        return {}
    try:
        table = pd.read_csv(path)
    except pd.errors.EmptyDataError:  # no refinement has three levels
        return {}
    known = {entry.key for entry in COMPARED}
    shares = table[table["refinement"] == PRESET].set_index("quantity")["uncertainty_percent"]
    return {key: 0.01 * float(share) for key, share in shares.dropna().items() if key in known}
