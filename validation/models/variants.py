"""The reduced model between the paper's assumptions and the refined ones.

Cumulative: starting from the paper's, assumptions become refined one after the other, in `ORDER`,
that of their declaration, on which the effect of each depends. Leave-one-out: the refined model
with the paper's choice of one assumption, and of those that mean nothing without it. A tap ends by
the same rule in all.
"""

from dataclasses import dataclass, fields
from typing import Any

from hcm.assumptions import NEEDS, Assumptions

ORDER = tuple([f.name for f in fields(Assumptions) if f.name not in ("assumptions", "whole_tap")])


@dataclass(frozen=True)
class Variant:
    """A named set of assumptions: which of `ORDER` are the refined model's."""

    name: str
    refined: frozenset[str]

    @property
    def assumptions(self) -> Assumptions:
        """These assumptions, as the solver takes them."""
        switches: dict[str, Any] = {switch: switch in self.refined for switch in ORDER}
        return Assumptions(**switches)

    @property
    def overrides(self) -> tuple[str, ...]:
        """Overrides of the scene that select these assumptions."""
        switches = (f"solver.hcm.{s}={str(s in self.refined).lower()}" for s in ORDER)
        return (*switches, "solver.hcm.whole_tap=true")


def cumulative() -> tuple[Variant, ...]:
    """The paper's assumptions, then with one after the other refined."""
    names = ("paper", *(f"+ {switch}" for switch in ORDER))
    return tuple(Variant(name, frozenset(ORDER[:n])) for n, name in enumerate(names))


def all_variants() -> tuple[Variant, ...]:
    """The cumulative variants, then those with one assumption left out."""
    return (*cumulative(), *leave_one_out())


def leave_one_out() -> tuple[Variant, ...]:
    """The refined model without each assumption in turn, and without those that need it."""
    found = []
    for switch in ORDER:
        without = {switch, *(own for own, needed in NEEDS if needed == switch)}
        name = " and ".join(s for s in ORDER if s in without)
        found.append(Variant(f"without {name}", frozenset(ORDER) - without))
    return tuple(found)


def short_name(name: str) -> str:
    """A variant's name in short: its first assumption, and how many others need that."""
    first, *others = name.split(" and ")
    return first + f" and {len(others)} that need{'s' * (len(others) == 1)} it" * bool(others)
