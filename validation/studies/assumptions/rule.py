"""Which assumptions a scene can do without: thresholds on quantities that are known before a run.

An assumption may be left out where peak, impulse and duration move by at most the error allowed.
Its rule is one inequality, x <= t or x >= t, in the quantity x that lets the most scenes do without
it and few of them wrongly, fitted on one half of the Sobol points and judged on the other.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from hcm.arrays import Floats
from validation.studies.assumptions.study import DIAMETER

ALLOWED = (1.0, 2.0, 5.0)  # percent
WRONG = 0.05  # largest wrong share of the scenes that a rule holds for, when fitted


@dataclass(frozen=True)
class Rule:
    """The rule ``sign x <= limit`` for the quantity x of that name; without one it never holds."""

    name: str = ""
    sign: float = 1.0
    limit: float = -np.inf

    def holds(self, known: pd.DataFrame) -> NDArray[np.bool_]:
        """Whether each scene can do without the assumption by this rule."""
        if not self.name:
            return np.zeros(len(known), dtype=bool)
        return np.asarray(self.sign * known[self.name] <= self.limit)

    def __str__(self) -> str:
        if not self.name:
            return "never"
        return f"{self.name} {'<=' if self.sign > 0 else '>='} {self.sign * self.limit:.3g}"


def fitted(known: pd.DataFrame, moved: Floats, allowed: float) -> Rule:
    """The rule that holds for the most scenes and for at most a share `WRONG` of them wrongly."""
    best, most = Rule(), 0
    for name in known.columns:
        for sign in (1.0, -1.0):
            x = sign * known[name].to_numpy(dtype=float)
            order = np.argsort(x)
            right = moved[order] <= allowed
            count = np.arange(1, len(x) + 1)
            kept = right & ((~right).cumsum() <= WRONG * count)
            if kept.any() and (inside := int(count[kept].max())) > most:
                best, most = Rule(name, sign, float(x[order[inside - 1]])), inside
    return best


def rules(
    table: pd.DataFrame, moved: Floats, names: list[str], cost: Mapping[str, Floats]
) -> pd.DataFrame:
    """A row for each assumption and error: the rule of all scenes, and its check by halves.

    moved : (assumption, scene), percent, nan where a run did not complete.
    cost : by a finger's name, shares of the refined model's time without each, (assumption,).
    """
    known = pd.DataFrame(  # before a run: the predicted patch, slenderness, friction
        {
            "a/R": table["patch_over_radius"],
            "L/d": table["finger.length"] / DIAMETER,
            "mu": table["surface.friction"],
        }
    )
    halves = np.array_split(np.arange(len(table)), 2)
    rows: list[dict[str, Any]] = []
    for number, (name, one) in enumerate(zip(names, moved, strict=True)):
        times = {f"time, {of} (%)": 100.0 * shares[number] for of, shares in cost.items()}
        for allowed in ALLOWED:
            said = wrong = 0
            for own, other in (halves, halves[::-1]):
                holds = fitted(known.iloc[own], one[own], allowed).holds(known.iloc[other])
                said += int(holds.sum())
                wrong += int((~(one[other][holds] <= allowed)).sum())
            rows.append(
                {
                    "without": name,
                    "error allowed (%)": allowed,
                    "rule": str(fitted(known, one, allowed)),
                    "scenes that could (%)": 100.0 * float((one <= allowed).mean()),
                    "the rule says so (%)": 100.0 * said / len(table),
                    "of these wrongly (%)": 100.0 * wrong / said if said else None,
                    **times,
                }
            )
    return pd.DataFrame(rows)
