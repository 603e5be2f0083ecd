"""The reduced model between the paper's assumptions and the refined ones.

Cumulative: from the paper's, one assumption after the other becomes the refined one's, in `ORDER`,
by which what an assumption is worth depends. Leave-one-out: the refined model with the paper's
choice of one, and of those that have no meaning without it. A tap ends by the same rule in all.
"""

from dataclasses import dataclass

from hcm.assumptions import NEEDS

ORDER = (
    "rotary_inertia",
    "half_ball",
    "lowest_point",
    "hertz",
    "partial_slip",
    "shear",
    "tip_compliance",
    "deforming_tip",
    "growing_patch",
    "radiating_tip",
)


@dataclass(frozen=True)
class Variant:
    """Assumptions by a name: which of `ORDER` are the refined model's."""

    name: str
    refined: frozenset[str]

    @property
    def overrides(self) -> tuple[str, ...]:
        """The scene's keys that make it so."""
        switches = (f"solver.hcm.{s}={str(s in self.refined).lower()}" for s in ORDER)
        return (*switches, "solver.hcm.whole_tap=true")


def cumulative() -> tuple[Variant, ...]:
    """The paper's assumptions, then one refined after the other."""
    names = ("paper", *(f"+ {switch}" for switch in ORDER))
    return tuple(Variant(name, frozenset(ORDER[:n])) for n, name in enumerate(names))


def all_variants() -> tuple[Variant, ...]:
    """The cumulative ones, then those with one left out."""
    return (*cumulative(), *leave_one_out())


def leave_one_out() -> tuple[Variant, ...]:
    """The refined model without each assumption, and without those that need it."""
    found = []
    for switch in ORDER:
        without = {switch, *(own for own, needed in NEEDS if needed == switch)}
        name = " and ".join(s for s in ORDER if s in without)
        found.append(Variant(f"without {name}", frozenset(ORDER) - without))
    return tuple(found)
