"""What a convergence study says: orders, limits, uncertainties, and what the preset is off by."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean, stdev
from typing import Any

from validation.compare.grid_convergence import Convergence, convergence
from validation.converge.refinement_runs import Values
from validation.converge.refinements import TIP_MESH, Refinement
from validation.harness.quantities import COMPARED, OF_A_TAP, Quantity

PRESET = "preset"
Verdicts = Mapping[tuple[str, Quantity], Convergence]  # by name of the refinement, and quantity


@dataclass(frozen=True)
class RefinedRuns:
    """The scalars of all runs of a refinement's completed levels, by size from coarse to fine."""

    refinement: Refinement
    values: Mapping[float, Sequence[Values]]

    @property
    def sizes(self) -> list[float]:
        """Of the levels, coarse to fine."""
        return list(self.values)

    def numbers(self, entry: Quantity) -> list[tuple[float, float]]:
        """Mean of one quantity and its standard error by level, SI; empty where a run has none."""
        found = []
        for runs in self.values.values():
            values = [values[entry.key] for values in runs]
            known = [float(value) for value in values if value is not None]
            if len(known) < len(values):
                return []
            error = stdev(known) / math.sqrt(len(known)) if len(known) > 1 else 0.0
            found.append((fmean(known), error))
        return found


def level_rows(results: Sequence[RefinedRuns]) -> list[dict[str, Any]]:
    """One row per run."""
    return [
        {"refinement": found.refinement.name, "refined": found.refinement.size_name, "size": size}
        | values
        for found in results
        for size, runs in found.values.items()
        for values in runs
    ]


def judged(results: Sequence[RefinedRuns]) -> Verdicts:
    """Verdict on each refinement and quantity that has three levels.

    The finest mean's standard error adds to its uncertainty.
    """
    verdicts = {}
    for found in results:
        for entry in OF_A_TAP:
            numbers = found.numbers(entry)
            if len(numbers) >= 3:
                order, means = found.refinement.order, [mean for mean, _ in numbers]
                verdict = convergence(found.sizes, means, order)
                scatter = abs(numbers[-1][1] / means[-1])
                sure = replace(verdict, uncertainty=verdict.uncertainty + scatter)
                verdicts[found.refinement.name, entry] = sure
    return verdicts


def verdict_rows(verdicts: Verdicts) -> list[dict[str, Any]]:
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


def preset_rows(preset: Values, verdicts: Verdicts) -> list[dict[str, Any]]:
    """The preset `converged` against the limit of the tip's refinement.

    Its uncertainty is what it is off by, and all refinements' uncertainties: a sum, not its root,
    for they need not be independent. The tip's limit is that of springs of the penalty's finest.
    """
    rows = []
    for entry in OF_A_TAP:
        value, tip = preset[entry.key], verdicts.get((TIP_MESH, entry))
        if value is None or tip is None:
            continue
        off = value / tip.limit - 1
        others = sum(found.uncertainty for (_, of), found in verdicts.items() if of == entry)
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


def preset_uncertainties(path: Path) -> dict[str, float]:
    """Relative uncertainties of the preset `converged` by key, from a study's ``convergence.csv``.

    Empty where there is no such file, or it is no study's.
    """
    if not path.is_file():
        return {}
    import pandas as pd

    table = pd.read_csv(path)
    if not {"refinement", "quantity", "uncertainty_percent"} <= set(table.columns):
        return {}
    known = {entry.key for entry in COMPARED}
    of_preset = table[table["refinement"] == PRESET].dropna(subset=["uncertainty_percent"])
    return {
        quantity: 0.01 * float(share)
        for quantity, share in of_preset[["quantity", "uncertainty_percent"]].to_numpy().tolist()
        if quantity in known
    }
